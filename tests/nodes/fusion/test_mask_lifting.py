import dataclasses

import numpy as np
import pytest

from placegraph.nodes.fusion.mask_lifting import LiftConfig, exclusive_masks, lift_masks
from placegraph.nodes.fusion.voxel_map import depth_edges
from placegraph.runtime.errors import SchemaError

TABLE = ("table", (-0.6, -0.4, 0.68), (0.6, 0.4, 0.72))
CUP = ("cup", (-0.05, -0.05, 0.72), (0.05, 0.05, 0.84))
WALL = ("", (-3, 2.0, 0), (3, 2.1, 2.5))


def lifted(keyframe, segments, **changes):
    depth = keyframe.depth.astype(np.float32) * np.float32(keyframe.depth_unit_m)
    return lift_masks(keyframe, depth, depth_edges(depth), segments, LiftConfig(**changes))


def test_no_masks(view):
    keyframe, segments = view(0, {"wall": WALL}, (0, -1, 1), (0, 1, 1))
    assert lifted(keyframe, segments) == []


def test_a_view_without_any_depth_gives_nothing(view):
    keyframe, segments = view(0, {"table": TABLE}, (0, -1.5, 1.5), (0, 0, 0.7))
    blind = dataclasses.replace(keyframe, depth=np.zeros_like(keyframe.depth))
    assert len(lifted(keyframe, segments)) == 1
    assert lifted(blind, segments) == []


def test_what_is_too_far_gives_nothing(view):
    keyframe, segments = view(0, {"table": TABLE}, (0, -1.5, 1.5), (0, 0, 0.7))
    assert lifted(keyframe, segments, max_depth_m=1.0) == []


def test_a_box_outside_the_image_is_refused(view):
    keyframe, segments = view(4, {"table": TABLE}, (0, -1.5, 1.5), (0, 0, 0.7))
    moved = dataclasses.replace(segments, boxes_px=segments.boxes_px + np.int32(100))
    with pytest.raises(SchemaError, match=r"frame 4: box .* outside 160x120"):
        lifted(keyframe, moved)


def test_points_lie_on_the_object_in_the_world(view):
    keyframe, segments = view(0, {"table": TABLE, "wall": WALL}, (0.3, -1.5, 1.5), (0, 0, 0.7))
    (seen,) = lifted(keyframe, segments)
    assert seen.name == "table" and seen.score == 0.5
    assert (seen.box[0] > np.subtract(TABLE[1], 0.02)).all() and (seen.box[1] < np.add(TABLE[2], 0.02)).all()
    assert seen.box[1, 0] - seen.box[0, 0] > 1.0
    assert (np.diff(seen.keys) > 0).all() and (seen.values[:, 7] == 1).all()


def test_a_mask_that_leaks_onto_the_wall_behind_keeps_the_nearer_main_part(view):
    keyframe, segments = view(0, {"table": TABLE, "wall": WALL}, (0, -1.5, 1.2), (0, 0, 0.8))
    x0, y0, x1, y1 = segments.boxes_px[0].tolist()
    (mask,) = segments.masks()
    grown = np.pad(mask, ((6, 0), (0, 0)), constant_values=True)
    bits, offsets = segments.pack([grown])
    leaking = dataclasses.replace(
        segments, boxes_px=np.array([[x0, y0 - 6, x1, y1]], np.int32), mask_bits=bits, mask_offsets=offsets
    )
    (seen,) = lifted(keyframe, leaking)
    assert seen.box[1, 1] < 0.45  # the wall is at 2.0


def test_what_lies_on_a_thing_is_cut_out_of_its_mask():
    table, cup = np.ones((20, 30), bool), np.ones((5, 5), bool)
    boxes = np.array([[0, 0, 30, 20], [10, 4, 15, 9]], np.int32)
    cut, whole = exclusive_masks(boxes, [table, cup], 0.8)
    assert whole.all() and table.all()
    assert not cut[4:9, 10:15].any() and cut.sum() == 600 - 25


def test_a_neighbor_that_only_overlaps_is_not_cut_out():
    boxes = np.array([[0, 0, 30, 20], [28, 0, 33, 5]], np.int32)
    cut, _ = exclusive_masks(boxes, [np.ones((20, 30), bool), np.ones((5, 5), bool)], 0.8)
    assert cut.all()


def test_two_masks_of_one_size_keep_their_pixels():
    boxes = np.array([[0, 0, 8, 8], [0, 0, 8, 8]], np.int32)
    assert all(mask.all() for mask in exclusive_masks(boxes, [np.ones((8, 8), bool)] * 2, 0.8))
