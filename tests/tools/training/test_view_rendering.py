"""Rendered views: boxes of instances by hand, poses, and a shard of a tiny house."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from placegraph.tools.simulator.house_model import Floor, House, Item, Material, Part, PlacedItem, Room
from placegraph.tools.simulator.mesh_primitives import block, box
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.training import view_rendering as views
from placegraph.tools.training.data_augmentation import load_shards
from placegraph.tools.training.view_rendering import (
    CALIBRATION_SEEDS,
    EVALUATION_SEEDS,
    TRAINING_SEEDS,
    camera_pose,
    render_house,
    visible_boxes,
)

CLASS_OF = np.array([7, 3, 0, 60], np.uint8)


def test_boxes_of_an_empty_image() -> None:
    rows = visible_boxes(np.zeros((4, 6), np.uint16), CLASS_OF)
    assert rows.shape == (0, 7) and rows.dtype == np.float32


def test_one_pixel_and_the_border_and_an_object_in_two_parts() -> None:
    instance = np.zeros((10, 12), np.uint16)
    instance[9, 11] = 1  # one pixel in the last corner
    instance[0:10, 0] = 2  # the whole left border
    instance[2, 3] = instance[7:9, 8:10] = 4  # two parts; item 2 is not seen
    assert visible_boxes(instance, CLASS_OF).tolist() == [
        [0, 7, 11, 9, 12, 10, 1],
        [1, 3, 0, 0, 1, 10, 10],
        [3, 60, 3, 2, 10, 9, 5],
    ]


def test_an_object_that_fills_the_image() -> None:
    assert visible_boxes(np.full((3, 5), 3, np.uint16), CLASS_OF).tolist() == [[2, 0, 0, 0, 5, 3, 15]]


def test_camera_pose_looks_along_yaw_and_down_by_pitch() -> None:
    pose = camera_pose(np.array([1.0, 2, 3]), np.pi / 2, 0.0)
    np.testing.assert_allclose(pose[:3, 3], [1, 2, 3])
    np.testing.assert_allclose(pose[:3, :3] @ [0, 0, 1], [0, 1, 0], atol=1e-12)  # forward: world y
    np.testing.assert_allclose(pose[:3, :3] @ [1, 0, 0], [1, 0, 0], atol=1e-12)  # right: world x
    np.testing.assert_allclose(pose[:3, :3] @ [0, 1, 0], [0, 0, -1], atol=1e-12)  # down
    down = camera_pose(np.zeros(3), 0.3, 0.5, 0.1)
    np.testing.assert_allclose(down[:3, 2], [np.cos(0.5) * np.cos(0.3), np.cos(0.5) * np.sin(0.3), -np.sin(0.5)])
    np.testing.assert_allclose(down[:3, :3] @ down[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(down[:3, :3]) == pytest.approx(1)


def test_no_seed_serves_two_purposes() -> None:
    seeds = [*EVALUATION_SEEDS, *CALIBRATION_SEEDS, *TRAINING_SEEDS]
    assert len(set(seeds)) == len(seeds)


def tiny_house(seed: int) -> House:
    """A room of 4 x 4 m with three boxes: a chair, a sofa and a cup."""
    square = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
    white = Material((230, 230, 230))
    walls: tuple[Part, ...] = (
        box((0, 0, -0.1), (4, 4, 0), white),
        box((-0.1, 0, 0), (0, 4, 2.5), white), box((4, 0, 0), (4.1, 4, 2.5), white),
        box((0, -0.1, 0), (4, 0, 2.5), white), box((0, 4, 0), (4, 4.1, 2.5), white),
    )  # fmt: skip
    places = (("chair", 0.7, 0.7, 0.0), ("sofa", 3.2, 2.0, 0.0), ("cup", 3.2, 2.0, 0.8))
    items = tuple(
        PlacedItem(i, Item(name, (block((0, 0, 0), (0.6, 0.6, 0.8), Material((200, 40 * i, 40))),)), x, y, z, 0.0, 0)
        for i, (name, x, y, z) in enumerate(places)
    )
    floor = Floor(0, 0.0, 2.5, square, (Room(0, 0, "living room", square),), ())
    return House(seed, (floor,), (), walls, items, lights=((2.0, 2.0, 2.3),))


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "generate_house", tiny_house)
    monkeypatch.setattr(views, "WIDTH", 64)
    monkeypatch.setattr(views, "HEIGHT", 48)


@pytest.mark.usefixtures("small")
def test_a_shard_holds_what_it_says_and_is_read_back(tmp_path: Path) -> None:
    folder = render_house(20003, 6, tmp_path)
    assert folder == tmp_path / "20003" and [path.name for path in tmp_path.iterdir()] == ["20003"]
    (shard,) = load_shards(tmp_path)
    count = len(shard.color)
    assert 1 <= count <= 6
    assert shard.color.shape == (count, 48, 64, 3) and shard.color.dtype == np.uint8
    assert shard.depth.shape == shard.instance.shape == (count, 48, 64)
    assert shard.depth.dtype == shard.instance.dtype == np.uint16
    assert shard.shown.tolist() == [-1, *(NAMES.index(name) for name in ("chair", "sofa", "cup"))]
    assert 300 < np.median(shard.depth[shard.depth > 0]) < 6000  # millimetres in a room of 4 m
    for instance, boxes in zip(shard.instance, shard.boxes, strict=True):
        np.testing.assert_array_equal(boxes, visible_boxes(instance, shard.shown[1:].astype(np.uint8)))


@pytest.mark.usefixtures("small")
def test_same_seed_same_bytes(tmp_path: Path) -> None:
    for name in "abc":
        (tmp_path / name).mkdir()
    one, same = render_house(20003, 3, tmp_path / "a"), render_house(20003, 3, tmp_path / "b")
    other = render_house(20004, 3, tmp_path / "c")
    names = sorted(path.name for path in one.iterdir())
    assert names == ["boxes.npy", "color.npy", "depth.npy", "instance.npy", "item_class.npy"]
    assert all((one / name).read_bytes() == (same / name).read_bytes() for name in names)
    assert (one / "color.npy").read_bytes() != (other / "color.npy").read_bytes()


def test_a_finished_shard_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "generate_house", None)  # would fail when called
    (tmp_path / "20003").mkdir()
    assert render_house(20003, 3, tmp_path) == tmp_path / "20003"
    assert list((tmp_path / "20003").iterdir()) == []
