"""The map follows the pose graph, and the world: corrected poses, things moved and things removed."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from placegraph.nodes.fusion import NODE
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Correction, Keyframe, LastKeyframe
from placegraph.runtime.messages.codec import encode
from placegraph.runtime.node import Context

ROOM = {
    "floor": ("", (-4, -4, -0.1), (4, 4, 0)),
    "wall": ("", (-4, 3, 0), (4, 3.1, 2.5)),
    "table": ("table", (-0.6, -0.4, 0.68), (0.6, 0.4, 0.72)),
    "pole": ("lamp", (-1.0, 1.0, 0.0), (-0.9, 1.1, 1.5)),
}
CHAIR = ("chair", (1.0, -0.25, 0.0), (1.5, 0.25, 0.8))
SCENE = {**ROOM, "chair": CHAIR}


def make(corrected=True, **settings):
    return NODE(NODE.config_type(**settings), Context(produced_kinds=("Correction",) if corrected else ()))


def correction(frame_id, pose, moved=None):
    moved = moved or {}
    return Correction(
        frame_id=frame_id,
        stamp_ns=0,
        world_from_camera=pose,
        moved_frame_ids=np.array(sorted(moved), np.int64),
        moved_world_from_camera=np.array([moved[i] for i in sorted(moved)], float).reshape(-1, 4, 4),
    )


def orbit(view, scene, count, first=0, start=0.0, turn=1.0):
    """Keyframes from around the table, 2.2 m away, over a share of a full turn."""
    for k in range(count):
        angle = 2 * np.pi * (start + turn * k / count)
        eye = (0.3 + 2.2 * np.cos(angle), 2.2 * np.sin(angle), 1.5)
        yield view(first + k, scene, eye, (0.3, 0, 0.5))


def drift(k, per_keyframe=0.02):
    """A pose error that grows: to the side, and turned about z."""
    angle = np.radians(0.25 * k)
    error = np.eye(4)
    error[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    error[:3, 3] = (per_keyframe * k, -0.5 * per_keyframe * k, 0)
    return error


def end(node, frame_id, count):
    return node.step(LastKeyframe(frame_id=frame_id, stamp_ns=9, keyframes=count))[-1]


def fused(node, views, poses=None, moved=None):
    """The final Map: each keyframe with the pose given for it; the last one's Correction moves earlier ones."""
    views = list(views)
    for k, (keyframe, segments) in enumerate(views):
        pose = keyframe.world_from_camera if poses is None else poses[k]
        if Correction in node.inputs:
            node.step(correction(keyframe.frame_id, pose, moved if k == len(views) - 1 else None))
        node.step(keyframe)
        node.step(segments)
    return end(node, views[-1][0].frame_id, len(views))


def names(map_):
    return [map_.tag_names[i] for i in map_.tag_offsets[:-1]]


def strays(found, true, reach_m):
    """Share of points of one cloud that the other has nothing near to."""
    return float((cKDTree(true).query(found)[0] > reach_m).mean())


def test_without_a_pose_graph_corrections_are_not_waited_for(view):
    assert Correction not in make(corrected=False).inputs and Correction in make().inputs
    plain, corrected = (fused(make(flag), orbit(view, SCENE, 6)) for flag in (False, True))
    assert names(plain) == names(corrected)
    assert np.allclose(plain.points_world, corrected.points_world, atol=0.01)


def test_a_keyframe_lies_where_its_correction_puts_it(view):
    (keyframe, segments) = next(orbit(view, SCENE, 1))
    shifted = keyframe.world_from_camera.copy()
    shifted[0, 3] += 10
    map_ = fused(make(), [(keyframe, segments)], [shifted])
    assert map_.camera_positions_world[0, 0] == pytest.approx(shifted[0, 3])
    assert map_.points_world[:, 0].min() > 4


def test_a_map_that_is_moved_equals_the_map_of_the_right_poses(view):
    views = list(orbit(view, SCENE, 24))
    true = [keyframe.world_from_camera for keyframe, _ in views]
    right = fused(make(), views)
    moved = {k: true[k] for k in range(23)}
    node = make(submap={"keyframes": 3})
    drifted = [*(drift(k) @ pose for k, pose in enumerate(true[:-1])), true[-1]]
    late = fused(node, views, drifted, moved)
    wrong = fused(make(), views, drifted)
    assert np.allclose(late.camera_positions_world, right.camera_positions_world, atol=1e-5)
    voxel = 2 * right.voxel_m  # centroids of neighbouring voxels
    assert (
        strays(late.points_world, right.points_world, voxel)
        < 0.01
        < strays(wrong.points_world, right.points_world, voxel)
    )
    assert strays(right.points_world, late.points_world, voxel) < 0.01
    cell = np.array([0.1, 0.1, 0.5])
    for a, b in ((late, right), (right, late)):
        assert strays(a.free_points_world / cell, b.free_points_world / cell, 1.5) < 0.01
    assert sorted(names(late)) == sorted(names(right)) == ["chair", "lamp", "table"]
    for i, name in enumerate(names(late)):
        assert np.allclose(late.object_boxes_world[i], right.object_boxes_world[names(right).index(name)], atol=0.06)
    encode(late)


def test_one_object_seen_before_and_after_the_drift_becomes_one_with_the_older_id(view):
    views = [*orbit(view, SCENE, 6, turn=0.25), *orbit(view, SCENE, 7, first=6, turn=0.25)]
    true = [keyframe.world_from_camera for keyframe, _ in views]
    off = np.eye(4)
    off[:2, 3] = 1.2, 0.9  # what odometry is off by when it comes back
    poses = [*true[:6], *(off @ pose for pose in true[6:-1]), true[-1]]
    before = fused(make(), views[:6])
    doubled = fused(make(), views[:-1], poses[:-1])
    once = fused(make(), views, poses, {k: true[k] for k in range(6, 12)})
    assert len(doubled.object_ids) + len(doubled.retired_ids) > len(before.object_ids)
    assert sorted(names(once)) == sorted(names(before))
    assert set(before.object_ids.tolist()) >= set(once.object_ids.tolist())
    assert len(once.retired_ids) == 0


def test_moves_too_small_to_matter_add_up(view):
    views = list(orbit(view, SCENE, 8, turn=0.2))
    node = make(submap={"keyframes": 2})
    for k, (keyframe, segments) in enumerate(views):
        shift = np.eye(4)
        shift[0, 3] = 0.006 * k
        moved = {i: shift @ views[i][0].world_from_camera for i in range(k)}
        for message in (correction(k, shift @ keyframe.world_from_camera, moved), keyframe, segments):
            node.step(message)
    final = end(node, 7, 8)
    shift = np.eye(4)
    shift[0, 3] = 0.006 * 7
    expected = fused(make(), views, [shift @ keyframe.world_from_camera for keyframe, _ in views])
    assert strays(final.points_world, expected.points_world, 0.05) < 0.01


def test_the_same_messages_give_the_same_bytes(view):
    views = list(orbit(view, SCENE, 9, turn=0.5))
    moved = {k: drift(8 - k) @ views[k][0].world_from_camera for k in range(8)}
    first, second = (encode(fused(make(submap={"keyframes": 2}), views, None, moved)) for _ in range(2))
    assert first == second


def test_a_moved_pose_that_is_not_rigid_is_refused_with_its_frame(view):
    ((a, b), (c, d)) = orbit(view, SCENE, 2)
    node = make()
    for message in (correction(0, a.world_from_camera), a, b, c, d):
        node.step(message)
    with pytest.raises(SchemaError, match="Correction of frame 1: the pose of frame 0"):
        node.step(correction(1, c.world_from_camera, {0: np.full((4, 4), np.nan)}))


def test_memory_is_bounded_by_the_map_and_not_by_how_often_it_was_seen(view):
    node = make(submap={"keyframes": 1})
    views = list(orbit(view, SCENE, 4, turn=0.05))
    sizes = []
    for lap in range(6):
        for k, (keyframe, segments) in enumerate(views):
            frame_id = 4 * lap + k
            for message in (keyframe, segments, correction(frame_id, keyframe.world_from_camera)):
                node.step(dataclasses.replace(message, frame_id=frame_id))
        parts = [part.fused()[0] for layer in (node._voxels, node._free) for part in layer._by_submap.values()]
        instances = node._objects.instances.values()
        clouds = [part.fused()[0] for instance in instances for part in instance.cloud._by_submap.values()]
        sizes.append(sum(map(len, parts)) + sum(map(len, clouds)))
    assert sizes[-1] == sizes[3] < 2 * sizes[0]


def test_a_chair_that_was_taken_away_is_retired_and_its_voxels_go(view):
    views = [*orbit(view, SCENE, 8, turn=0.5), *orbit(view, ROOM, 8, first=8, turn=0.5)]
    map_ = fused(make(corrected=False), views)
    assert sorted(names(map_)) == ["lamp", "table"]
    assert map_.retired_tag_names == ("chair",) and map_.retired_last_frames.tolist() == [7]
    assert 8 < map_.retired_gone_frames[0] <= 12
    assert np.allclose(map_.retired_boxes_world[0], CHAIR[1:], atol=0.06)
    low, high = np.add(CHAIR[1], (-0.05, -0.05, 0.2)), np.add(CHAIR[2], 0.05)  # by the floor depth cannot tell
    ghosts, before = (
        ((cloud > low) & (cloud < high)).all(axis=1).sum()
        for cloud in (map_.points_world, fused(make(corrected=False), views[:8]).points_world)
    )
    assert ghosts < 0.05 * before
    encode(map_)


def test_a_chair_that_was_moved_is_one_chair_at_its_new_place(view):
    moved = {**ROOM, "chair": ("chair", (-0.3, -1.4, 0.0), (0.2, -0.9, 0.8))}
    views = [*orbit(view, SCENE, 8, turn=0.5), *orbit(view, moved, 10, first=8, turn=1.0)]
    map_ = fused(make(corrected=False), views)
    assert sorted(names(map_)) == ["chair", "lamp", "table"]
    chair = names(map_).index("chair")
    assert np.allclose(map_.object_boxes_world[chair], moved["chair"][1:], atol=0.06)
    assert len(map_.retired_ids) == 1 and map_.retired_ids[0] != map_.object_ids[chair]


def test_a_chair_that_was_pushed_by_less_than_its_size_is_still_one_chair(view):
    pushed = {**ROOM, "chair": ("chair", (1.2, -0.2, 0.0), (1.7, 0.3, 0.8))}
    views = [*orbit(view, SCENE, 8, turn=1.0), *orbit(view, pushed, 16, first=8, turn=1.0)]
    map_ = fused(make(corrected=False), views)
    assert sorted(names(map_)) == ["chair", "lamp", "table"] and len(map_.retired_ids) == 0
    points = map_.object_points_world[slice(*map_.object_point_offsets[names(map_).index("chair") :][:2])]
    left = points[:, 0] < 1.05  # the old side, which the margin of depth tells from the new one
    assert left.mean() < 0.02


def test_what_is_hidden_or_not_recognized_for_a_while_stays(view):
    screen = {**SCENE, "screen": ("", (0.2, -1.0, 0.0), (1.8, -0.95, 1.4))}
    unnamed = {**ROOM, "chair": ("", *CHAIR[1:]), "pole": ("", *ROOM["pole"][1:])}
    views = [
        *orbit(view, SCENE, 6, turn=0.5),
        *orbit(view, screen, 6, first=6, start=0.7, turn=0.2),
        *orbit(view, unnamed, 12, first=12),
    ]
    map_ = fused(make(corrected=False), views)
    assert sorted(names(map_)) == ["chair", "lamp", "table"] and len(map_.retired_ids) == 0


def test_noisy_stereo_depth_removes_nothing(view):
    random = np.random.default_rng(0)
    views = []
    for keyframe, segments in orbit(view, SCENE, 20):
        depth_m = keyframe.depth * 0.001
        depth_m = depth_m + random.normal(0, 0.0026, depth_m.shape) * depth_m**2  # an OAK-D's, see SightConfig
        depth = np.rint(depth_m * 1000).astype(np.uint16)
        views.append((dataclasses.replace(keyframe, depth=depth), segments))
    map_ = fused(make(corrected=False), views)
    assert sorted(names(map_)) == ["chair", "lamp", "table"] and len(map_.retired_ids) == 0
    assert isinstance(views[0][0], Keyframe)
