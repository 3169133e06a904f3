"""Submaps: runs of consecutive keyframes that move as one when the pose graph moves.

Source: submaps as in Cartographer and Voxgraph. Departs: a submap follows its middle keyframe, which halves what its
first and last are off by.
"""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Correction
from placegraph.runtime.vision.geometry import inverse, is_rigid, rotation_angle_rad


class SubmapConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """How long a submap is, and which moves matter."""

    keyframes: int = Field(
        default=8, ge=1
    )  # departs: about a metre of walk, over which odometry drifts by a centimetre
    min_move_m: float = Field(default=0.01, ge=0)  # under a voxel; what is left undone adds up until it is done
    min_turn_deg: float = Field(default=0.5, ge=0)


class Submaps:
    """Which submap a keyframe is of, where keyframes are now, and how each submap lies to where it was fused."""

    def __init__(self, config: SubmapConfig) -> None:
        self._config = config
        self._order: dict[int, int] = {}  # frame id to its place in the run
        self._positions: list[F64] = []  # (3,) of each keyframe, as now known
        self._open: list[tuple[int, F64]] = []  # frame ids and poses of the submap that is being filled
        self._anchors: dict[int, tuple[int, F64]] = {}  # frame id to its submap and the pose it was fused with
        self._closed = 0
        self.world_from_fused: dict[int, F64] = {}  # of the submaps that have moved

    def __len__(self) -> int:
        return len(self._positions)

    @property
    def positions(self) -> F64:
        """(K, 3) camera positions in metres, world frame, oldest first."""
        return np.array(self._positions).reshape(-1, 3)

    def enter(self, frame_id: int, world_from_camera: F64) -> int:
        """The number of the submap that this keyframe is fused into."""
        if len(self._open) >= self._config.keyframes:
            self._close()
        self._order[frame_id] = len(self._positions)
        self._positions.append(world_from_camera[:3, 3])
        self._open.append((frame_id, world_from_camera))
        return self._closed

    def move(self, correction: Correction) -> dict[int, F64]:
        """Take new poses of earlier keyframes: new world_from_fused (4, 4) of each submap that moved by enough.

        Keyframes that were never fused are passed over. Raises SchemaError for a pose that is not rigid.
        """
        if not len(correction.moved_frame_ids):
            return {}
        self._close()  # what comes now is fused with the new poses
        moves = {}
        for frame_id, pose in zip(correction.moved_frame_ids.tolist(), correction.moved_world_from_camera, strict=True):
            if not is_rigid(pose):
                raise SchemaError(
                    f"Correction of frame {correction.frame_id}: the pose of frame {frame_id} is not a finite rigid "
                    "transform"
                )
            if frame_id in self._order:
                self._positions[self._order[frame_id]] = pose[:3, 3]
            if frame_id in self._anchors:
                submap, fused = self._anchors[frame_id]
                before = self.world_from_fused.get(submap, np.eye(4)) @ fused
                if self._is_felt(inverse(before) @ pose):
                    moves[submap] = self.world_from_fused[submap] = pose @ inverse(fused)
        return moves

    def _is_felt(self, move: F64) -> bool:
        turned_deg = np.degrees(rotation_angle_rad(move[:3, :3]))
        far = np.linalg.norm(move[:3, 3]) >= self._config.min_move_m
        return bool(far or turned_deg >= self._config.min_turn_deg)

    def _close(self) -> None:
        if self._open:
            frame_id, pose = self._open[len(self._open) // 2]
            self._anchors[frame_id] = self._closed, pose
            self._open = []
            self._closed += 1
