"""Occupancy of a room while it is furnished, and the search for a pose where one more group fits.

The room stays walkable: all doors remain connected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import F64, Bool
from placegraph.tools.simulator.furniture_groups.group_layout import GroupLayout, rectangles_overlap
from placegraph.tools.simulator.house_model import NOWHERE, ON_FLOOR, ON_WALL, House, PlacedItem, Room
from placegraph.tools.simulator.occupancy_grid import (
    LOW_M,
    PASSAGE_KINDS,
    blocks_robot,
    cells_in_polygon,
    erode_by_radius,
    expand_rectangle,
    opening_rectangle,
    points_in_polygon,
)  # fmt: skip
from placegraph.tools.simulator.room_sides import RoomSide, room_sides

CELL_M, RADIUS_M = 0.05, 0.25
FREE_BEFORE_DOOR_M, FREE_AT_STAIRS_M, FREE_AT_WINDOW_M = 0.9, 1.0, 0.5
SILL_M = 0.95  # furniture up to this height may stand in front of a window
GROUP_GAPS_M = (0.6, 0.45)  # between groups; the wide gap is tried first
TRIALS = 10  # poses tried before a group is given up
QUARTERS = np.array([[[1, 0], [0, 1]], [[0, -1], [1, 0]], [[-1, 0], [0, -1]], [[0, 1], [-1, 0]]], float)


@dataclass(frozen=True)
class GroupPose:
    """Pose of a group in the world: metres, and quarter turns about z."""

    x: float
    y: float
    quarter: int


def box_around(placed: PlacedItem) -> F64:
    """(2, 3) box of an item's footprint and height; for a turned round item it is wider than the item."""
    box, corners = placed.box, placed.footprint
    box[:, :2] = corners.min(axis=0), corners.max(axis=0)
    return box


class RoomPlanner:
    """One room with everything that has been placed in it."""

    def __init__(self, house: House, room: Room, origin: F64, walkable: Bool) -> None:
        self.room, self.floor = room, house.floors[room.floor]
        self.sides: tuple[RoomSide, ...] = room_sides(room, self.floor)
        self.items: list[PlacedItem] = []  # of this room, doors and stairs too
        self.boxes: list[F64] = []  # (2, 3) each, world frame; wall items keep clear of them
        self.taken: list[F64] = []  # (4,) rectangles of what stands on the floor
        self.keepouts: list[F64] = []  # (4,) before doors and stairs
        self.accesses: list[F64] = []  # (2,) points inside the doors and at the stairs
        self.windows: list[tuple[F64, float]] = []  # (4,) rectangle before it, highest thing allowed there
        self.origin, self.walkable = self._crop_to_room(origin, walkable)
        self._add_openings()
        self._add_stairs(house)
        for placed in house.items:
            self._add_fixture(placed)
        self._measure_free_space()

    def _crop_to_room(self, origin: F64, walkable: Bool) -> tuple[F64, Bool]:
        """The part of the floor's grid around this room: its own cells and those just beyond its doors."""
        low = np.floor((self.room.polygon.min(axis=0) - 0.8 - origin) / CELL_M).astype(int).clip(0)
        high = np.ceil((self.room.polygon.max(axis=0) + 0.8 - origin) / CELL_M).astype(int)
        part = walkable[low[1] : high[1], low[0] : high[0]]
        corner = origin + low * CELL_M
        own_cells = np.zeros_like(part)
        own_cells[cells_in_polygon(self.room.polygon, corner, part.shape, CELL_M)] = True
        for wall in self.floor.walls:
            for opening in wall.openings:
                if opening.kind in PASSAGE_KINDS:
                    own_cells[cells_in_polygon(opening_rectangle(wall, opening, 0.35), corner, part.shape, CELL_M)] = (
                        True
                    )
        return corner, part & own_cells

    def _add_openings(self) -> None:
        for side in self.sides:
            for gap in side.gaps:
                if gap.kind in PASSAGE_KINDS:
                    self.keepouts.append(side.strip(gap.start_m, gap.end_m, FREE_BEFORE_DOOR_M))
                    self.accesses.append(side.at((gap.start_m + gap.end_m) / 2, 0.3))
                else:
                    self.windows.append((side.strip(gap.start_m, gap.end_m, FREE_AT_WINDOW_M), max(gap.low_m, SILL_M)))

    def _add_stairs(self, house: House) -> None:
        for stairs in house.stairs:
            way = (stairs.head - stairs.foot)[:2]
            way = way / np.linalg.norm(way)
            for floor, end, out in ((stairs.floor, stairs.foot[:2], -way), (stairs.floor + 1, stairs.head[:2], way)):
                if floor == self.room.floor and points_in_polygon(self.room.polygon, end + out * 0.4):
                    across = np.array([-way[1], way[0]]) * stairs.width_m / 2
                    corners = np.stack((end - across, end + across, end + out * FREE_AT_STAIRS_M))
                    self.keepouts.append(np.concatenate((corners.min(axis=0), corners.max(axis=0))))
                    self.accesses.append(end + out * 0.4)

    def _add_fixture(self, placed: PlacedItem) -> None:
        box = placed.box
        if box[1, 2] <= self.floor.z_m + LOW_M or box[0, 2] >= self.floor.z_m + self.floor.height_m:
            return
        near = np.concatenate((self.room.polygon.min(axis=0) - 0.3, self.room.polygon.max(axis=0) + 0.3))
        if not rectangles_overlap(np.concatenate((box[0, :2], box[1, :2])), near).any():
            return
        if placed.item.name == "window":  # part of the wall, see room_sides
            return
        self.boxes.append(box)
        if blocks_robot(placed, self.floor):
            self.keepouts.append(np.concatenate((box[0, :2] - 0.1, box[1, :2] + 0.1)))
            self._block(self.walkable, placed.footprint)

    def _measure_free_space(self) -> None:
        """Records the free space before furnishing, the reference for what furniture may take away."""
        blocked = np.pad(~self.walkable, ((1, 0), (1, 0))).astype(np.int64)
        self._blocked_sum = blocked.cumsum(axis=0).cumsum(axis=1)
        free = erode_by_radius(self.walkable, CELL_M, RADIUS_M)
        rows, columns = np.nonzero(free)
        self._free_before = len(rows)
        cells = np.stack((columns, rows), axis=1)
        middles = self.origin + (cells + 0.5) * CELL_M
        self._access_cells: list[tuple[int, int]] = []
        for point in self.accesses:
            away = np.linalg.norm(middles - point, axis=1)
            if len(away) and away.min() < 0.4:
                column, row = cells[int(away.argmin())].tolist()
                self._access_cells.append((row, column))
        depth = cv2.distanceTransform(self.walkable.astype(np.uint8), cv2.DIST_L2, 5)
        row, column = np.unravel_index(int(depth.argmax()), depth.shape)
        self.middle = self.origin + (np.array([column, row]) + 0.5) * CELL_M

    def _block(self, mask: Bool, footprint: F64) -> None:
        mask[cells_in_polygon(expand_rectangle(footprint, CELL_M / 2), self.origin, mask.shape, CELL_M)] = False

    def find_pose(
        self, layout: GroupLayout, near: F64 | None = None, gaps_m: Sequence[float] = GROUP_GAPS_M
    ) -> GroupPose | None:
        """A pose for a group, preferably near a point (2,) or else in a corner; None when there is none."""
        for gap_m in gaps_m:
            candidates: list[tuple[float, GroupPose]] = []
            for quarter, places, cost in self._candidate_places(layout, near):
                good = self._fits(layout, quarter, places, gap_m)
                candidates += [
                    (float(c), GroupPose(x, y, quarter))
                    for (x, y), c in zip(places[good].tolist(), cost[good], strict=True)
                ]
            candidates.sort(key=lambda candidate: (candidate[0], candidate[1].x, candidate[1].y, candidate[1].quarter))
            tried: list[GroupPose] = []
            for _, pose in candidates:
                if all(np.hypot(pose.x - p.x, pose.y - p.y) > 0.25 for p in tried):
                    if self.stays_walkable(self.place_group(layout, pose, 0)):
                        return pose
                    tried.append(pose)
                    if len(tried) >= TRIALS:
                        break
        return None

    def _candidate_places(self, layout: GroupLayout, near: F64 | None) -> list[tuple[int, F64, F64]]:
        """Candidate places: quarter turns, points (N, 2), costs (N,)."""
        standing = np.stack([piece.footprint_rectangle for piece in layout.pieces if piece.on == ON_FLOOR])
        left, right = standing[:, 0].min(), standing[:, 2].max()
        result = []
        if layout.backed:
            for side in self.sides:
                first, last = right + 0.03, side.length_m + left - 0.03  # the group's x runs against the side
                if last < first:
                    continue
                t = np.append(np.arange(first, last, 0.1), last)
                points = side.start + t[:, None] * side.along
                cost = np.minimum(t - first, last - t) * 0.7 + layout.random.uniform(0, 1.2)
                result.append((round(side.yaw / (np.pi / 2)) % 4, points, cost))
        else:
            low, high = self.room.polygon.min(axis=0), self.room.polygon.max(axis=0)
            x, y = np.meshgrid(np.arange(low[0], high[0], 0.15), np.arange(low[1], high[1], 0.15))
            points = np.stack((x.ravel(), y.ravel()), axis=1)
            for quarter in layout.random.permutation(4)[:2].tolist():
                result.append(
                    (quarter, points, np.linalg.norm(points - self.middle, axis=1) + layout.random.uniform(0, 0.8))
                )
        noisy = [(q, p, c + layout.random.uniform(0, 0.5, len(p))) for q, p, c in result]
        if near is not None:
            noisy = [(q, p, np.linalg.norm(p - near, axis=1) + 0.3 * c) for q, p, c in noisy]
        return noisy

    def _fits(self, layout: GroupLayout, quarter: int, places: F64, gap_m: float) -> Bool:
        """(N,) whether the rectangles of a group fit at places (N, 2)."""
        pieces = [piece for piece in layout.pieces if piece.on in (ON_FLOOR, ON_WALL)]
        local = np.stack([piece.footprint_rectangle for piece in pieces])
        corners = local.reshape(-1, 2, 2) @ QUARTERS[quarter].T
        turned = np.concatenate((corners.min(axis=1), corners.max(axis=1)), axis=1)
        boxes = turned[None] + np.tile(places, 2)[:, None]  # (N, K, 4)
        ends = np.stack((self.room.polygon, np.roll(self.room.polygon, -1, axis=0)))
        edges = np.concatenate((ends.min(axis=0), ends.max(axis=0)), axis=1)
        good = np.asarray(~rectangles_overlap(boxes[:, :, None], edges, -0.002).any(axis=(1, 2)))
        good &= points_in_polygon(self.room.polygon, (boxes[..., :2] + boxes[..., 2:]) / 2).all(axis=1)
        if self.keepouts:
            good &= ~rectangles_overlap(boxes[:, :, None], np.stack(self.keepouts)).any(axis=(1, 2))
        tops = np.array(
            [0.9 if p.item.name == "sink" else p.z + p.item.extent[1, 2] for p in pieces]
        )  # a tap may stand in front of a window
        for zone, highest_m in self.windows:
            good &= ~rectangles_overlap(boxes[:, tops > highest_m + 0.01], zone).any(axis=1)
        standing = np.array([piece.on == ON_FLOOR for piece in pieces])
        if self.taken:
            good &= ~rectangles_overlap(boxes[:, standing][:, :, None], np.stack(self.taken), gap_m).any(axis=(1, 2))
        good[good] &= self.is_unbuilt(boxes[good]).all(axis=1)
        return good

    def is_unbuilt(self, boxes: F64) -> Bool:
        """(...) whether rectangles (..., 4) are free of pilasters, parapets and stairs."""
        low = np.ceil((boxes[..., :2] + 0.03 - self.origin) / CELL_M - 0.5).astype(int)
        high = np.floor((boxes[..., 2:] - 0.03 - self.origin) / CELL_M + 0.5).astype(int)
        limit = np.array(self._blocked_sum.shape)[::-1] - 1
        (x0, y0), (x1, y1) = (
            np.moveaxis(np.clip(corners, 0, limit), -1, 0) for corners in (low, np.maximum(low, high))
        )
        total = self._blocked_sum
        return np.asarray(total[y1, x1] - total[y0, x1] - total[y1, x0] + total[y0, x0] == 0)

    def stays_walkable(self, more: Sequence[PlacedItem]) -> bool:
        """Whether with these items, too, all doors are connected and nearly all free floor is reachable."""
        mask = self.walkable.copy()
        for placed in more:
            if placed.support in (ON_FLOOR, ON_WALL) and blocks_robot(placed, self.floor):
                self._block(mask, placed.footprint)
        free = erode_by_radius(mask, CELL_M, RADIUS_M)
        if not all(free[cell] for cell in self._access_cells):
            return False
        _, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
        sizes = np.bincount(labels[free], minlength=1)
        start = labels[self._access_cells[0]] if self._access_cells else int(sizes.argmax())
        if any(labels[cell] != start for cell in self._access_cells):
            return False
        rows, columns = np.nonzero(labels == start)
        middles = self.origin + (np.stack((columns, rows), axis=1) + 0.5) * CELL_M
        near_middle = len(rows) > 0 and np.linalg.norm(middles - self.middle, axis=1).min() < 1.3
        return bool(near_middle and len(rows) >= max(0.93 * free.sum(), 0.25 * self._free_before))

    def place_group(
        self, layout: GroupLayout, pose: GroupPose, first_id: int, location: int = NOWHERE
    ) -> list[PlacedItem]:
        """The items of a group at a pose, with ids from `first_id`."""
        turn, result = QUARTERS[pose.quarter], []
        for number, piece in enumerate(layout.pieces):
            x, y = (turn @ (piece.x, piece.y) + (pose.x, pose.y)).tolist()
            support = piece.on + first_id if piece.on >= 0 else piece.on
            yaw = float((piece.yaw + pose.quarter * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi)
            z = self.floor.z_m + piece.z
            result.append(PlacedItem(first_id + number, piece.item, x, y, z, yaw, self.room.id, support, location))
        return result

    def is_kept_free(self, placed: PlacedItem) -> bool:
        """Whether an item is where nothing may stand: in front of a door or at the stairs."""
        box = box_around(placed)
        footprint_rectangle = np.concatenate((box[0, :2], box[1, :2]))
        return any(bool(rectangles_overlap(footprint_rectangle, keepout)) for keepout in self.keepouts)

    def is_clear(self, placed: PlacedItem, gap_m: float) -> bool:
        """Whether an item's box keeps a distance of `gap_m` to all other boxes of the room."""
        box = box_around(placed)
        return not any(
            (box[0] < other_box[1] + gap_m).all() and (other_box[0] < box[1] + gap_m).all() for other_box in self.boxes
        )

    def add(self, placed: Sequence[PlacedItem]) -> None:
        """Records placed items."""
        for item in placed:
            box = box_around(item)
            self.items.append(item)
            self.boxes.append(box)
            if item.support == ON_FLOOR:
                self.taken.append(np.concatenate((box[0, :2], box[1, :2])))
            if item.support in (ON_FLOOR, ON_WALL) and blocks_robot(item, self.floor):
                self._block(self.walkable, item.footprint)
