"""Rooms of occupancy maps of other systems: what is read, what is written, what is refused. (command)"""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from placegraph.runtime.errors import ConfigError, SchemaError, SourceError
from placegraph.tools.cli import app
from placegraph.tools.map_files.ply import write_points
from placegraph.tools.rooms import read_map, rooms_of_plan

FREE, WALL, UNKNOWN = 254, 0, 205


def two_rooms() -> np.ndarray:
    """5 cm a pixel: a room of 4 x 3 m left, one of 2.5 x 3 m right, a door of .9 m between, unknown around."""
    gray = np.full((80, 160), UNKNOWN, np.uint8)
    gray[8:72, 8:142] = WALL
    gray[10:70, 10:90] = FREE
    gray[10:70, 92:140] = FREE
    gray[30:48, 90:92] = FREE
    gray[20:24, 20:30] = WALL  # a piece of furniture
    return gray


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "plan.png"
    cv2.imwrite(str(path), two_rooms())
    return path


def write_yaml(folder: Path, **changed: object) -> Path:
    values = {"image": "plan.png", "resolution": 0.05, "origin": [-1.0, 2.0, 0.0], "negate": 0} | changed
    path = folder / "map.yaml"
    path.write_text("".join(f"{name}: {value}\n" for name, value in values.items()))
    return path


def test_labels_are_written_largest_first_over_furniture_and_not_over_what_is_unknown(plan: Path) -> None:
    out = plan.parent / "labels.png"
    done = CliRunner().invoke(app, ["rooms", str(plan), "--resolution", "0.05", "--out", str(out)])
    assert done.exit_code == 0 and "2 rooms" in done.stdout
    labels = cv2.imread(str(out), cv2.IMREAD_UNCHANGED)
    assert labels.dtype == np.uint16 and labels.shape == (80, 160) and labels.max() == 2
    assert (labels[12:68, 12:88] == 1).all() and (labels[12:68, 94:138] == 2).all()
    assert (labels[:6] == 0).all() and (labels[:, 146:] == 0).all()


def test_outlines_of_a_ros_map_are_in_its_frame(plan: Path) -> None:
    yaml = write_yaml(plan.parent)
    done = CliRunner().invoke(app, ["rooms", str(yaml), "--out", str(plan.parent / "labels.png"), "--json"])
    large, small = json.loads(done.stdout)["rooms"]
    assert large["area_m2"] == pytest.approx(12, rel=0.05) and small["area_m2"] == pytest.approx(7.2, rel=0.05)
    outline = np.array(large["outline_m"])
    # column 10 to 90 from x = -1; rows 10 to 70 from the top of 80, so .5 to 3.5 m above y = 2
    np.testing.assert_allclose(outline.min(axis=0), [-0.5, 2.5], atol=0.11)
    np.testing.assert_allclose(outline.max(axis=0), [3.5, 5.5], atol=0.11)


def test_a_negated_map_is_the_same_map(plan: Path) -> None:
    wanted = rooms_of_plan(read_map(plan, 0.05))[1]
    cv2.imwrite(str(plan), 255 - two_rooms())
    found = rooms_of_plan(read_map(write_yaml(plan.parent, negate=1)))[1]
    assert [(a.mask == b.mask).all() for a, b in zip(found, wanted, strict=True)] == [True, True]


def test_a_map_without_walls_is_one_room_and_one_without_anything_has_none(plan: Path) -> None:
    cv2.imwrite(str(plan), np.full((60, 60), FREE, np.uint8))
    assert [room.mask.all() for room in rooms_of_plan(read_map(plan, 0.05))[1]] == [True]
    cv2.imwrite(str(plan), np.full((60, 60), UNKNOWN, np.uint8))
    assert rooms_of_plan(read_map(plan, 0.05))[1] == []


def test_wrong_input_is_named(plan: Path) -> None:
    folder = plan.parent
    with pytest.raises(ConfigError, match="--resolution"):
        read_map(plan)
    with pytest.raises(ConfigError, match="brings its own"):
        read_map(write_yaml(folder), 0.05)
    with pytest.raises(ConfigError, match="not positive"):
        read_map(plan, -0.05)
    with pytest.raises(SourceError, match=r"absent\.png"):
        read_map(folder / "absent.png", 0.05)
    with pytest.raises(SourceError, match=r"gone\.pgm"):
        read_map(write_yaml(folder, image="gone.pgm"))
    with pytest.raises(SourceError, match="resolution"):
        read_map(write_yaml(folder, resolution="wide"))
    with pytest.raises(SourceError, match="rotated by"):
        read_map(write_yaml(folder, origin="[0.0, 0.0, 0.5]"))
    broken = folder / "broken.yaml"
    broken.write_text("image: [\n")
    with pytest.raises(SourceError, match="not YAML"):
        read_map(broken)
    done = CliRunner().invoke(app, ["rooms", str(plan), "--resolution", "0.05", "--out", str(folder / "no" / "a.png")])
    assert isinstance(done.exception, ConfigError)


def write_cloud(path: Path, storeys: int) -> None:
    """Rooms of 4 x 3 m on top of each other, 2.5 m high, with .3 m of slab between them."""
    x, y, z = (np.arange(0, size + 0.01, 0.04) for size in (4.0, 3.0, 2.5))
    level = np.stack(np.meshgrid(x, y, [0.0, 2.5], indexing="ij"), axis=-1).reshape(-1, 3)
    ends = np.stack(np.meshgrid([0.0, 4.0], y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    sides = np.stack(np.meshgrid(x, [0.0, 3.0], z, indexing="ij"), axis=-1).reshape(-1, 3)
    room = np.concatenate((level, ends, sides))
    write_points(path, np.concatenate([room + np.array([10.0, -2.0, 2.8 * k]) for k in range(storeys)]), {})


def test_a_cloud_of_one_floor_is_written_as_one_image(tmp_path: Path) -> None:
    cloud, out = tmp_path / "scan.ply", tmp_path / "labels.png"
    write_cloud(cloud, 1)
    done = CliRunner().invoke(app, ["rooms", str(cloud), "--out", str(out)])
    assert done.exit_code == 0 and "floor 1 from" in done.stdout and "1 rooms, labels in" in done.stdout
    assert [path.name for path in tmp_path.glob("*.png")] == ["labels.png"]
    assert cv2.imread(str(out), cv2.IMREAD_UNCHANGED).max() == 1


def test_each_floor_of_a_cloud_has_its_image_and_they_lie_where_the_json_says(tmp_path: Path) -> None:
    cloud = tmp_path / "scan.PLY"
    write_cloud(cloud, 3)
    call = ["rooms", str(cloud), "--out", str(tmp_path / "labels.png"), "--json", "--resolution", "0.1"]
    floors = json.loads(CliRunner().invoke(app, call).stdout)["floors"]
    assert [floor["labels"] for floor in floors] == [str(tmp_path / f"labels-{k}.png") for k in (1, 2, 3)]
    np.testing.assert_allclose([floor["low_m"] for floor in floors], [0, 2.8, 5.6], atol=0.05)
    np.testing.assert_allclose([floor["high_m"] for floor in floors], [2.5, 5.3, 8.1], atol=0.05)
    for floor in floors:
        (room,) = floor["rooms"]
        outline = np.array(room["outline_m"])
        np.testing.assert_allclose(outline.min(axis=0), [10, -2], atol=0.25)
        np.testing.assert_allclose(outline.max(axis=0), [14, 1], atol=0.25)
        labels = cv2.imread(floor["labels"], cv2.IMREAD_UNCHANGED)
        rows, columns = np.nonzero(labels[::-1])
        xy = np.array(floor["origin_m"]) + (np.stack((columns, rows), axis=1) + 0.5) * floor["cell_m"]
        assert floor["cell_m"] == 0.1 and len(xy) * 0.01 == pytest.approx(room["area_m2"])
        assert (xy > outline.min(axis=0)).all() and (xy < outline.max(axis=0)).all()


def test_clouds_that_cannot_be_read_or_written_are_named(tmp_path: Path) -> None:
    absent = CliRunner().invoke(app, ["rooms", str(tmp_path / "a.ply"), "--out", str(tmp_path / "a.png")])
    assert isinstance(absent.exception, SchemaError) and "a.ply" in str(absent.exception)
    write_cloud(tmp_path / "a.ply", 1)
    for out in (tmp_path / "no" / "a.png", tmp_path / "a.txt"):
        done = CliRunner().invoke(app, ["rooms", str(tmp_path / "a.ply"), "--out", str(out)])
        assert isinstance(done.exception, ConfigError) and str(out) in str(done.exception)
