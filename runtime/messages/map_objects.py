"""The objects of a Map as values, and how they are packed into its arrays."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F32, I64, U8

TagVotes = tuple[tuple[str, float], ...]  # names with their votes: summed detection scores over views; strongest first


@dataclass(frozen=True, kw_only=True, eq=False)
class MapObject:
    """One object of a Map; metres, world frame."""

    id: int
    box: F32  # (2, 3) min and max
    oriented_box: F32  # (7,) centre, size, yaw about z in rad
    color: U8  # (3,) sRGB, median over its points
    observations: int  # keyframes that showed it
    first_frame: int
    last_frame: int
    points: F32  # (N, 3)
    tags: TagVotes

    @property
    def name(self) -> str:
        """The strongest tag, "object" when there is none."""
        return self.tags[0][0] if self.tags else "object"


@dataclass(frozen=True, kw_only=True, eq=False)
class RetiredObject:
    """An object that is no longer where it was; metres, world frame."""

    id: int
    box: F32  # (2, 3) min and max, where it was
    last_frame: int  # the last frame that showed it
    gone_frame: int  # the frame after which it was certain
    tags: TagVotes


def pack_objects(objects: Sequence[MapObject], retired: Sequence[RetiredObject]) -> dict[str, Any]:
    """The fields of a Map that hold these objects."""
    tags = _pack_tags([item.tags for item in objects])
    retired_tags = _pack_tags([item.tags for item in retired])
    return {
        "object_ids": np.array([item.id for item in objects], np.int64),
        "object_boxes_world": np.array([item.box for item in objects], np.float32).reshape(-1, 2, 3),
        "object_oriented_boxes": np.array([item.oriented_box for item in objects], np.float32).reshape(-1, 7),
        "object_colors": np.array([item.color for item in objects], np.uint8).reshape(-1, 3),
        "object_observations": np.array([item.observations for item in objects], np.int64),
        "object_first_frames": np.array([item.first_frame for item in objects], np.int64),
        "object_last_frames": np.array([item.last_frame for item in objects], np.int64),
        "object_points_world": np.concatenate([*(item.points for item in objects), np.zeros((0, 3), np.float32)]),
        "object_point_offsets": np.cumsum([0, *(len(item.points) for item in objects)], dtype=np.int64),
        "retired_ids": np.array([item.id for item in retired], np.int64),
        "retired_boxes_world": np.array([item.box for item in retired], np.float32).reshape(-1, 2, 3),
        "retired_last_frames": np.array([item.last_frame for item in retired], np.int64),
        "retired_gone_frames": np.array([item.gone_frame for item in retired], np.int64),
        **{f"tag_{name}": value for name, value in tags.items()},
        **{f"retired_tag_{name}": value for name, value in retired_tags.items()},
    }


def unpack_tags(names: tuple[str, ...], votes: F32, offsets: I64) -> list[TagVotes]:
    """The tags of each object; the names and votes of object i are those from offsets[i] to offsets[i + 1]."""
    pairs, ends = list(zip(names, votes.tolist(), strict=True)), offsets.tolist()
    return [tuple(pairs[start:end]) for start, end in itertools.pairwise(ends)]


def _pack_tags(tags: Sequence[TagVotes]) -> dict[str, Any]:
    return {
        "names": tuple(name for votes in tags for name, _ in votes),
        "votes": np.array([vote for votes in tags for _, vote in votes], np.float32),
        "offsets": np.cumsum([0, *map(len, tags)], dtype=np.int64),
    }
