import json

import numpy as np
import pytest

from placegraph.runtime.errors import SourceError
from placegraph.tools.evaluate import truth_file
from placegraph.tools.evaluate.ground_truth import (
    ClassVocabulary,
    GroundTruth,
    GroundTruthFloor,
    GroundTruthObject,
    GroundTruthPlace,
)
from placegraph.tools.evaluate.truth_file import read_truth_file, write_truth_file

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
BOX = [[0, 0, 0], [1, 1, 1]]


@pytest.fixture
def read(tmp_path):
    def read(**values):
        file = tmp_path / "truth.json"
        file.write_text(json.dumps({"version": 1} | values))
        return read_truth_file(file)

    return read


def test_the_example_of_the_docstring_can_be_read(tmp_path) -> None:
    text = truth_file.__doc__
    file = tmp_path / "example.json"
    file.write_text(text[text.index("    {") : text.rindex("]}") + 2])
    known = read_truth_file(file)
    assert (len(known.floors), len(known.rooms), len(known.locations), len(known.objects)) == (1, 1, 1, 1)
    assert known.vocabulary.classes_of(["sofa", "tables"]) == ["couch", "table"]
    assert known.trajectory[1305031102160000000][:3, 3].tolist() == [1.3, 0.6, 1.6]


def test_what_is_left_out_is_unknown_and_what_is_empty_is_known(read) -> None:
    known = read()
    assert known.floors is known.rooms is known.locations is known.objects is known.trajectory is None
    empty = read(floors=[], rooms=[], locations=[], objects=[], trajectory=[])
    assert empty.floors == empty.rooms == empty.locations == empty.objects == () and empty.trajectory == {}


def test_what_is_left_out_of_an_entry(read) -> None:
    known = read(rooms=[{"polygon": SQUARE}], objects=[{"name": "sofa", "box": BOX}])
    assert (known.rooms[0].floor, known.rooms[0].seen, known.objects[0].seen) == (0, True, "well")
    assert known.vocabulary.names == ("sofa",) and not known.vocabulary.embedding


def test_what_was_not_seen_well(read) -> None:
    known = read(
        floors=[{"bottom_m": 0, "top_m": 2, "seen": "never"}],
        rooms=[{"polygon": SQUARE, "seen": "poorly"}],
        objects=[{"name": "sofa", "box": BOX, "seen": "poorly"}],
    )
    assert (known.floors[0].seen, known.rooms[0].seen, known.objects[0].seen) == (False, False, "poorly")


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"version": 2}, "version: Input should be 1"),
        ({"room": []}, "room: Extra inputs are not permitted"),
        ({"rooms": [{"polygon": SQUARE, "area": 1}]}, r"rooms\.0\.area: Extra inputs"),
        ({"rooms": [{}]}, r"rooms\.0\.polygon: Field required"),
        ({"rooms": [{"polygon": SQUARE[:2]}]}, r"rooms\.0\.polygon: List should have at least 3"),
        ({"rooms": [{"polygon": [[0, 0], [5000, 0], [0, 5000]]}]}, "wider than 200 m; metres are expected"),
        ({"rooms": [{"polygon": [[0, 0], [1e5, 0], [0, 1]]}]}, r"rooms\.0\.polygon\.1\.0: Input should be less"),
        ({"rooms": [{"polygon": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}]}, r"rooms\.0\.polygon\.0"),
        ({"rooms": [{"polygon": SQUARE, "floor": 1}]}, r"rooms\.0\.floor: there is no floor 1"),
        ({"floors": [], "locations": [{"polygon": SQUARE}]}, r"locations\.0\.floor: there is no floor 0"),
        ({"floors": [{"bottom_m": 2, "top_m": 2}]}, r"floors\.0: top_m 2 is not above bottom_m 2"),
        ({"objects": [{"name": "sofa", "box": BOX[::-1]}]}, r"objects\.0\.box: a lowest corner and then a highest"),
        ({"objects": [{"name": "", "box": BOX}]}, r"objects\.0\.name: String should have at least 1"),
        ({"objects": [{"name": "sofa", "box": BOX, "seen": "yes"}]}, r"objects\.0\.seen: Input should be 'well'"),
        ({"objects": [{"name": "sofa", "box": BOX}], "classes": {}}, r"objects\.0\.name: 'sofa' is not one of"),
        ({"classes": {"a": ["x"], "b": ["x"]}}, "classes: the word 'x' belongs to two"),
        ({"names": "fuzzy"}, "names: Input should be 'words'"),
        ({"trajectory": [[0, 0, 0, 0, 0, 0, 0, 0]]}, r"trajectory\.0: the last four numbers are no unit quaternion"),
        ({"trajectory": [[0, 0, 0, 0, 0, 0, 0]]}, r"trajectory\.0"),
        ({"trajectory": [[1, 0, 0, 0, 0, 0, 0, 1]] * 2}, r"trajectory\.1: the time 1\.0 appears twice"),
    ],
)
def test_what_is_wrong_is_named(read, values, reason) -> None:
    with pytest.raises(SourceError, match=reason) as error:
        read(**values)
    assert "truth.json: " in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999", '"1"', "null"])
def test_only_finite_numbers_are_numbers(tmp_path, number) -> None:
    file = tmp_path / "truth.json"
    text = '{"version": 1, "objects": [{"name": "sofa", "box": [[0, 0, HERE], [1, 1, 1]]}]}'
    file.write_text(text.replace("HERE", number))
    with pytest.raises(SourceError, match=r"truth\.json: "):
        read_truth_file(file)


def test_files_that_are_none(tmp_path) -> None:
    with pytest.raises(SourceError, match=r"no\.json: cannot be read: No such file"):
        read_truth_file(tmp_path / "no.json")
    for text in ("", "[]", "{}", "\xff"):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(SourceError, match=r"bad\.json: "):
            read_truth_file(tmp_path / "bad.json")
    with pytest.raises(SourceError, match="cannot be written"):
        write_truth_file(GroundTruth(), tmp_path / "no" / "truth.json")


def test_what_is_written_is_read_back(tmp_path) -> None:
    pose = np.eye(4)
    pose[:3, 3] = (1, 2, 3)
    square, box = np.array(SQUARE, float), np.array(BOX, float)
    known = GroundTruth(
        floors=(GroundTruthFloor(0.0, 2.5), GroundTruthFloor(2.8, 5.0, seen=False)),
        rooms=(GroundTruthPlace(1, square, seen=False),),
        locations=(),
        objects=(GroundTruthObject("sofa", box, "poorly"), GroundTruthObject("bed", box)),
        vocabulary=ClassVocabulary({"sofa": ["couch"], "bed": []}, embedding=True),
        trajectory={1_500_000_000: pose},
    )
    file = tmp_path / "truth.json"
    write_truth_file(known, file)
    again = read_truth_file(file)
    assert again.floors == known.floors and again.locations == ()
    assert (again.rooms[0].floor, again.rooms[0].seen, again.rooms[0].outline.tolist()) == (1, False, SQUARE)
    assert [(one.name, one.seen) for one in again.objects] == [("sofa", "poorly"), ("bed", "well")]
    assert again.vocabulary.classes == known.vocabulary.classes and again.vocabulary.embedding
    assert again.trajectory[1_500_000_000] == pytest.approx(pose)
    before = file.read_bytes()
    write_truth_file(again, file)
    assert file.read_bytes() == before
    write_truth_file(GroundTruth(), file)
    assert read_truth_file(file).rooms is None
