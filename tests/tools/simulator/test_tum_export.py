import json
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.tum import SOURCE as TUM
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.simulator import command
from placegraph.tools.simulator import tum_export as export
from placegraph.tools.simulator.floor_plan_drawing import MARGIN_M, PX_PER_M, TITLE_PX, draw_floor_plan, tint
from placegraph.tools.simulator.ground_truth import Truth, read_house_run, read_truth, write_truth
from placegraph.tools.simulator.house_frames import DEPTH_STEPS_PER_M, HouseFrames, quantize_depth
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.simulator.text_labels import LabelLayout
from placegraph.tools.simulator.tum_export import HouseOrder

ORDER = HouseOrder(seed=5, floors=1, limit=3, width=64, height=48)


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small house folder; tests must not change it."""
    out = tmp_path_factory.mktemp("house") / "made"
    export.export(ORDER, out, workers=1)
    return out


@pytest.fixture(scope="module")
def source() -> HouseFrames:
    return HouseFrames(ORDER.seed, ORDER.floors, ORDER.width, ORDER.height)


@pytest.fixture
def truth_folder(folder: Path, tmp_path: Path) -> Path:
    """A copy of the truth alone, to damage."""
    write_truth(read_truth(folder), tmp_path)
    return tmp_path


def test_any_number_of_workers_gives_the_same_bytes(folder: Path, tmp_path: Path):
    # in a process of its own, since Python's helper for spawned processes stays as long as the one that asked for it
    code = (
        "from pathlib import Path\n"
        "from placegraph.tools.simulator.tum_export import HouseOrder, export\n"
        f"export({ORDER!r}, Path({str(tmp_path / 'again')!r}), workers=2)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    first, again = files(folder), files(tmp_path / "again")
    assert list(first) == list(again)
    assert [name for name in first if first[name] != again[name]] == []
    assert [path.name for path in tmp_path.iterdir()] == ["again"]


def test_another_seed_gives_other_bytes(folder: Path, tmp_path: Path):
    export.export(HouseOrder(6, 1, 1, 64, 48), tmp_path / "other", workers=1)
    name = "rgb/000000.jpg"
    assert (folder / name).read_bytes() != (tmp_path / "other" / name).read_bytes()


def test_the_folder_holds_what_is_promised(folder: Path):
    numbers = [f"{index:06d}" for index in range(3)]
    truth = ("connections", "floors", "house", "locations", "objects", "questions", "rooms", "seen")
    assert set(files(folder)) == {
        *("calibration.txt", "depth.txt", "groundtruth.txt", "plan.png", "rgb.txt"),
        *(f"rgb/{n}.jpg" for n in numbers),
        *(f"depth/{n}.png" for n in numbers),
        *(f"truth/instances/{n}.png" for n in numbers),
        *(f"truth/{name}.json" for name in truth),
    }


def test_the_tum_source_reads_it_back(folder: Path, source: HouseFrames):
    frames = list(TUM(folder, {}).frames())
    assert len(frames) == 3
    for read, made in zip(frames, source.frames(3), strict=True):
        assert read.stamp_ns == made.stamp_ns
        assert np.array_equal(read.depth, made.depth_steps)
        assert np.allclose(read.depth * read.depth_unit_m, made.depth_m, atol=1e-6)
        assert np.allclose(read.given_world_from_camera, made.world_from_camera, atol=1e-7)
        assert np.array_equal(read.intrinsics, source.intrinsics)
        assert np.abs(read.color.astype(int) - made.color).mean() < 12  # jpeg of a tiny image


def test_a_frame_does_not_depend_on_those_before_it(source: HouseFrames):
    alone, in_turn = source.frame(2), list(source.frames(3))[2]
    assert alone.color.tobytes() == in_turn.color.tobytes()
    assert alone.depth_m.tobytes() == in_turn.depth_m.tobytes()
    assert source.frame(1).color.tobytes() != alone.color.tobytes()


def test_limit_zero_is_the_whole_walk_and_a_larger_one_no_more(source: HouseFrames):
    whole = len(source.stamps_ns)
    assert (source.count(0), source.count(whole + 5), source.count(2)) == (whole, whole, 2)


def test_depth_is_rounded_to_steps_and_what_does_not_fit_is_no_reading():
    far = np.float32(65535 / DEPTH_STEPS_PER_M)
    depth_m = np.array([[0, 1.00009, 1.00011, np.nan, np.inf, -1, 14, far]], np.float32)
    assert quantize_depth(depth_m)[0] == pytest.approx([0, 1.0, 1.0002, 0, 0, 0, 0, far], abs=1e-6)


def test_the_truth_is_that_of_the_house(folder: Path, source: HouseFrames):
    truth, house = read_truth(folder), source.house
    assert truth.house.frames == 3 and ORDER.is_made_by(truth.house)
    assert len(truth.rooms) == len(house.rooms) and len(truth.floors) == len(house.floors) == 1
    assert [one.members for one in truth.locations] == [tuple(one.members) for one in house.locations]
    for one, placed in zip(truth.objects, house.items, strict=True):
        assert (one.id, one.class_name, one.support) == (placed.id, placed.item.name, placed.support)
        assert one.class_name in NAMES
        assert one.floor == truth.rooms[one.room].floor
        assert one.box == pytest.approx(placed.box, abs=6e-4)
        assert one.footprint == pytest.approx(placed.footprint, abs=6e-4)
        box = one.oriented_box
        assert one.box.mean(axis=0)[2] == pytest.approx(box.center[2], abs=2e-3)
        assert one.footprint.mean(axis=0) == pytest.approx(box.center[:2], abs=2e-3)
        assert abs(box.yaw) <= np.pi + 1e-3


def test_what_is_seen_is_counted_from_the_instance_images(folder: Path):
    images = [cv2.imread(str(p), cv2.IMREAD_UNCHANGED) for p in sorted((folder / "truth" / "instances").iterdir())]
    assert all(image.dtype == np.uint16 and image.shape == (48, 64) for image in images)
    clear = 400 * (64 * 48) / (640 * 480)
    for seen in read_truth(folder).seen:
        pixels = [int((image == seen.id + 1).sum()) for image in images]
        assert (seen.frames, seen.clear_frames) == (sum(n > 0 for n in pixels), sum(n >= clear for n in pixels))
    assert any(seen.frames for seen in read_truth(folder).seen)


def test_truth_survives_being_read_and_written(folder: Path, tmp_path: Path):
    write_truth(read_truth(folder), tmp_path)
    for name in Truth.__dataclass_fields__:
        assert (tmp_path / "truth" / f"{name}.json").read_bytes() == (folder / "truth" / f"{name}.json").read_bytes()


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [
        ("objects", "box", [[0, 0, 0]]),
        ("objects", "box", None),
        ("objects", "footprint", [[0, 0], [0]]),
        ("objects", "class", 7),
        ("objects", "room", "1"),
        ("objects", "more", 1),
        ("rooms", "polygon", [[0, "x"]]),
        ("floors", "z_m", None),
        ("seen", "frames", 1.5),
    ],
)
def test_a_damaged_field_is_named(truth_folder: Path, name: str, key: str, value: object):
    file = truth_folder / "truth" / f"{name}.json"
    rows = json.loads(file.read_text())
    rows[0][key] = value
    file.write_text(json.dumps(rows))
    with pytest.raises(SourceError, match=rf"{name}\.json: 0\.{key}"):
        read_truth(truth_folder)


@pytest.mark.parametrize("text", ["", "[", "{}", '[{"id": 0}]'])
def test_a_damaged_file_is_named(truth_folder: Path, text: str):
    (truth_folder / "truth" / "objects.json").write_text(text)
    with pytest.raises(SourceError, match=r"objects\.json: "):
        read_truth(truth_folder)


def test_a_missing_file_is_named(truth_folder: Path):
    (truth_folder / "truth" / "seen.json").unlink()
    with pytest.raises(SourceError, match=r"seen\.json: cannot be read"):
        read_truth(truth_folder)


def test_a_lost_object_is_noticed(truth_folder: Path):
    file = truth_folder / "truth" / "objects.json"
    file.write_text(json.dumps(json.loads(file.read_text())[1:]))
    with pytest.raises(SourceError, match="do not hold the same objects"):
        read_truth(truth_folder)


def test_a_stopped_run_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(export, "write_truth", stop)
    with pytest.raises(KeyboardInterrupt):
        export.export(ORDER, tmp_path / "out", workers=1)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(SourceError, match="cannot be written"):
        export.export(ORDER, tmp_path / "file" / "out", workers=1)


def test_the_plan_shows_every_room_and_the_path(source: HouseFrames):
    path = np.asarray(source.world_from_camera)[:, :3, 3]
    plan = draw_floor_plan(source.house, path)
    size_m = np.ptp(source.house.floors[0].outline, axis=0) + 2 * MARGIN_M
    width, height = np.ceil(size_m * PX_PER_M).astype(int)
    assert plan.shape == (height + TITLE_PX, width, 3)
    for room in source.house.rooms:
        assert (plan == tint(room.type)).all(axis=2).sum() > 1000, room.type
    without = draw_floor_plan(source.house, np.zeros((0, 3)))
    assert plan.shape == without.shape and (plan != without).any()


def test_a_word_that_finds_no_place_is_left_out_unless_it_must_be():
    image = np.full((40, 200, 3), 255, np.uint8)
    for must, words in ((False, 1), (True, 2)):
        labels = LabelLayout(image.copy())
        labels.add("table", [(100, 20)], 15, (0, 0, 0))
        labels.add("table", [(105, 20), (95, 22)], 15, (0, 0, 0), must=must)
        assert len(labels.placed) == words


def test_a_word_moves_to_where_it_covers_no_other():
    labels = LabelLayout(np.full((80, 200, 3), 255, np.uint8))
    labels.add("table", [(100, 20)], 15, (0, 0, 0))
    labels.add("chair", [(100, 20), (100, 60)], 15, (0, 0, 0))
    assert [label.center for label in labels.placed] == [(100, 20), (100, 60)]


def order(out: Path, **changes: int) -> None:
    command.house(
        **{"out": out, "seed": 5, "floors": 1, "limit": 3, "width": 64, "workers": 1, "quiet": True, **changes}
    )


def test_the_command_says_how_to_map_it_and_does_nothing_twice(folder: Path, monkeypatch, capsys):
    monkeypatch.setattr(command, "export", lambda *_: pytest.fail("made again"))
    order(folder)
    said = capsys.readouterr().out
    assert "it is there already" in said and "3 frames of 64x48" in said
    assert f"placegraph run configs/demo.toml --source {folder}" in said


@pytest.mark.parametrize("changes", [{"seed": 6}, {"limit": 0}, {"floors": None}, {"width": 128}])
def test_the_command_refuses_a_folder_of_another_house(folder: Path, changes: dict[str, int]):
    with pytest.raises(ConfigError, match="holds another house"):
        order(folder, **changes)


def test_the_command_refuses_a_house_of_another_generator(folder: Path, monkeypatch):
    monkeypatch.setattr(export, "generator_version", lambda: "other")
    with pytest.raises(ConfigError, match="holds another house"):
        order(folder)


def test_the_command_refuses_what_is_no_house(tmp_path: Path):
    (tmp_path / "letter.txt").touch()
    with pytest.raises(ConfigError, match="not a house folder"):
        order(tmp_path)
    with pytest.raises(ConfigError, match="is a file"):
        order(tmp_path / "letter.txt")


def test_replace_removes_a_house_but_nothing_else(tmp_path: Path, folder: Path, monkeypatch):
    house, other = tmp_path / "house", tmp_path / "other"
    shutil.copytree(folder, house)
    monkeypatch.setattr(command, "export", lambda order, out, *_: (out.exists(), read_house_run(folder))[1])
    order(house, limit=2, replace=True)
    assert not house.exists()
    other.mkdir()
    (other / "letter.txt").touch()
    with pytest.raises(ConfigError, match="not a house folder"):
        order(other, replace=True)
    assert (other / "letter.txt").exists()
