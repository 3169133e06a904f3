from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from placegraph.nodes.camera import _flat_scene as scene
from placegraph.nodes.camera.flat import SOURCE, Flat, SceneBoxes, cast_rays
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.vision import geometry

SMALL = {"width": 64, "height": 48, "frames": 12}
TRUE_OBJECTS = [(drawn.name, drawn.box) for drawn in scene.OBJECTS]
TRUE_ROOMS = [(name, np.array(span).reshape(2, 3)) for name, span in scene.ROOMS]


def drawn(**settings: Any) -> Flat:
    return SOURCE(Path(), {**SMALL, **settings})


def one_box(low: tuple[float, ...], high: tuple[float, ...]) -> SceneBoxes:
    return SceneBoxes(
        np.array([low], np.float32),
        np.array([high], np.float32),
        np.zeros((1, 3), np.float32),
        np.zeros(1, np.uint8),
        np.zeros(1, np.int64),
    )


def rays_of(intrinsics: np.ndarray, width: int, height: int) -> np.ndarray:
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    x, y = (u - intrinsics[2]) / intrinsics[0], (v - intrinsics[3]) / intrinsics[1]
    return np.stack((x, y, np.ones_like(x)), axis=-1).astype(np.float32)


CAMERA = np.array([20.0, 20.0, 10.0, 10.0])


@pytest.mark.parametrize(
    "settings", [{"width": 0}, {"height": 8}, {"seed": -1}, {"rate_hz": 0.0}, {"frames": 1.5}, {"rooms": 3}]
)
def test_wrong_settings(settings: dict[str, object]):
    with pytest.raises(ConfigError, match=next(iter(settings))):
        SOURCE(Path(), settings)


def test_matches_nothing(tmp_path: Path):
    assert not SOURCE.matches(tmp_path)
    assert not SOURCE.matches(Path())


def test_a_box_ahead_has_the_depth_of_its_front_face():
    depth, box, face = cast_rays(
        rays_of(CAMERA, 21, 21), CAMERA, np.eye(4), one_box((-0.5, -0.5, 2.0), (0.5, 0.5, 3.0))
    )
    hit = np.isfinite(depth)
    assert depth[hit] == pytest.approx(2.0)  # depth is along the axis, not along the ray
    assert (box[hit] == 0).all()
    assert (face[hit] == 4).all()  # looks to -z
    # 0.5 m at 2 m and 20 px focal length: 5 px to each side of the centre, less the rim
    assert hit.sum() in (9 * 9, 11 * 11)
    assert hit[10, 10]


@pytest.mark.parametrize("low", [(-0.5, -0.5, -3.0), (40.0, -0.5, 2.0)])
def test_a_box_behind_or_beside_is_not_hit(low: tuple[float, float, float]):
    high = (low[0] + 1, low[1] + 1, low[2] + 1)
    depth, _, _ = cast_rays(rays_of(CAMERA, 21, 21), CAMERA, np.eye(4), one_box(low, high))
    assert np.isinf(depth).all()


def test_a_box_that_reaches_behind_the_camera_is_cut_not_lost():
    floor = one_box((-50.0, 1.0, -50.0), (50.0, 1.1, 50.0))  # one metre below
    depth, _, face = cast_rays(rays_of(CAMERA, 21, 21), CAMERA, np.eye(4), floor)
    assert np.isinf(depth[:11]).all()
    assert depth[20] == pytest.approx(2.0)  # 10 px below the centre: 45 degrees would be 20 px
    assert depth[15] == pytest.approx(4.0)
    assert (face[11:] == 2).all()  # looks to -y, which is up


def test_nearest_box_wins_whatever_the_order():
    near, far = one_box((-1, -1, 2), (1, 1, 3)), one_box((-1, -1, 4), (1, 1, 5))
    for first, second, nearest in ((near, far, 0), (far, near, 1)):
        both = SceneBoxes(
            *(np.concatenate((getattr(first, k), getattr(second, k))) for k in SceneBoxes.__dataclass_fields__)
        )
        depth, box, _ = cast_rays(rays_of(CAMERA, 21, 21), CAMERA, np.eye(4), both)
        assert depth[10, 10] == pytest.approx(2.0)
        assert box[10, 10] == nearest


def test_equal_seeds_give_equal_bytes_and_others_do_not():
    first, again, other = (drawn(seed=seed).render(5) for seed in (3, 3, 4))
    for one, two in zip(first, again, strict=True):
        assert one.tobytes() == two.tobytes()
    assert first[0].tobytes() != other[0].tobytes()
    assert first[1].tobytes() != other[1].tobytes()
    assert np.array_equal(first[2], other[2])  # the same things at the same places


def test_frames_are_whole_and_level():
    frames = list(drawn().frames())
    assert [frame.frame_id for frame in frames] == list(range(12))
    assert frames[1].stamp_ns == 100_000_000
    for frame in frames:
        frame.check()
        assert geometry.is_rigid(frame.given_world_from_camera)
        up_world = frame.given_world_from_camera[:3, :3] @ frame.up_camera
        assert up_world == pytest.approx([0, 0, 1])
        assert frame.depth.max() <= 6000
        assert frame.depth[frame.depth > 0].min() >= 300
        assert (frame.depth > 0).mean() > 0.8
    assert list(drawn().given_poses()) == [frame.stamp_ns for frame in frames]


def test_depth_is_that_of_the_surfaces():
    source = drawn(width=96, height=72)
    for frame in source.frames():
        _, _, label = source.render(frame.frame_id)
        depth_m = np.where(label == scene.CLASSES.index("refrigerator"), frame.depth, 0) * np.float32(0.001)
        points = geometry.backproject(depth_m, frame.intrinsics)
        world = geometry.transform(frame.given_world_from_camera, points.astype(float))
        box = TRUE_OBJECTS[0][1]
        assert ((world > box[0] - 0.08) & (world < box[1] + 0.08)).all()


def test_the_walk_is_gentle_and_clear_of_everything():
    poses = drawn(frames=0).poses
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    turns = [geometry.rotation_angle_rad(a[:3, :3].T @ b[:3, :3]) for a, b in pairwise(poses)]
    assert steps.max() <= 0.05
    assert np.rad2deg(max(turns)) <= 3.0
    assert 150 <= len(poses) <= 210
    solid = [span for _, span in scene.STRUCTURE] + [part for thing in scene.OBJECTS for part in thing.parts]
    boxes = np.array(solid).reshape(-1, 2, 3)
    # a person's width around the path, from knee to eye
    for pose in poses:
        nearest = np.clip(pose[:2, 3], boxes[:, 0, :2], boxes[:, 1, :2])
        gap = np.linalg.norm(nearest - pose[:2, 3], axis=1)
        standing = (boxes[:, 0, 2] < 1.3) & (boxes[:, 1, 2] > 0.05)
        assert gap[standing].min() > 0.3


def test_the_walk_sees_every_object_and_both_rooms():
    source = drawn(frames=40, width=160, height=120)
    seen = np.zeros(len(scene.OBJECTS), int)
    for index in range(len(source.poses)):
        _, box, _ = cast_rays(source._rays, source.intrinsics, source.poses[index], source._boxes)
        objects = source._boxes.object[box]
        seen += np.bincount(objects[objects >= 0], minlength=len(seen)) > 15
    assert seen.min() >= 3, [thing.name for thing, views in zip(scene.OBJECTS, seen, strict=True) if views < 3]
    path = source.poses[:, :3, 3]
    for _, room in TRUE_ROOMS:
        assert ((path >= room[0]) & (path <= room[1])).all(axis=1).sum() > 10


def test_truth_is_sound():
    names = [name for name, _ in TRUE_OBJECTS]
    assert len(names) == 18
    assert len(set(names)) == 12
    assert set(names) == set(scene.COLORS) == set(scene.CLASSES[1:])
    assert [name for name, _ in TRUE_ROOMS] == ["kitchen", "living room"]
    for name, box in TRUE_OBJECTS:
        assert (box[0] < box[1]).all()
        inside = [room for room, span in TRUE_ROOMS if (box[0] >= span[0]).all() and (box[1] <= span[1]).all()]
        assert len(inside) == 1, name


def test_no_two_objects_share_space():
    things = TRUE_OBJECTS
    for i, (name, box) in enumerate(things):
        for other, second in things[i + 1 :]:
            overlap = np.minimum(box[1], second[1]) - np.maximum(box[0], second[0])
            assert (overlap <= 1e-9).any(), (name, other)


def test_no_object_stands_in_a_wall_or_radiator():
    walls = np.array([span for _, span in scene.STRUCTURE]).reshape(-1, 2, 3)
    for name, box in TRUE_OBJECTS:
        overlap = np.minimum(box[1], walls[:, 1]) - np.maximum(box[0], walls[:, 0])
        assert (overlap <= 1e-9).any(axis=1).all(), name
