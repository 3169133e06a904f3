"""A room while it is furnished: what stands where, and where one more group fits so that the room stays walkable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import F64, Bool
from placegraph.tools.simulator.groups.draft import Draft, overlapping
from placegraph.tools.simulator.model import NOWHERE, ON_FLOOR, ON_WALL, House, PlacedItem, Room
from placegraph.tools.simulator.sides import Side, sides_of
from placegraph.tools.simulator.space import (
    LOW_M,
    PASSAGES,
    cells_in,
    eroded,
    grown,
    inside,
    opening_rectangle,
    stands_in_the_way,
)  # fmt: skip

CELL_M, RADIUS_M = 0.05, 0.25
FREE_BEFORE_DOOR_M, FREE_AT_STAIRS_M, FREE_AT_WINDOW_M = 0.9, 1.0, 0.5
SILL_M = 0.95  # what is no higher may stand before a window, even where its sill is lower
GROUP_GAPS_M = (0.6, 0.45)  # between groups: the wide one wherever it fits
TRIALS = 10  # places that are tried for a walkable room before a group is given up
QUARTERS = np.array([[[1, 0], [0, 1]], [[0, -1], [1, 0]], [[-1, 0], [0, -1]], [[0, 1], [-1, 0]]], float)


@dataclass(frozen=True)
class Pose:
    """Where a group's frame lies in the world: metres, and quarter turns about z."""

    x: float
    y: float
    quarter: int


def bounds(placed: PlacedItem) -> F64:
    """(2, 3) box around an item's footprint and height: a turned round thing's footprint is wider than the thing."""
    box, corners = placed.box, placed.footprint
    box[:, :2] = corners.min(axis=0), corners.max(axis=0)
    return box


class Site:
    """One room, with everything that has found its place in it."""

    def __init__(self, house: House, room: Room, origin: F64, walkable: Bool) -> None:
        self.room, self.floor = room, house.floors[room.floor]
        self.sides: tuple[Side, ...] = sides_of(room, self.floor)
        self.items: list[PlacedItem] = []  # of this room, doors and stairs too
        self.boxes: list[F64] = []  # (2, 3) each, world frame: what wall things must keep clear of
        self.taken: list[F64] = []  # (4,) rectangles of what stands on the floor
        self.keepouts: list[F64] = []  # (4,) before doors and stairs
        self.accesses: list[F64] = []  # (2,) points that people come in by
        self.windows: list[tuple[F64, float]] = []  # (4,) rectangle before it, highest thing allowed there
        self.origin, self.walkable = self._own_part(origin, walkable)
        self._note_openings()
        self._note_stairs(house)
        for placed in house.items:
            self._note_fixture(placed)
        self._measure()

    def _own_part(self, origin: F64, walkable: Bool) -> tuple[F64, Bool]:
        """The part of the floor's grid around this room, only its own cells and those just beyond its doors."""
        low = np.floor((self.room.polygon.min(axis=0) - 0.8 - origin) / CELL_M).astype(int).clip(0)
        high = np.ceil((self.room.polygon.max(axis=0) + 0.8 - origin) / CELL_M).astype(int)
        part = walkable[low[1] : high[1], low[0] : high[0]]
        corner = origin + low * CELL_M
        own = np.zeros_like(part)
        own[cells_in(self.room.polygon, corner, part.shape, CELL_M)] = True
        for wall in self.floor.walls:
            for opening in wall.openings:
                if opening.kind in PASSAGES:
                    own[cells_in(opening_rectangle(wall, opening, 0.35), corner, part.shape, CELL_M)] = True
        return corner, part & own

    def _note_openings(self) -> None:
        for side in self.sides:
            for gap in side.gaps:
                if gap.kind in PASSAGES:
                    self.keepouts.append(side.strip(gap.start_m, gap.end_m, FREE_BEFORE_DOOR_M))
                    self.accesses.append(side.at((gap.start_m + gap.end_m) / 2, 0.3))
                else:
                    self.windows.append((side.strip(gap.start_m, gap.end_m, FREE_AT_WINDOW_M), max(gap.low_m, SILL_M)))

    def _note_stairs(self, house: House) -> None:
        for stairs in house.stairs:
            way = (stairs.head - stairs.foot)[:2]
            way = way / np.linalg.norm(way)
            for floor, end, out in ((stairs.floor, stairs.foot[:2], -way), (stairs.floor + 1, stairs.head[:2], way)):
                if floor == self.room.floor and inside(self.room.polygon, end + out * 0.4):
                    across = np.array([-way[1], way[0]]) * stairs.width_m / 2
                    corners = np.stack((end - across, end + across, end + out * FREE_AT_STAIRS_M))
                    self.keepouts.append(np.concatenate((corners.min(axis=0), corners.max(axis=0))))
                    self.accesses.append(end + out * 0.4)

    def _note_fixture(self, placed: PlacedItem) -> None:
        box = placed.box
        if box[1, 2] <= self.floor.z_m + LOW_M or box[0, 2] >= self.floor.z_m + self.floor.height_m:
            return
        near = np.concatenate((self.room.polygon.min(axis=0) - 0.3, self.room.polygon.max(axis=0) + 0.3))
        if not overlapping(np.concatenate((box[0, :2], box[1, :2])), near).any():
            return
        if placed.item.name == "window":  # a part of the wall: `sides` knows of it
            return
        self.boxes.append(box)
        if stands_in_the_way(placed, self.floor):
            self.keepouts.append(np.concatenate((box[0, :2] - 0.1, box[1, :2] + 0.1)))
            self._block(self.walkable, placed.footprint)

    def _measure(self) -> None:
        """Note what is free before there is any furniture: the yardstick for what furniture may take away."""
        blocked = np.pad(~self.walkable, ((1, 0), (1, 0))).astype(np.int64)
        self._blocked_sum = blocked.cumsum(axis=0).cumsum(axis=1)
        free = eroded(self.walkable, CELL_M, RADIUS_M)
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
        mask[cells_in(grown(footprint, CELL_M / 2), self.origin, mask.shape, CELL_M)] = False

    def find(self, draft: Draft, wanted: F64 | None = None, gaps_m: Sequence[float] = GROUP_GAPS_M) -> Pose | None:
        """A place for a group, preferably near a wanted point (2,) or else in a corner; None when there is none."""
        for gap_m in gaps_m:
            found: list[tuple[float, Pose]] = []
            for quarter, places, cost in self._places(draft, wanted):
                good = self._fits(draft, quarter, places, gap_m)
                found += [
                    (float(c), Pose(x, y, quarter)) for (x, y), c in zip(places[good].tolist(), cost[good], strict=True)
                ]
            found.sort(key=lambda one: (one[0], one[1].x, one[1].y, one[1].quarter))
            tried: list[Pose] = []
            for _, pose in found:
                if all(np.hypot(pose.x - p.x, pose.y - p.y) > 0.25 for p in tried):
                    if self.stays_walkable(self.posed(draft, pose, 0)):
                        return pose
                    tried.append(pose)
                    if len(tried) >= TRIALS:
                        break
        return None

    def _places(self, draft: Draft, wanted: F64 | None) -> list[tuple[int, F64, F64]]:
        """Places to try: quarter turns, points (N, 2), costs (N,)."""
        standing = np.stack([piece.rectangle for piece in draft.pieces if piece.on == ON_FLOOR])
        left, right = standing[:, 0].min(), standing[:, 2].max()
        result = []
        if draft.backed:
            for side in self.sides:
                first, last = right + 0.03, side.length_m + left - 0.03  # the group's x runs against the side
                if last < first:
                    continue
                t = np.append(np.arange(first, last, 0.1), last)
                points = side.start + t[:, None] * side.along
                cost = np.minimum(t - first, last - t) * 0.7 + draft.random.uniform(0, 1.2)
                result.append((round(side.yaw / (np.pi / 2)) % 4, points, cost))
        else:
            low, high = self.room.polygon.min(axis=0), self.room.polygon.max(axis=0)
            x, y = np.meshgrid(np.arange(low[0], high[0], 0.15), np.arange(low[1], high[1], 0.15))
            points = np.stack((x.ravel(), y.ravel()), axis=1)
            for quarter in draft.random.permutation(4)[:2].tolist():
                result.append(
                    (quarter, points, np.linalg.norm(points - self.middle, axis=1) + draft.random.uniform(0, 0.8))
                )
        noisy = [(q, p, c + draft.random.uniform(0, 0.5, len(p))) for q, p, c in result]
        if wanted is not None:
            noisy = [(q, p, np.linalg.norm(p - wanted, axis=1) + 0.3 * c) for q, p, c in noisy]
        return noisy

    def _fits(self, draft: Draft, quarter: int, places: F64, gap_m: float) -> Bool:
        """(N,) whether a group fits at places (N, 2), by its rectangles."""
        pieces = [piece for piece in draft.pieces if piece.on in (ON_FLOOR, ON_WALL)]
        local = np.stack([piece.rectangle for piece in pieces])
        corners = local.reshape(-1, 2, 2) @ QUARTERS[quarter].T
        turned = np.concatenate((corners.min(axis=1), corners.max(axis=1)), axis=1)
        boxes = turned[None] + np.tile(places, 2)[:, None]  # (N, K, 4)
        ends = np.stack((self.room.polygon, np.roll(self.room.polygon, -1, axis=0)))
        edges = np.concatenate((ends.min(axis=0), ends.max(axis=0)), axis=1)
        good = np.asarray(~overlapping(boxes[:, :, None], edges, -0.002).any(axis=(1, 2)))
        good &= inside(self.room.polygon, (boxes[..., :2] + boxes[..., 2:]) / 2).all(axis=1)
        if self.keepouts:
            good &= ~overlapping(boxes[:, :, None], np.stack(self.keepouts)).any(axis=(1, 2))
        tops = np.array(
            [0.9 if p.item.name == "sink" else p.z + p.item.extent[1, 2] for p in pieces]
        )  # a tap hides no view
        for zone, highest_m in self.windows:
            good &= ~overlapping(boxes[:, tops > highest_m + 0.01], zone).any(axis=1)
        standing = np.array([piece.on == ON_FLOOR for piece in pieces])
        if self.taken:
            good &= ~overlapping(boxes[:, standing][:, :, None], np.stack(self.taken), gap_m).any(axis=(1, 2))
        good[good] &= self.is_bare(boxes[good]).all(axis=1)
        return good

    def is_bare(self, boxes: F64) -> Bool:
        """(...) whether no pilaster, parapet or stairs is within rectangles (..., 4)."""
        low = np.ceil((boxes[..., :2] + 0.03 - self.origin) / CELL_M - 0.5).astype(int)
        high = np.floor((boxes[..., 2:] - 0.03 - self.origin) / CELL_M + 0.5).astype(int)
        limit = np.array(self._blocked_sum.shape)[::-1] - 1
        (x0, y0), (x1, y1) = (np.moveaxis(np.clip(one, 0, limit), -1, 0) for one in (low, np.maximum(low, high)))
        total = self._blocked_sum
        return np.asarray(total[y1, x1] - total[y0, x1] - total[y1, x0] + total[y0, x0] == 0)

    def stays_walkable(self, more: Sequence[PlacedItem]) -> bool:
        """Whether with these items, too, every door leads to every other and to nearly all that is free."""
        mask = self.walkable.copy()
        for placed in more:
            if placed.support in (ON_FLOOR, ON_WALL) and stands_in_the_way(placed, self.floor):
                self._block(mask, placed.footprint)
        free = eroded(mask, CELL_M, RADIUS_M)
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

    def posed(self, draft: Draft, pose: Pose, first_id: int, location: int = NOWHERE) -> list[PlacedItem]:
        """A group's items at a place, with ids from `first_id`."""
        turn, result = QUARTERS[pose.quarter], []
        for number, piece in enumerate(draft.pieces):
            x, y = (turn @ (piece.x, piece.y) + (pose.x, pose.y)).tolist()
            support = piece.on + first_id if piece.on >= 0 else piece.on
            yaw = float((piece.yaw + pose.quarter * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi)
            z = self.floor.z_m + piece.z
            result.append(PlacedItem(first_id + number, piece.item, x, y, z, yaw, self.room.id, support, location))
        return result

    def is_kept_free(self, placed: PlacedItem) -> bool:
        """Whether an item is where nothing may stand: before a door or at the stairs."""
        box = bounds(placed)
        rectangle = np.concatenate((box[0, :2], box[1, :2]))
        return any(bool(overlapping(rectangle, one)) for one in self.keepouts)

    def is_clear(self, placed: PlacedItem, gap_m: float) -> bool:
        """Whether an item's box comes no nearer than a gap to any other box of the room."""
        box = bounds(placed)
        return not any((box[0] < other[1] + gap_m).all() and (other[0] < box[1] + gap_m).all() for other in self.boxes)

    def add(self, placed: Sequence[PlacedItem]) -> None:
        """Note items that have found their place."""
        for one in placed:
            box = bounds(one)
            self.items.append(one)
            self.boxes.append(box)
            if one.support == ON_FLOOR:
                self.taken.append(np.concatenate((box[0, :2], box[1, :2])))
            if one.support in (ON_FLOOR, ON_WALL) and stands_in_the_way(one, self.floor):
                self._block(self.walkable, one.footprint)
