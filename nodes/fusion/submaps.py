"""Submaps: runs of consecutive keyframes that move as one when the pose graph moves.

Source: submaps as in Cartographer and Voxgraph. Not as there: a submap follows its middle keyframe, which halves the
error of its first and last.
"""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Correction
from placegraph.runtime.vision.geometry import inverse, is_rigid, rotation_angle_rad


class SubmapConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """How long a submap is, and which corrections are followed."""

    keyframes: int = Field(default=8, ge=1)  # about a metre of walk, over which odometry drifts by a centimetre
    min_move_m: float = Field(default=0.01, ge=0)  # well under a voxel; smaller moves add up until they are followed
    min_turn_deg: float = Field(default=0.5, ge=0)


class Submaps:
    """The submap of each keyframe, the keyframes' current positions, and how far each submap has moved."""

    def __init__(self, config: SubmapConfig) -> None:
        self._config = config
        self._keyframe_indices: dict[int, int] = {}  # by frame id
        self._positions: list[F64] = []  # (3,) of each keyframe, as now known
        self._open: list[tuple[int, F64]] = []  # frame ids and poses of the submap that is being filled
        self._anchors: dict[int, tuple[int, F64]] = {}  # frame id to its submap and the pose it was fused with
        self._closed_count = 0
        self.world_from_fused: dict[int, F64] = {}  # of the submaps that have moved since they were fused

    def __len__(self) -> int:
        return len(self._positions)

    @property
    def positions(self) -> F64:
        """(K, 3) camera positions in metres, world frame, oldest first."""
        return np.array(self._positions).reshape(-1, 3)

    def add_keyframe(self, frame_id: int, world_from_camera: F64) -> int:
        """The number of the submap that this keyframe is fused into."""
        if len(self._open) >= self._config.keyframes:
            self._close()
        self._keyframe_indices[frame_id] = len(self._positions)
        self._positions.append(world_from_camera[:3, 3])
        self._open.append((frame_id, world_from_camera))
        return self._closed_count

    def apply_correction(self, correction: Correction) -> dict[int, F64]:
        """Take new poses of earlier keyframes: the new world_from_fused (4, 4) of each submap that moved enough.

        Keyframes that were never fused are ignored. Raises SchemaError for a pose that is not rigid.
        """
        if not len(correction.moved_frame_ids):
            return {}
        self._close()  # later keyframes are fused with the new poses
        moves = {}
        for frame_id, pose in zip(correction.moved_frame_ids.tolist(), correction.moved_world_from_camera, strict=True):
            if not is_rigid(pose):
                raise SchemaError(
                    f"Correction of frame {correction.frame_id}: the pose of frame {frame_id} is not a finite rigid "
                    "transform"
                )
            if frame_id in self._keyframe_indices:
                self._positions[self._keyframe_indices[frame_id]] = pose[:3, 3]
            if frame_id in self._anchors:
                submap, fused_pose = self._anchors[frame_id]
                current_pose = self.world_from_fused.get(submap, np.eye(4)) @ fused_pose
                if self._is_significant(inverse(current_pose) @ pose):
                    moves[submap] = self.world_from_fused[submap] = pose @ inverse(fused_pose)
        return moves

    def _is_significant(self, move: F64) -> bool:
        turn_deg = np.degrees(rotation_angle_rad(move[:3, :3]))
        move_m = np.linalg.norm(move[:3, 3])
        return bool(move_m >= self._config.min_move_m or turn_deg >= self._config.min_turn_deg)

    def _close(self) -> None:
        if self._open:
            frame_id, pose = self._open[len(self._open) // 2]
            self._anchors[frame_id] = self._closed_count, pose
            self._open = []
            self._closed_count += 1
