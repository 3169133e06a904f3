"""A furniture group in its own frame: the wall behind it is y = 0, the group lies at y < 0, z = 0 is the floor.

A group that stands free has its middle at the origin. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from placegraph.runtime.arrays import F64, Bool
from placegraph.tools.simulator.catalogue import design
from placegraph.tools.simulator.house_model import ON_FLOOR, Item, SupportSurface

WALL_GAP_M = 0.04  # between furniture and wall, for the baseboard
GroupBuilder = Callable[[np.random.Generator, float], Iterator["GroupLayout"]]  # layouts for a room of so many m2

EDGE_M = 0.01  # smallest distance of an item to the edge of its support


@dataclass(frozen=True, eq=False)
class LayoutPiece:
    """One item in the frame of the group; `on` is the index of the piece it stands on, or ON_FLOOR, ON_WALL."""

    item: Item
    x: float
    y: float
    z: float
    yaw: float
    on: int = ON_FLOOR

    @property
    def footprint_rectangle(self) -> F64:
        """(4,) x0 y0 x1 y1 around its footprint, group frame."""
        return footprint_rectangle(self.item, self.x, self.y, self.yaw)


@dataclass(eq=False)
class GroupLayout:
    """A group while it is put together; `kind` is "" for a single item."""

    kind: str
    random: np.random.Generator
    backed: bool = True  # stands with its back (y = 0) to a wall
    pieces: list[LayoutPiece] = field(default_factory=list)

    def design(self, name: str, **sizes_m: float | None) -> Item:
        """A new item of a class, sizes as `catalogue.design` takes them."""
        return design(name, self.random, **sizes_m)

    def place_free(self, item: Item, x: float, y: float, yaw: float = 0.0, on: int = ON_FLOOR, z: float = 0.0) -> int:
        """Puts an item at (x, y); returns its index."""
        self.pieces.append(LayoutPiece(item, float(x), float(y), float(z), float(yaw), on))
        return len(self.pieces) - 1

    def place_at_wall(self, item: Item, x: float) -> int:
        """Puts an item with its back to the wall, its middle at x; returns its index."""
        return self.place_free(item, x, -WALL_GAP_M - item.extent[1, 1])

    def place_on(
        self, carrier: int, item: Item, x: float, y: float, yaw: float = 0.0, board: int | None = None
    ) -> bool:
        """Puts an item on a piece at (x, y) of the piece's frame, shifted onto its surface; False without space."""
        boards = self.pieces[carrier].item.surfaces
        if not boards:
            return False
        index = int(np.argmax([surface.z for surface in boards])) if board is None else board
        place = nearest_fit(boards[index], item, x, y, yaw)
        if place is None or self._is_occupied(carrier, boards[index], footprint_rectangle(item, *place, yaw)):
            return False
        base = self.pieces[carrier]
        c, s = np.cos(base.yaw), np.sin(base.yaw)
        self.place_free(
            item,
            base.x + c * place[0] - s * place[1],
            base.y + s * place[0] + c * place[1],
            base.yaw + yaw,
            carrier,
            base.z + boards[index].z,
        )
        return True

    def scatter_on(self, carrier: int, item: Item, boards: Sequence[int] | None = None, turn: float = 0.3) -> bool:
        """Puts an item on a piece at random, turned by up to `turn`; False without space."""
        surfaces = self.pieces[carrier].item.surfaces
        for board in self.random.permutation(range(len(surfaces)) if boards is None else boards)[:4].tolist():
            surface = surfaces[board]
            for _ in range(4):
                x, y = self.random.uniform(surface.x0, surface.x1), self.random.uniform(surface.y0, surface.y1)
                if self.place_on(carrier, item, x, y, float(self.random.uniform(-turn, turn)), board):
                    return True
        return False

    def _is_occupied(self, carrier: int, board: SupportSurface, footprint: F64) -> bool:
        """Whether something on the surface overlaps a footprint (4,) of the carrier's frame."""
        base = self.pieces[carrier]
        c, s = np.cos(base.yaw), np.sin(base.yaw)
        for piece in self.pieces:
            if piece.on == carrier and abs(piece.z - base.z - board.z) < 1e-6:
                dx, dy = piece.x - base.x, piece.y - base.y
                occupied = footprint_rectangle(piece.item, c * dx + s * dy, c * dy - s * dx, piece.yaw - base.yaw)
                if rectangles_overlap(footprint, occupied, 0.01).any():
                    return True
        return False


def footprint_rectangle(item: Item, x: float, y: float, yaw: float) -> F64:
    """(4,) x0 y0 x1 y1 around an item's footprint when it stands at (x, y), turned by `yaw`."""
    (x0, y0, _), (x1, y1, _) = item.extent
    c, s = np.cos(yaw), np.sin(yaw)
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) @ np.array([[c, s], [-s, c]]) + (x, y)
    return np.concatenate((corners.min(axis=0), corners.max(axis=0)))


def rectangles_overlap(rectangles: F64, others: F64, gap_m: float = 0.0) -> Bool:
    """Which rectangles (..., 4) come nearer than `gap_m` to others (..., 4), broadcast."""
    across = (rectangles[..., 0] < others[..., 2] + gap_m) & (others[..., 0] < rectangles[..., 2] + gap_m)
    return np.asarray(
        across & (rectangles[..., 1] < others[..., 3] + gap_m) & (others[..., 1] < rectangles[..., 3] + gap_m)
    )


def nearest_fit(board: SupportSurface, item: Item, x: float, y: float, yaw: float) -> tuple[float, float] | None:
    """The position nearest to (x, y) where an item is entirely on a surface, carrier's frame; None when too big."""
    x0, y0, x1, y1 = footprint_rectangle(item, 0.0, 0.0, yaw)
    low = np.array([board.x0 - x0, board.y0 - y0]) + EDGE_M
    high = np.array([board.x1 - x1, board.y1 - y1]) - EDGE_M
    if (low > high).any() or item.extent[1, 2] > board.clearance_m - 0.005:
        return None
    place = np.clip((x, y), low, high)
    return float(place[0]), float(place[1])
