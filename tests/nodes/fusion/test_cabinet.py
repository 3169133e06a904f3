"""Real frames: a loop around one cabinet, with its true poses and given boxes, leaves one large object."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.fusion import NODE
from placegraph.runtime.messages import Detections, Keyframe, LastKeyframe
from placegraph.runtime.node import Context, build_node
from placegraph.runtime.vision.geometry import pose_from_quaternion

FOLDER = Path(__file__).parents[4] / "shared" / "data" / "tum_fr3_cabinet"
INTRINSICS = np.array([535.4, 539.2, 320.1, 247.6])  # its PROVENANCE.md
LARGE_M = 0.3


def views():
    """Keyframe and Detections of each frame; a line of a file is x y width height score."""
    colors, depths = (sorted((FOLDER / name).glob("*.*")) for name in ("raw_imgs", "depth_imgs"))
    boxes = sorted((FOLDER / "filter_2d_obj_txts").glob("*.txt"))
    poses = np.loadtxt(FOLDER / "truth_cam_poses.txt")
    for i, (seconds, x, y, z, *xyzw) in enumerate(poses.tolist()):
        common = {"frame_id": i, "stamp_ns": round(seconds * 1e9)}
        rows = np.array(boxes[i].read_text().split(), np.float32).reshape(-1, 5)
        yield (
            Keyframe(
                **common,
                color=np.ascontiguousarray(cv2.imread(str(colors[i]))[..., ::-1]),
                depth=cv2.imread(str(depths[i]), cv2.IMREAD_UNCHANGED),
                depth_unit_m=1 / 5000,
                intrinsics=INTRINSICS,
                world_from_camera=pose_from_quaternion(np.array([x, y, z]), np.array(xyzw)),
            ),
            Detections(
                **common,
                names=("cabinet",) * len(rows),
                boxes_px=np.concatenate((rows[:, :2], rows[:, :2] + rows[:, 2:4]), axis=1),
                scores=rows[:, 4].copy(),
            ),
        )


@pytest.mark.weights
@pytest.mark.skipif(not FOLDER.is_dir(), reason=f"needs the frames of {FOLDER}")
def test_a_loop_around_one_cabinet_leaves_one_large_object_where_it_stands():
    segmenter = build_node("segmenter", {"model": "house_segmenter"}, Context())  # packaged
    fusion = NODE(NODE.config_type(), Context())
    segmenter.start()
    try:
        for keyframe, detections in views():
            segmenter.step(keyframe)
            (segments,) = segmenter.step(detections)
            fusion.step(keyframe)
            fusion.step(segments)
    finally:
        segmenter.stop()
    (map_,) = fusion.step(LastKeyframe(frame_id=57, stamp_ns=0, keyframes=58))
    sizes = map_.object_boxes_world[:, 1] - map_.object_boxes_world[:, 0]
    (large,) = np.flatnonzero(sizes.max(axis=1) > LARGE_M)
    assert map_.object_observations[large] == 51  # every frame that has a box
    assert len(map_.retired_ids) == 0
    # it stands on the floor, in the middle of the loop: what is over the floor there is the cabinet
    low, high = map_.object_boxes_world[large]
    points = map_.points_world
    over = points[(points[:, 2] > 0.15) & (np.linalg.norm(points[:, :2] - (low + high)[:2] / 2, axis=1) < 1.0)]
    inside = ((over > low - 0.1) & (over < high + 0.1)).all(axis=1)
    assert inside.mean() > 0.9 and abs(low[2]) < 0.1
