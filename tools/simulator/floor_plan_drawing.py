"""A labelled drawing of the floor plans, side by side: rooms, walls, openings, stairs, furniture, camera path."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import F64, I32, U8
from placegraph.tools.simulator.house_model import ON_CEILING, ON_FLOOR, Color, Floor, House, PlacedItem, Room, Wall
from placegraph.tools.simulator.text_labels import LabelLayout

PX_PER_M = 90
MARGIN_M = 0.7
TITLE_PX = 70
SUBPIXEL_BITS = 4  # cv2's fixed point: edges lie where they are, not on whole pixels

PAPER: Color = (252, 251, 248)
INK: Color = (52, 50, 54)
WALL: Color = (74, 72, 78)
SILL: Color = (150, 196, 226)
PATH: Color = (214, 66, 96)
TINTS: dict[str, Color] = {
    "kitchen": (250, 233, 204), "dining room": (248, 226, 206), "living room": (226, 238, 216),
    "bedroom": (217, 228, 245), "kids room": (232, 222, 246), "bathroom": (208, 238, 240), "toilet": (208, 238, 240),
    "office": (240, 224, 232), "hallway": (238, 236, 230), "corridor": (238, 236, 230), "storage": (228, 226, 222),
}  # fmt: skip
OTHER_TINTS: tuple[Color, ...] = ((236, 240, 208), (246, 222, 222), (214, 236, 226), (236, 228, 214))
BUILT_IN = ("door", "window", "stairs")  # drawn, but not named: they are part of the plan


@dataclass(frozen=True, eq=False)
class PlanSheet:
    """The image of one floor and the transform from world to pixels."""

    image: U8  # (H, W, 3) RGB
    low: F64  # (2,) world x and y of the left bottom corner, in metres

    def px(self, points: F64) -> F64:
        """World points (N, 2) in metres to pixels (N, 2), x right and y down."""
        flipped = (np.asarray(points, np.float64) - self.low) * PX_PER_M
        return np.stack((flipped[:, 0], self.image.shape[0] - flipped[:, 1]), axis=1)

    def fill(self, polygon: F64, color: Color) -> None:
        """Fill a world polygon (N, 2)."""
        cv2.fillPoly(self.image, [self._fixed_point(polygon)], color, cv2.LINE_AA, SUBPIXEL_BITS)

    def line(self, points: F64, color: Color, closed: bool = False, width_px: int = 1) -> None:
        """Draw a world polyline (N, 2)."""
        cv2.polylines(self.image, [self._fixed_point(points)], closed, color, width_px, cv2.LINE_AA, SUBPIXEL_BITS)

    def dot(self, point: F64, radius_m: float, color: Color) -> None:
        """Draw a disc around a world point (2,)."""
        angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        self.fill(point + radius_m * np.stack((np.cos(angles), np.sin(angles)), axis=1), color)

    def _fixed_point(self, points: F64) -> I32:
        return np.round(self.px(points) * (1 << SUBPIXEL_BITS)).astype(np.int32)


def draw_floor_plan(house: House, path: F64) -> U8:
    """The plan (H, W, 3) RGB of a house, with the camera's path (N, 3) in metres, world frame."""
    outlines = np.concatenate([floor.outline for floor in house.floors])
    low, high = outlines.min(axis=0) - MARGIN_M, outlines.max(axis=0) + MARGIN_M
    width, height = np.ceil((high - low) * PX_PER_M).astype(int)
    sheets = []
    for floor in house.floors:
        sheet = PlanSheet(np.full((height, width, 3), PAPER, np.uint8), low)
        labels = LabelLayout(sheet.image)
        _draw_floor(sheet, labels, house, floor, path)
        title = np.full((TITLE_PX, width, 3), PAPER, np.uint8)
        LabelLayout(title).write(
            f"seed {house.seed}, floor {floor.index}", (width / 2, TITLE_PX * 0.6), 30, INK, bold=True
        )
        sheets.append(np.concatenate((title, sheet.image)))
    return np.concatenate(sheets, axis=1)


def _draw_floor(sheet: PlanSheet, labels: LabelLayout, house: House, floor: Floor, path: F64) -> None:
    for room in floor.rooms:
        sheet.fill(room.polygon, tint(room.type))
    rooms = [room.id for room in floor.rooms]
    # large and low things first, so that what stands on them stays visible
    items = sorted((item for item in house.items if item.room in rooms), key=lambda item: (item.box[1, 2], item.id))
    for item in items:
        _draw_item(sheet, item)
    for wall in floor.walls:
        _draw_wall(sheet, wall)
    _draw_stairs(sheet, house, floor)
    for room in floor.rooms:
        _name_room(sheet, labels, room, [item for item in items if item.room == room.id])
    _draw_path(sheet, house, floor, path)
    for item in sorted(items, key=lambda item: -_area_m2(item)):
        _name_item(sheet, labels, item)
    labels.draw()


def tint(room_type: str) -> Color:
    """The light colour of a room type; types without their own colour share a few."""
    return TINTS.get(room_type, OTHER_TINTS[sum(room_type.encode()) % len(OTHER_TINTS)])


def _area_m2(item: PlacedItem) -> float:
    low, high = item.item.extent
    return float((high[0] - low[0]) * (high[1] - low[1]))


def _draw_item(sheet: PlanSheet, placed: PlacedItem) -> None:
    if placed.item.name == "stairs":
        return  # drawn with their treads
    largest = max(placed.item.parts, key=lambda part: float(np.prod(np.ptp(part.vertices, axis=0) + 0.01)))
    color = np.array(largest.material.color, float)
    if placed.support != ON_CEILING:  # a lamp would hide the table below it
        r, g, b = np.round(0.62 * color + 0.38 * 255).astype(int).tolist()
        sheet.fill(placed.footprint, (r, g, b))
    r, g, b = np.round(0.55 * color).astype(int).tolist()
    sheet.line(placed.footprint, (r, g, b), closed=True)


def _draw_wall(sheet: PlanSheet, wall: Wall) -> None:
    a, b = np.array(wall.a, float), np.array(wall.b, float)
    length = float(np.linalg.norm(b - a))
    along = (b - a) / max(length, 1e-9)
    side = np.array([-along[1], along[0]]) * wall.thickness_m / 2

    def strip(start_m: float, end_m: float, share: float = 1.0) -> F64:
        p, q, s = a + along * start_m, a + along * end_m, side * share
        return np.array([p - s, q - s, q + s, p + s])

    sheet.fill(strip(-wall.thickness_m / 2, length + wall.thickness_m / 2), WALL)  # corners meet
    for opening in wall.openings:
        sheet.fill(strip(opening.start_m, opening.end_m, 1.05), PAPER if opening.kind == "window" else tint("hallway"))
        if opening.kind == "window":
            sheet.fill(strip(opening.start_m, opening.end_m, 0.4), SILL)
        else:
            sheet.line(strip(opening.start_m, opening.end_m), (190, 184, 172), closed=True)


def _draw_stairs(sheet: PlanSheet, house: House, floor: Floor) -> None:
    for stairs in house.stairs:
        if floor.index not in (stairs.floor, stairs.floor + 1):
            continue
        foot, head = stairs.foot[:2], stairs.head[:2]
        along = (head - foot) / max(float(np.linalg.norm(head - foot)), 1e-9)
        side = np.array([-along[1], along[0]]) * stairs.width_m / 2
        sheet.fill(np.array([foot - side, head - side, head + side, foot + side]), (222, 212, 198))
        for share in np.linspace(0, 1, 15):
            middle = foot + share * (head - foot)
            sheet.line(np.array([middle - side, middle + side]), (140, 128, 112))
        # the arrow points the way up
        neck = head - 0.25 * along
        sheet.line(np.array([foot, head]), INK, width_px=2)
        sheet.line(np.array([neck + side / 3, head, neck - side / 3]), INK, width_px=2)


def _draw_path(sheet: PlanSheet, house: House, floor: Floor, path: F64) -> None:
    levels = np.array([floor.z_m for floor in house.floors])
    on_floor = np.searchsorted(levels, path[:, 2], side="right") - 1 == floor.index
    if not on_floor.any():
        return
    over = PlanSheet(sheet.image.copy(), sheet.low)
    for piece in np.split(np.arange(len(path)), np.flatnonzero(np.diff(on_floor.astype(int))) + 1):
        if on_floor[piece[0]]:
            over.line(path[piece, :2], PATH, width_px=2)
    cv2.addWeighted(over.image, 0.55, sheet.image, 0.45, 0, dst=sheet.image)
    for index, color in ((0, (40, 150, 70)), (len(path) - 1, PATH)):
        if on_floor[index]:
            sheet.dot(path[index, :2], 0.09, PAPER)
            sheet.dot(path[index, :2], 0.065, color)


def _name_room(sheet: PlanSheet, labels: LabelLayout, room: Room, items: list[PlacedItem]) -> None:
    """Writes the room type where there is most free floor."""
    height, width = sheet.image.shape[:2]
    free = np.zeros((height, width), np.uint8)
    cv2.fillPoly(free, [np.round(sheet.px(room.polygon)).astype(np.int32)], 1)
    for item in items:
        if item.support == ON_FLOOR and item.item.name != "rug":
            cv2.fillPoly(free, [np.round(sheet.px(item.footprint)).astype(np.int32)], 0)
    # a word is wider than high: distance counts less across
    narrow = cv2.resize(free, (max(width // 3, 1), height), interpolation=cv2.INTER_NEAREST)
    distance = cv2.distanceTransform(cv2.copyMakeBorder(narrow, 1, 1, 1, 1, cv2.BORDER_CONSTANT), cv2.DIST_L2, 5)
    row, column = divmod(int(distance.argmax()), distance.shape[1])
    labels.add(room.type, [((column - 0.5) * 3, row - 0.5)], 25, INK, bold=True, must=True)


def _name_item(sheet: PlanSheet, labels: LabelLayout, placed: PlacedItem) -> None:
    if placed.item.name in BUILT_IN:
        return
    corners = sheet.px(placed.footprint)
    middle, (left, top), (right, bottom) = corners.mean(axis=0), corners.min(axis=0), corners.max(axis=0)
    standing = placed.support == ON_FLOOR
    size = 15 if standing else 11
    places = [(middle[0], y) for y in (middle[1], bottom + size * 0.7, top - size * 0.7)]
    places += [(x, middle[1]) for x in (right + size * 2.5, left - size * 2.5)]
    # furniture is named in any case; what stands or hangs on it where its name covers no other
    labels.add(placed.item.name, [(float(x), float(y)) for x, y in places], size, INK, must=standing)
