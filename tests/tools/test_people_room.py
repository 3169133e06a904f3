"""A bedroom as an object list, asked as people ask: read by the packaged model, answered by code, without images."""

import json

import pytest

from placegraph.runtime.query.request import make_question
from placegraph.tools.query.offline_query import OfflineQuery

ROOM = (  # name, centre, size in metres
    ("bed", (1, 1, 0.3), (1.6, 2, 0.6)),
    ("bed", (4, 1, 0.3), (1.6, 2, 0.6)),
    ("pillow", (0.7, 1.8, 0.65), (0.5, 0.3, 0.1)),
    ("pillow", (1.3, 1.8, 0.65), (0.5, 0.3, 0.1)),
    ("pillow", (4.0, 1.8, 0.65), (0.6, 0.3, 0.1)),
    ("nightstand", (2.5, 1.8, 0.3), (0.4, 0.4, 0.6)),
    ("lamp", (2.5, 1.8, 0.8), (0.2, 0.2, 0.4)),
    ("trash can", (5.5, 0.3, 0.2), (0.3, 0.3, 0.4)),
    ("trash can", (3.0, -2.7, 0.2), (0.3, 0.3, 0.5)),
    ("desk", (3.5, -2.5, 0.4), (1.4, 0.7, 0.75)),
    ("office chair", (3.5, -1.9, 0.5), (0.6, 0.6, 1.0)),
    ("chair", (0.5, -2.5, 0.5), (0.5, 0.5, 0.9)),
    ("monitor", (3.5, -2.6, 1.0), (0.6, 0.1, 0.4)),
    ("door", (0, -1.5, 1), (0.1, 0.9, 2)),
    ("shelf", (5.7, -2.5, 1.0), (0.4, 1, 2)),
    ("backpack", (4.0, 0.5, 0.1), (0.4, 0.3, 0.2)),
)


@pytest.fixture(scope="module")
def ask(tmp_path_factory):
    file = tmp_path_factory.mktemp("room") / "room.json"
    objects = [{"id": i, "tags": [name], "center": at, "size": size} for i, (name, at, size) in enumerate(ROOM)]
    file.write_text(json.dumps({"objects": objects}))
    with OfflineQuery() as answerer:
        yield lambda text: answerer.ask(file, make_question(text))


@pytest.mark.parametrize(
    ("text", "right"),
    [
        ("Facing beds, it's the pillow on the right-hand bed.", 4),
        ("Standing at the foot of the bed, the left pillow closest to the door.", 2),
        ("the garbage can next to the desk", 8),
        ("The trash can farther from the door", 7),
        ("the pillow directly to the left of the lamp", 3),
        ("The chair tucked under the desk.", 10),
        ("The chair in the corner that is NOT in front of the monitor", 11),
        ("its the orange duffel bag underneath the bed", 15),
        ("It's the bookcase in the corner", 14),
        ("As you walk in the door, the trash can on the left", 7),
        ("the bed with two pillows on it", 0),
        ("the end table between the two beds", 5),
        ("the pillow by itself on the bed", 4),
        ("computer screen", 12),
    ],
)
def test_what_a_person_would_point_at(ask, text, right) -> None:
    answer = ask(text)
    assert answer["object_id"] == right, (answer["parse"]["text"], answer["evidence"])
    assert answer["llm_calls"] == 1 and answer["parse"]["reader"] == "model"
