import logging

import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import Tag
from placegraph.runtime.scene_graph.object_list import parse_object_list, read_json_file

CHAIR = {"id": "a", "tags": ["chair"], "center": [1, 2, 0.5], "size": [0.5, 0.5, 1]}


def read(**changes):
    return parse_object_list({"objects": [CHAIR | changes]}, "x.json").objects[0]


def test_nothing_but_objects_is_needed() -> None:
    assert parse_object_list({"objects": []}, "x").objects == []
    chair = read()
    assert (chair.id, chair.tags, chair.center, chair.color) == ("a", (Tag("chair", 1.0),), [1, 2, 0.5], None)
    assert read(color=None, front=None, room=None).front is None


def test_names_are_strongest_first_or_weighted() -> None:
    assert read(tags=["chair", "seat", "stool"]).tags == (Tag("chair", 1.0), Tag("seat", 0.5), Tag("stool", 0.5))
    assert read(tags=[["seat", 2], ["chair", 3.5]]).tags == (Tag("chair", 3.5), Tag("seat", 2.0))
    assert read(tags=[]).all_tags == ()


def test_a_color_is_a_triple_or_a_word() -> None:
    assert read(color=[255, 0, 12.4]).color == (255, 0, 12) and read(color=[0, 1, 1]).color == (0, 1, 1)
    assert read(color="Grey").all_tags == (Tag("chair", 1.0), Tag("gray chair", 0.5))
    assert read(color="light blue", tags=[]).all_tags == (Tag("light blue object", 0.5),)


def test_a_front_is_a_direction_on_the_floor() -> None:
    assert read(front=[0, -2]).front == (0, -1) and read(front=[3, 4, 9]).front == (0.6, 0.8)


def test_ids_keep_their_type() -> None:
    listed = parse_object_list({"objects": [CHAIR | {"id": 1}, CHAIR | {"id": "1"}]}, "x")
    assert [one.id for one in listed.objects] == [1, "1"]


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"id": None}, "objects[0].id: expected an id"),
        ({"id": True}, "objects[0].id: expected an id"),
        ({"id": 1.0}, "objects[0].id: expected an id"),
        ({"id": " "}, "objects[0].id: expected an id"),
        ({"id": "\ud800"}, "objects[0].id: expected an id"),
        ({"tags": "chair"}, "objects[0].tags: expected a list of names"),
        ({"tags": [3]}, "objects[0].tags: expected a list of names"),
        ({"tags": [""]}, "objects[0].tags: expected a list of names"),
        ({"tags": [["chair", -1]]}, "objects[0].tags: expected weights"),
        ({"tags": [["chair", 1], "seat"]}, "objects[0].tags: expected a list of names"),
        ({"tags": [["chair", "seat"]]}, "objects[0].tags: expected weights"),
        ({"tags": ["x" * 201]}, "objects[0].tags: expected a list of names"),
        ({"center": [1, 2]}, "objects[0].center: expected 3 metres"),
        ({"center": [1, 2, float("nan")]}, "objects[0].center: expected 3 metres"),
        ({"center": [1, 2, float("inf")]}, "objects[0].center: expected 3 metres"),
        ({"center": [1, 2, 10**400]}, "objects[0].center: expected 3 metres"),
        ({"center": [1, 2, "3"]}, "objects[0].center: expected 3 metres"),
        ({"center": [1, 2, True]}, "objects[0].center: expected 3 metres"),
        ({"center": {"x": 1}}, "objects[0].center: expected 3 metres"),
        ({"size": [1, 1, -0.1]}, "objects[0].size: expected 3 metres, each from 0 to 1e+06, got [1, 1, -0.1]"),
        ({"size": None}, "objects[0].size: expected 3 metres"),
        ({"color": [1, 2]}, "objects[0].color: expected an sRGB triple or a colour word"),
        ({"color": [0, 0, 256]}, "objects[0].color: expected an sRGB triple"),
        ({"color": [0.5, 0.5, 1]}, "objects[0].color: expected sRGB from 0 to 255"),
        ({"color": ""}, "objects[0].color: expected an sRGB triple or a colour word"),
        ({"front": [0, 0]}, "objects[0].front: expected a direction"),
        ({"front": [0, 0, 1]}, "objects[0].front: expected a direction"),
        ({"front": 1.5}, "objects[0].front: expected a direction"),
        ({"room": 1.5}, "objects[0].room: expected an id"),
    ],
)
def test_a_broken_object_is_named(changes, problem) -> None:
    with pytest.raises(SchemaError) as raised:
        read(**changes)
    assert str(raised.value).startswith(f"x.json: {problem}")


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        ([], "x: Input should be"),
        ({}, "x: objects: Field required"),
        ({"objects": None}, "x: objects: Input should be a valid list"),
        ({"objects": [3]}, "x: objects[0]: Input should be"),
        ({"objects": [CHAIR, {"id": 1}]}, "x: objects[1].tags: Field required"),
        ({"objects": [CHAIR, CHAIR]}, "x: objects[1].id: 'a' is also the id of objects[0]"),
        ({"objects": [CHAIR | {"room": 3}], "rooms": []}, "x: objects[0].room: 3 is not the id of a room"),
        ({"objects": [], "rooms": [{"id": 1, "floor": 2}], "floors": []}, "x: rooms[0].floor: 2 is not the id of a f"),
        ({"objects": [], "rooms": [{"id": 1, "size": [1, 1, 1]}]}, "x: rooms[0]: expected center and size, or nei"),
        ({"objects": [], "rooms": [{"id": 1, "center": []}]}, "x: rooms[0].center: expected 3 metres"),
        ({"objects": [], "rooms": [{"id": 1, "outline": [[0, 0]]}]}, "x: rooms[0].outline: expected 3 or more"),
        ({"objects": [], "rooms": [{"id": 1, "outline": [[0, 0], [1, 0], [1]]}]}, "x: rooms[0].outline: expected cor"),
        ({"objects": [], "rooms": [{"id": 1, "name": 3}]}, "x: rooms[0].name: expected a name"),
        ({"objects": [], "floors": [{"id": 1, "bottom": 1, "top": 0}]}, "x: floors[0]: expected a top that is not"),
        ({"objects": [], "floors": [{"id": 1, "bottom": "0"}]}, "x: floors[0].bottom: expected metres"),
    ],
)
def test_a_broken_list_is_named(data, problem) -> None:
    with pytest.raises(SchemaError) as raised:
        parse_object_list(data, "x")
    assert str(raised.value).startswith(problem)


def test_fields_that_are_not_read_are_told(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        parse_object_list({"objects": [CHAIR | {"colour": "red"}], "scan": "scene0000_00"}, "x.json")
    assert caplog.messages == ["x.json: fields that are not read: objects.colour, scan"]


def test_a_file_that_is_no_json_is_named(tmp_path) -> None:
    file = tmp_path / "x.json"
    file.write_bytes('﻿{"objects": []}'.encode())
    assert read_json_file(file) == {"objects": []}
    for content in (b"", b"\xff", b"[" * 100_000, b"1" * 5000):
        file.write_bytes(content)
        with pytest.raises(SchemaError, match=r"x\.json: cannot read"):
            read_json_file(file)
    with pytest.raises(SchemaError, match="absent"):
        read_json_file(tmp_path / "absent")
