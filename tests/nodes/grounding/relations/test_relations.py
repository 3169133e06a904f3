import numpy as np
import pytest

from placegraph.nodes.grounding.relations import Case, Viewpoint, families, triggers

SOUTH = np.array([0.0, -5.0, 1.5])  # looking north: left is -x


def judge(relation, targets, anchors=(), view=SOUTH, ordinal=1, room=None):
    nodes = [*targets, *(node for group in anchors for node in group)]
    case = Case(
        relation=relation, targets=targets, anchors=anchors,
        viewpoints={node.id: Viewpoint("asker", view) for node in nodes},
        room_boxes={} if room is None else {node.id: room for node in nodes}, ordinal=ordinal,
    )  # fmt: skip
    return families()[relation].judge(case)


@pytest.fixture
def cube(thing_of):
    return lambda number, center, size=(0.4, 0.4, 0.4): thing_of(number, "R0", "cube", center, size)


def test_every_relation_survives_no_targets_but_order():
    for relation in sorted(families()):
        if relation not in ("leftmost", "rightmost"):
            assert judge(relation, []) == []


def test_phrases_belong_to_one_relation():
    phrases = [phrase for family in set(map(id, families().values())) for phrase in _phrases(family)]
    assert len(phrases) == len(set(phrases))
    assert len(triggers()) == len(phrases)


def _phrases(family_id):
    family = next(family for family in families().values() if id(family) == family_id)
    return [phrase for several in family.phrases.values() for phrase in several]


def test_a_thing_has_no_relation_to_itself(cube):
    one = cube(0, (0, 0, 0))
    (verdict,) = judge("near", [one], [(one,)])
    assert not verdict.holds


@pytest.mark.parametrize(
    ("relation", "offset", "holds"),
    [
        ("left of", (-1, 0, 0), True), ("left of", (1, 0, 0), False), ("left of", (-0.05, 0, 0), False),
        ("left of", (-0.2, 2, 0), False), ("right of", (1, 0, 0), True), ("right of", (-1, 0, 0), False),
        ("behind", (0, 1, 0), True), ("behind", (0, -1, 0), False), ("behind", (1, 0.05, 0), False),
        ("in front of", (0, -1, 0), True), ("in front of", (0, 1, 0), False),
        ("opposite", (0, -3, 0), True), ("opposite", (0, 3, 0), False), ("opposite", (0, -0.5, 0), False),
        ("above", (0, 0, 1), True), ("above", (0, 0, 0.02), False), ("above", (2, 0, 1), False),
        ("below", (0, 0, -1), True), ("below", (0, 0, 1), False),
        ("near", (1, 0, 0), True), ("near", (3, 0, 0), False),
        ("on", (0, 0, 0.4), True), ("on", (0, 0, 0.7), False), ("on", (0.35, 0, 0.4), False),
        ("on", (0, 0, -0.4), False),
        ("under", (0, 0, -0.4), True), ("under", (0, 0, 0.4), False), ("under", (2, 0, -0.4), False),
        ("inside", (0, 0, 0), True), ("inside", (0.4, 0, 0), False), ("inside", (0, 0, 0.4), True),
    ],
)  # fmt: skip
def test_one_target_and_one_anchor(cube, relation, offset, holds):
    (verdict,) = judge(relation, [cube(0, offset)], [(cube(1, (0, 0, 0)),)])
    assert verdict.holds is bool(verdict.holds)
    assert verdict.holds == holds
    assert 0 <= verdict.score <= 1
    assert "O0" in verdict.sentence
    assert any(mark.isdigit() for mark in verdict.sentence)


def test_the_same_boxes_have_no_direction(cube):
    for relation in ("left of", "right of", "behind", "in front of", "opposite", "above", "below", "under"):
        (verdict,) = judge(relation, [cube(0, (0, 0, 0))], [(cube(1, (0, 0, 0)),)])
        assert not verdict.holds, relation


def test_an_anchor_at_the_viewpoint_has_no_left(cube):
    (verdict,) = judge("left of", [cube(0, (1, 0, 0))], [(cube(1, (0, 0, 0)),)], view=np.zeros(3))
    assert not verdict.holds
    assert "no left or right" in verdict.sentence


def test_between(cube):
    ends = (cube(1, (-2, 0, 0)), cube(2, (2, 0, 0)))
    middle, beside, beyond = judge("between", [cube(0, (0, 0.3, 0)), cube(3, (0, 3, 0)), cube(4, (4, 0, 0))], [ends])
    assert (middle.holds, beside.holds, beyond.holds) == (True, False, False)
    assert middle.anchor_ids == ("O1", "O2")


def test_ranks_take_the_nth_and_say_its_place(cube):
    row = [cube(i, (i, 0, 0), (0.1 + i / 10,) * 3) for i in range(3)]

    def winners(relation, **kwargs):
        return [v.holds for v in judge(relation, row, **kwargs)]

    assert winners("leftmost") == [True, False, False]
    assert winners("rightmost") == [False, False, True]
    assert winners("leftmost", ordinal=2) == [False, True, False]
    assert winners("largest") == [False, False, True]
    assert winners("smallest") == [True, False, False]
    assert winners("tallest", ordinal=4) == [False, False, False]
    assert winners("closest", anchors=[(cube(9, (2.2, 0, 0)),)]) == [False, False, True]
    assert winners("farthest", anchors=[(cube(9, (2.2, 0, 0)),)]) == [True, False, False]
    assert "number 1 of 3" in judge("largest", row)[2].sentence


def test_equal_sizes_are_equally_large(cube):
    assert [v.holds for v in judge("largest", [cube(0, (0, 0, 0)), cube(1, (1, 0, 0))])] == [True, True]


def test_closest_without_an_anchor_is_to_the_viewpoint(cube):
    assert [v.holds for v in judge("closest", [cube(0, (0, 0, 0)), cube(1, (0, -3, 0))])] == [False, True]


def test_a_wall_between_makes_far(cube):
    room, other = np.array([[0, 0, 0], [4, 4, 3.0]]), np.array([[0, 0, 3], [4, 4, 6.0]])
    anchor, above, beside = cube(0, (1, 1, 2.5)), cube(1, (1, 1, 3.3)), cube(2, (3, 1, 2.5))
    case = Case(
        relation="closest", targets=[above, beside], anchors=[(anchor,)],
        viewpoints={}, room_boxes={"O0": room, "O1": other, "O2": room},
    )  # fmt: skip
    assert [v.holds for v in families()["closest"].judge(case)] == [False, True]


def test_in_the_room(cube):
    room = np.array([[0, 0, 0], [4, 4, 2.5]])
    nodes = [cube(0, (0.3, 0.3, 0.2)), cube(1, (2, 2, 0.2)), cube(2, (2, 0.3, 0.2))]
    assert [v.holds for v in judge("in the corner", nodes, room=room)] == [True, False, False]
    assert [v.holds for v in judge("in the middle", nodes, room=room)] == [False, True, False]
    assert [v.holds for v in judge("against the wall", nodes, room=room)] == [True, False, True]
    assert [v.holds for v in judge("in the corner", nodes)] == [False] * 3


@pytest.mark.parametrize(
    ("height", "words"),
    [(0.4, "level with the top"), (0.45, "0.05 m above the top"), (0.3, "0.10 m below the top")],
)
def test_what_lies_on_something_is_told_from_its_top(cube, height, words):
    (verdict,) = judge("on", [cube(1, (0, 0, height))], [(cube(0, (0, 0, 0)),)])
    assert verdict.sentence.startswith(f"the bottom of cube O1 is {words} of cube O0")
