"""All messages that travel between nodes; runtime/messages/declaration.py says what a declaration means."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F32, F64, I32, I64, U8, U16, Bool
from placegraph.runtime.messages.declaration import ArraySpec as ArraySpec
from placegraph.runtime.messages.declaration import Message as Message
from placegraph.runtime.messages.declaration import array as array
from placegraph.runtime.messages.map_objects import MapObject as MapObject
from placegraph.runtime.messages.map_objects import RetiredObject as RetiredObject
from placegraph.runtime.messages.map_objects import pack_objects as pack_objects
from placegraph.runtime.messages.map_objects import unpack_tags


class DepthImage:
    """What messages with a depth image share."""

    depth: U16
    depth_unit_m: float

    @property
    def depth_m(self) -> F32:
        """The depth image in metres, (H, W); 0 = no reading."""
        return self.depth.astype(np.float32) * np.float32(self.depth_unit_m)


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame(Message, DepthImage):
    """One colour and depth image of the camera, aligned to each other."""

    color: U8 = array("uint8", ("H", "W", 3), unit="sRGB")
    depth: U16 = array("uint16", ("H", "W"), unit="depth_unit_m", frame="camera")  # 0 = no reading
    depth_unit_m: float  # metres per step of depth; integers keep recordings exact
    intrinsics: F64 = array("float64", (4,), unit="px")  # fx fy cx cy
    given_world_from_camera: F64 = array("float64", (4, 4), unit="m", frame="world")  # NaN: the source has no pose
    up_camera: F64 = array("float64", (3,), unit="1", frame="camera")  # against gravity, unit length; NaN: unknown


@dataclass(frozen=True, kw_only=True, eq=False)
class End(Message):
    """The source has no further frame; `frame_id` is that of the last one, -1 if there was none."""

    frames: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Pose(Message):
    """Where the camera was, and whether to trust that."""

    world_from_camera: F64 = array("float64", (4, 4), unit="m", frame="world")
    trusted: bool  # False: do not put this frame into the map
    quality: float  # share 0..1 of the tracked corners that agree; of KISS-ICP the share of points near its map
    residual_m: float  # of KISS-ICP: median distance of those points to its map; NaN when nothing was compared
    innovation_m: float  # how far registration moved the pose from its prediction
    reason: str  # why not trusted; "" when trusted


@dataclass(frozen=True, kw_only=True, eq=False)
class Keyframe(Message, DepthImage):
    """A frame that is perceived, with its pose."""

    @classmethod
    def of(cls, frame: Frame, world_from_camera: F64) -> Keyframe:
        """A frame with the (4, 4) pose it was taken from, metres."""
        shared = ("frame_id", "stamp_ns", "color", "depth", "depth_unit_m", "intrinsics")
        return cls(**{name: getattr(frame, name) for name in shared}, world_from_camera=world_from_camera)

    color: U8 = array("uint8", ("H", "W", 3), unit="sRGB")
    depth: U16 = array("uint16", ("H", "W"), unit="depth_unit_m", frame="camera")
    depth_unit_m: float
    intrinsics: F64 = array("float64", (4,), unit="px")
    world_from_camera: F64 = array("float64", (4, 4), unit="m", frame="world")


@dataclass(frozen=True, kw_only=True, eq=False)
class Correction(Message):
    """Where the pose graph puts a keyframe; one for each. After a loop was closed also where earlier ones are now."""

    world_from_camera: F64 = array("float64", (4, 4), unit="m", frame="world")
    moved_frame_ids: I64 = array("int64", ("N",), unit="1")  # of earlier keyframes, ascending; N = 0: none moved
    moved_world_from_camera: F64 = array("float64", ("N", 4, 4), unit="m", frame="world")


@dataclass(frozen=True, kw_only=True, eq=False)
class LastKeyframe(Message):
    """No further keyframe will come; `frame_id` is that of the last one, -1 if there was none."""

    keyframes: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Tags(Message):
    """Names of what the whole image shows, best first."""

    names: tuple[str, ...]
    scores: F32 = array("float32", ("N",), unit="1")


@dataclass(frozen=True, kw_only=True, eq=False)
class Detections(Message):
    """Named boxes in the image."""

    names: tuple[str, ...]
    boxes_px: F32 = array("float32", ("N", 4), unit="px")  # x_min y_min x_max y_max
    scores: F32 = array("float32", ("N",), unit="1")


@dataclass(frozen=True, kw_only=True, eq=False)
class Segments(Message):
    """Named masks in the image; mask i covers the whole-pixel box i, packed row by row, eight pixels a byte."""

    names: tuple[str, ...]
    scores: F32 = array("float32", ("N",), unit="1")
    boxes_px: I32 = array("int32", ("N", 4), unit="px")  # x_min y_min x_max y_max, max exclusive
    mask_bits: U8 = array("uint8", ("B",), unit="bits")
    mask_offsets: I64 = array("int64", ("N+1",), unit="bytes")

    def masks(self) -> Iterator[Bool]:
        """Each mask as bool of its box's size (y_max - y_min, x_max - x_min)."""
        for i, (x0, y0, x1, y1) in enumerate(self.boxes_px.tolist()):
            bits = self.mask_bits[self.mask_offsets[i] : self.mask_offsets[i + 1]]
            count = (y1 - y0) * (x1 - x0)
            yield np.unpackbits(bits, count=count).astype(bool).reshape(y1 - y0, x1 - x0)

    @staticmethod
    def pack(masks: list[Bool]) -> tuple[U8, I64]:
        """Box-sized masks to (mask_bits, mask_offsets)."""
        packed = [np.packbits(mask.ravel()) for mask in masks]
        offsets = np.cumsum([0, *(len(bits) for bits in packed)], dtype=np.int64)
        return (np.concatenate(packed) if packed else np.zeros(0, np.uint8)), offsets


@dataclass(frozen=True, kw_only=True, eq=False)
class Map(Message):
    """The whole map, complete each time: the point cloud of the world, free space, and the objects."""

    revision: int
    final: bool  # whether the source has ended and every keyframe is in
    keyframes: int
    voxel_m: float
    points_world: F32 = array("float32", ("P", 3), unit="m", frame="world")
    point_colors: U8 = array("uint8", ("P", 3), unit="sRGB")
    free_cell_m: float
    free_points_world: F32 = array("float32", ("F", 3), unit="m", frame="world")  # centres of cells seen to be free
    camera_positions_world: F32 = array("float32", ("K", 3), unit="m", frame="world")
    object_ids: I64 = array("int64", ("N",), unit="1")
    object_boxes_world: F32 = array("float32", ("N", 2, 3), unit="m", frame="world")  # min, max
    object_oriented_boxes: F32 = array("float32", ("N", 7), unit="m, rad", frame="world")  # centre, size, yaw about z
    object_colors: U8 = array("uint8", ("N", 3), unit="sRGB")  # median over its points
    object_observations: I64 = array("int64", ("N",), unit="1")
    object_first_frames: I64 = array("int64", ("N",), unit="1")
    object_last_frames: I64 = array("int64", ("N",), unit="1")
    object_points_world: F32 = array("float32", ("Q", 3), unit="m", frame="world")
    object_point_offsets: I64 = array("int64", ("N+1",), unit="1")
    tag_names: tuple[str, ...]  # tags of object 0, then of object 1, ...; strongest first within an object
    tag_votes: F32 = array("float32", ("T",), unit="1")  # summed detection scores over views
    tag_offsets: I64 = array("int64", ("N+1",), unit="1")
    retired_ids: I64 = array("int64", ("R",), unit="1")  # objects that are no longer where they were, ascending
    retired_boxes_world: F32 = array("float32", ("R", 2, 3), unit="m", frame="world")  # where they were
    retired_last_frames: I64 = array("int64", ("R",), unit="1")  # the last frame that showed each
    retired_gone_frames: I64 = array("int64", ("R",), unit="1")  # the frame after which it was certain
    retired_tag_names: tuple[str, ...]  # as tag_names
    retired_tag_votes: F32 = array("float32", ("U",), unit="1")
    retired_tag_offsets: I64 = array("int64", ("R+1",), unit="1")

    def objects(self) -> list[MapObject]:
        """The objects, by id; arrays are views."""
        tags = unpack_tags(self.tag_names, self.tag_votes, self.tag_offsets)
        return [
            MapObject(
                id=int(self.object_ids[i]),
                box=self.object_boxes_world[i],
                oriented_box=self.object_oriented_boxes[i],
                color=self.object_colors[i],
                observations=int(self.object_observations[i]),
                first_frame=int(self.object_first_frames[i]),
                last_frame=int(self.object_last_frames[i]),
                points=self.object_points_world[self.object_point_offsets[i] : self.object_point_offsets[i + 1]],
                tags=tags[i],
            )
            for i in range(len(self.object_ids))
        ]

    def retired(self) -> list[RetiredObject]:
        """The objects that are no longer where they were, by id; arrays are views."""
        tags = unpack_tags(self.retired_tag_names, self.retired_tag_votes, self.retired_tag_offsets)
        return [
            RetiredObject(
                id=int(self.retired_ids[i]),
                box=self.retired_boxes_world[i],
                last_frame=int(self.retired_last_frames[i]),
                gone_frame=int(self.retired_gone_frames[i]),
                tags=tags[i],
            )
            for i in range(len(self.retired_ids))
        ]


@dataclass(frozen=True, kw_only=True, eq=False)
class Graph(Message):
    """The scene graph without names of places, complete each time, as canonical JSON (scene_graph/graph.py)."""

    revision: int  # that of the Map it was built from
    final: bool
    json: str


@dataclass(frozen=True, kw_only=True, eq=False)
class NamedGraph(Message):
    """The same scene graph with names on rooms and locations, their probabilities as the weights of their tags."""

    revision: int  # that of the Graph
    final: bool
    place_types: tuple[str, ...]  # all names that stand for a type of place, also where the graph has none such
    json: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Question(Message):
    """A question in plain words."""

    question_id: str
    text: str
    k: int  # how many candidates to list
    mode: str  # one of runtime.query.request.MODES
    viewpoint_world: F64 = array("float64", (3,), unit="m", frame="world")  # the asker's position; NaN: unknown
    heading_rad: float = math.nan  # where the asker looks, about z from +x; NaN: unknown


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer(Message):
    """The reply to a question as canonical JSON (docs/asking.md#reply)."""

    question_id: str
    json: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Health(Message):
    """Rate, step times, drops and memory of one process, once a second."""

    node: str
    steps: int
    rate_hz: float  # steps in the last second
    step_p50_ms: float
    step_p95_ms: float
    queue: int
    drops: int
    memory_mb: float


def all_kinds() -> tuple[type[Message], ...]:
    """Every message class of this module, by name."""
    return tuple(sorted(Message.__subclasses__(), key=lambda kind: kind.__name__))
