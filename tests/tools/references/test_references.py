import dataclasses
import shutil
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from placegraph.runtime.errors import ConfigError, SchemaError
from placegraph.runtime.messages import Question
from placegraph.tools import references as tool
from placegraph.tools.graph import node_types
from placegraph.tools.references import reference_runs as making
from placegraph.tools.references import two_floor_walk
from placegraph.tools.references.recorded_steps import ReferenceRecording

APP = typer.Typer()
APP.command()(tool.references)


@pytest.fixture(scope="module")
def small(tmp_path_factory) -> Path:
    """A recording of a few small images, without the language model."""
    folder = tmp_path_factory.mktemp("replay")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(making.WALK, "camera", {"limit": 12, "settings": {"width": 96, "height": 72}})
        patch.setitem(making.NETWORKS, "camera", {"settings": {"width": 96, "height": 72, "frames": 3}})
        patch.setitem(making.TWO_FLOORS, "grounding", {"use_model": False})
        patch.setitem(making.TWO_FLOORS, "naming", {"method": "none"})
        patch.setattr(two_floor_walk, "TURN_DEG", (0, 24, 48))
        patch.setattr(two_floor_walk, "SECOND_TURN_DEG", (0,))
        patch.setattr(two_floor_walk, "CLIMB_M", ())
        patch.setattr(making, "QUESTIONS", ("the table", ""))
        result = CliRunner().invoke(APP, ["--update", "--folder", str(folder)])
        assert result.exit_code == 0, result.output
        assert f"in {folder}" in result.output
        again = making.make_recording()
    again.write(folder / "again.rec")
    return folder


def test_the_same_code_makes_the_same_bytes(small: Path) -> None:
    assert (small / tool.RECORDING).read_bytes() == (small / "again.rec").read_bytes()


def test_each_node_is_kept_with_its_settings_and_steps(small: Path) -> None:
    reference = ReferenceRecording.read(small / tool.RECORDING)
    assert set(reference.steps) == {name for name, kind in node_types().items() if kind.inputs} - set(making.LEFT_OUT)
    assert reference.settings["pose"] == {"stride": 4}
    assert reference.settings["instances"] == {"model": "drawn_scene"}  # what flat.toml says
    assert reference.settings["grounding"] == {"use_model": False}
    asked = [message.text for message in reference.messages if isinstance(message, Question)]
    assert asked == ["the table", ""]
    pose = reference.steps["pose"]
    assert len(pose) == 13 and len(pose[9][1]) == 10  # the tenth frame tells which way is up


def test_nothing_differs_from_what_was_just_made(small: Path) -> None:
    result = CliRunner().invoke(APP, ["--folder", str(small)])
    assert result.exit_code == 0
    reference = ReferenceRecording.read(small / tool.RECORDING)
    assert [line.split()[0] for line in result.stdout.splitlines()] == list(reference.steps)
    assert result.output.count("as recorded") == len(reference.steps)


def test_a_difference_is_listed_and_is_exit_status_1(small: Path, tmp_path: Path) -> None:
    reference = ReferenceRecording.read(small / tool.RECORDING)
    settings = reference.settings | {"fusion": {"voxel_m": 0.2}}
    dataclasses.replace(reference, settings=settings).write(tmp_path / tool.RECORDING)
    result = CliRunner().invoke(APP, ["--folder", str(tmp_path)])
    assert result.exit_code == 1
    assert result.output.count("as recorded") == len(reference.steps) - 1
    line = result.output.split("differs\n")[1].splitlines()[0]
    assert line.startswith("  fusion: LastKeyframe of frame 6 gives Map(6).") and "was" in line


def test_a_folder_or_recording_that_is_absent_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no such folder; references belong to a source checkout"):
        tool.references(update=True, folder=tmp_path / "none")
    with pytest.raises(SchemaError, match=r"house\.rec: not a reference"):
        tool.references(update=False, folder=tmp_path)


def test_comparing_writes_nothing(small: Path, tmp_path: Path) -> None:
    shutil.copy(small / tool.RECORDING, tmp_path)
    CliRunner().invoke(APP, ["--folder", str(tmp_path)])
    assert [path.name for path in tmp_path.iterdir()] == [tool.RECORDING]


def test_the_default_folder_is_that_of_the_checkout() -> None:
    assert (tool.FOLDER / "test_replay.py").is_file()
