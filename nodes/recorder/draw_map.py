"""Draw the world: the camera's path, the points of the map, and its objects."""

from __future__ import annotations

import numpy as np
import rerun as rr

from placegraph.nodes.recorder.draw_images import draw_camera_pose
from placegraph.nodes.recorder.drawing import Canvas, color_of
from placegraph.runtime import messages as m
from placegraph.runtime.arrays import F64

MAX_POINTS = 100_000  # drawn; the exact cloud is in /messages
POINT_RADIUS_M = 0.012
OVERHEAD_M = 0.2  # over the camera's highest position, see draw_map
TRUSTED, UNTRUSTED, CORRECTED = (90, 200, 255), (255, 80, 60), (120, 255, 120)


def draw_world(canvas: Canvas) -> None:
    """What holds for the whole recording: the world's z axis points up; names and colours of the plots."""
    canvas.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for path, name, color in (
        ("quality", "quality", (90, 200, 255)),
        ("residual_m", "residual, m", (255, 180, 60)),
        ("innovation_m", "innovation, m", (230, 110, 220)),
    ):
        canvas.log(f"pose/{path}", rr.SeriesLines(names=[name], colors=[color]), static=True)


def draw_pose(canvas: Canvas, pose: m.Pose, pngs: dict[str, bytes]) -> None:
    """One step of the path, red where the pose is not trusted, and the pose's quality."""
    x, y, z = pose.world_from_camera[:3, 3].tolist()
    step = [canvas.last_position or (x, y, z), (x, y, z)]
    canvas.last_position = (x, y, z)
    color = TRUSTED if pose.trusted else UNTRUSTED
    canvas.log("world/path", rr.LineStrips3D([step], colors=[color], radii=[0.008]))
    if canvas.frames:
        draw_camera_pose(canvas, pose.world_from_camera)
    for name in ("quality", "residual_m", "innovation_m"):
        canvas.log(f"pose/{name}", rr.Scalars(getattr(pose, name)))
    if not pose.trusted:
        text = f"frame {pose.frame_id}: pose not trusted: {pose.reason}"
        canvas.log("log/pose", rr.TextLog(text, level=rr.TextLogLevel.WARN))


def draw_map(canvas: Canvas, map_: m.Map, pngs: dict[str, bytes]) -> None:
    """The cloud in its own colours, the path of keyframes and a named box for each object, in place of the last map's.

    Points over the camera's highest position have an entity of their own, which the first layout hides: it looks into
    the rooms from above, and a ceiling would cover them.
    """
    stride = max(1, -(-len(map_.points_world) // MAX_POINTS))
    points, colors = map_.points_world[::stride], map_.point_colors[::stride]
    over_m = map_.camera_positions_world[:, 2].max(initial=-np.inf) + OVERHEAD_M
    for path, part in (("world/map", points[:, 2] <= over_m), ("world/overhead", points[:, 2] > over_m)):
        radius_m = max(POINT_RADIUS_M, map_.voxel_m / 2)
        canvas.log(path, rr.Points3D(points[part], colors=colors[part], radii=radius_m))
    # "world/path" stays where odometry put it; this path moves with the map
    canvas.log("world/keyframes", rr.LineStrips3D([map_.camera_positions_world], colors=[CORRECTED], radii=[0.012]))
    canvas.replace("objects", {f"world/objects/O{item.id}": _object_box(item) for item in map_.objects()})


def _object_box(item: m.MapObject) -> rr.Boxes3D:
    return named_box(item.oriented_box.astype(float), f"{item.name} O{item.id}", color_of(item.name))


def named_box(oriented: F64, label: str, color: tuple[int, int, int], radius_m: float = 0.006) -> rr.Boxes3D:
    """A labelled box from (7,) centre x y z, size x y z in metres, yaw in rad about z, world frame."""
    half_yaw = float(oriented[6]) / 2
    return rr.Boxes3D(
        centers=[oriented[:3]],
        sizes=[oriented[3:6]],
        quaternions=[rr.Quaternion(xyzw=[0.0, 0.0, np.sin(half_yaw), np.cos(half_yaw)])],
        colors=[color],
        radii=[radius_m],
        labels=[label],
        show_labels=True,
    )
