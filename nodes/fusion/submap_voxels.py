"""The voxels that one submap added, kept as they were fused, so that they can follow the submap when it moves.

Source: re-integration of submaps after loop closure as in Voxgraph and Cartographer. Not as there: voxels are moved as
points, not as distances.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.fusion.voxel_index import sum_by_key
from placegraph.runtime.arrays import F64, I64

D = TypeVar("D", bound=np.generic)
# voxels (N,), values (N, D) and a rigid transform (4, 4) to moved voxels, which may repeat, and their values
Resample = Callable[[I64, NDArray[D], F64], tuple[I64, NDArray[D]]]


class SubmapVoxels(Generic[D]):
    """Voxels (N,) and their values (N, D), and the rigid transform (4, 4) of the submap since they were fused."""

    def __init__(self, world_from_fused: F64 | None = None) -> None:
        self.world_from_fused = np.eye(4) if world_from_fused is None else world_from_fused
        self._pieces: list[tuple[I64, NDArray[D]]] = []

    def add(self, keys: I64, values: NDArray[D]) -> None:
        """Add values to sorted unique voxels; what repeats is summed when it is asked for."""
        self._pieces.append((keys, values))

    def fused(self) -> tuple[I64, NDArray[D]]:
        """Sorted voxels and summed values as they were fused."""
        if len(self._pieces) > 1:
            keys, values = (np.concatenate(column) for column in zip(*self._pieces, strict=True))
            self._pieces = [sum_by_key(keys, values)]
        return self._pieces[0]

    def placed(self, resample: Resample[D]) -> tuple[I64, NDArray[D]]:
        """Voxels, which may repeat, and values where the submap lies now."""
        return self._place(*self.fused(), resample)

    def discard(self, keys: I64, resample: Resample[D]) -> bool:
        """Drop what lies in these voxels now; returns whether anything is left."""
        kept = [~np.isin(self._place(*piece, resample)[0], keys) for piece in self._pieces]
        self._pieces = [(k[mask], v[mask]) for (k, v), mask in zip(self._pieces, kept, strict=True)]
        return any(mask.any() for mask in kept)

    def _place(self, keys: I64, values: NDArray[D], resample: Resample[D]) -> tuple[I64, NDArray[D]]:
        is_moved = not np.array_equal(self.world_from_fused, np.eye(4))
        return resample(keys, values, self.world_from_fused) if is_moved else (keys, values)
