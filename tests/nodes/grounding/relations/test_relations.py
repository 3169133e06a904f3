import dataclasses

import numpy as np
import pytest

from placegraph.nodes.grounding.box_arrays import layout_of
from placegraph.nodes.grounding.program import CONDITIONS
from placegraph.nodes.grounding.relations import HOLDS, RelationQuery, relations_by_name, trigger_phrases
from placegraph.nodes.grounding.viewpoint import ViewpointSelector
from placegraph.runtime.scene_graph import GraphNode, SceneGraph

SOUTH = np.array([0.0, -5.0, 1.5])  # looking north: left is -x
NOBODY = np.full(3, np.nan)
ROOM = [[-5.0, -8, -1], [5, 3, 5]]


def places_of(room):
    return [
        GraphNode(
            id=i,
            parent=p,
            tags=(),
            box=np.array(room, float),
            footprint=np.zeros((0, 2)),
            first_frame=-1,
            last_frame=-1,
        )
        for i, p in (("B0", ""), ("F0", "B0"), ("R0", "F0"))
    ]


def boxes_of(nodes, room=ROOM):
    return layout_of(SceneGraph.of([*places_of(room), *nodes]))


def evaluate(relation, targets, anchors=None, viewpoint=SOUTH, room=ROOM, second_anchors=None):
    """Fits of all targets and anchors."""
    listed = {node.id: node for node in (*targets, *(anchors or ()), *(second_anchors or ()))}
    layout = boxes_of(listed.values(), room)

    def take(nodes):
        return None if nodes is None else layout.all.take([layout.row[node.id] for node in nodes])

    viewpoints = ViewpointSelector(layout, viewpoint)
    query = RelationQuery(relation, take(targets), take(anchors), layout, viewpoints, take(second_anchors))
    return relations_by_name()[relation].evaluate(query)


def fit(relation, target, anchor, **kwargs):
    fits = evaluate(relation, [target], [anchor], **kwargs)
    assert fits.values.shape == (1, 1)
    assert 0 <= fits.values[0, 0] <= 1
    assert "O0" in fits.sentence(0, 0)
    assert any(mark.isdigit() for mark in fits.sentence(0, 0))
    return float(fits.values[0, 0])


@pytest.fixture
def cube(thing_of):
    return lambda number, center, size=(0.4, 0.4, 0.4): thing_of(number, "R0", "cube", center, size)


def test_every_relation_and_rank_of_the_schema_has_a_judge():
    spatial = {name for name, form in CONDITIONS.items() if form.kind in ("relation", "rank")}
    assert spatial == set(relations_by_name())


def test_every_relation_survives_nothing(cube):
    for relation in sorted(relations_by_name()):
        anchors = None if CONDITIONS[relation].things[1] == 0 else []
        second_anchors = [] if relation == "between" else None
        assert evaluate(relation, [], anchors, second_anchors=second_anchors).values.size == 0, relation
        if CONDITIONS[relation].things[1]:
            assert evaluate(relation, [cube(0, (0, 0, 0))], [], second_anchors=second_anchors).values.shape == (1, 0), (
                relation
            )


def test_phrases_belong_to_one_relation():
    phrases = [phrase for family in set(map(id, relations_by_name().values())) for phrase in _phrases(family)]
    assert len(phrases) == len(set(phrases))
    assert len(trigger_phrases()) == len(phrases)


def _phrases(family_id):
    family = next(family for family in relations_by_name().values() if id(family) == family_id)
    return [phrase for several in family.phrases.values() for phrase in several]


@pytest.mark.parametrize(
    ("relation", "offset", "holds"),
    [
        ("left", (-1, 0, 0), True), ("left", (1, 0, 0), False), ("left", (-0.05, 0, 0), False),
        ("left", (-0.2, 2, 0), False), ("right", (1, 0, 0), True), ("right", (-1, 0, 0), False),
        ("behind", (0, 1, 0), True), ("behind", (0, -1, 0), False), ("behind", (1, 0.05, 0), False),
        ("front", (0, -1, 0), True), ("front", (0, 1, 0), False),
        ("across", (0, -3, 0), True), ("across", (0, 3, 0), False), ("across", (0, -0.5, 0), False),
        ("above", (0, 0, 1), True), ("above", (0, 0, 0.02), True), ("above", (2, 0, 1), False),
        ("under", (0, 0, -1), True), ("under", (0, 0, 1), False),
        ("near", (1, 0, 0), True), ("near", (3, 0, 0), False),
        ("against", (0.45, 0, 0), True), ("against", (1, 0, 0), False),
        ("on", (0, 0, 0.4), True), ("on", (0, 0, 0.7), False), ("on", (0.35, 0, 0.4), False),
        ("on", (0, 0, -0.4), False),
        ("under", (0, 0, -0.4), True), ("under", (0, 0, 0.4), False), ("under", (2, 0, -0.4), False),
        ("in", (0, 0, 0), True), ("in", (0.4, 0, 0), False), ("in", (0, 0, 0.4), True),
        ("holds", (0, 0, -0.4), True), ("holds", (0, 0, 0.4), False), ("with", (0, 0, -0.4), True),
        ("with", (0.42, 0, 0), True), ("with", (2, 0, 0), False),
        ("corner", (0.2, 0.2, 0), True), ("corner", (1.5, 0, 0), False),
        ("center", (0, 0, 0), True), ("center", (1, 0, 0), False),
        ("end", (0.4, 0, 0), True), ("end", (3, 0, 0), False), ("along", (2, 0, 0), True), ("along", (0, -6, 0), False),
    ],
)  # fmt: skip
def test_one_target_and_one_anchor(cube, relation, offset, holds):
    assert (fit(relation, cube(0, offset), cube(1, (0, 0, 0))) >= HOLDS) == holds


def test_the_same_boxes_have_no_direction(cube):
    for relation in ("left", "right", "behind", "front", "across"):
        assert fit(relation, cube(0, (0, 0, 0)), cube(1, (0, 0, 0))) < HOLDS, relation


def test_what_lies_deep_in_a_box_is_under_its_top_and_not_on_it(cube, thing_of):
    desk = thing_of(1, "R0", "office desk", (0, 0, 0.4), (1.6, 0.8, 0.8))
    cases = ((0, 0, 0.2), False, True), ((0, 0, 0.9), True, False), ((1.2, 0, 0.2), False, False)
    for center, on, under in cases:
        one = cube(0, center, (0.3, 0.3, 0.3))
        assert (fit("on", one, desk) >= HOLDS, fit("under", one, desk) >= HOLDS) == (on, under), center


def test_an_anchor_at_the_viewpoint_has_no_left(cube):
    fits = evaluate("left", [cube(0, (1, 0, 0))], [cube(1, (0, 0, 0))], viewpoint=np.zeros(3))
    assert "has no sides" in fits.sentence(0, 0)


def test_without_a_viewer_in_front_is_near_and_a_side_decides_less(cube):
    sofa = cube(1, (0, 3.5, 0))
    before, behind = cube(0, (0, 2.5, 0)), cube(2, (0, 4.5, 0))
    fits = evaluate("front", [before, behind], [sofa], viewpoint=NOBODY)
    assert fits.values[0, 0] > fits.values[1, 0] >= 0.3  # the room's middle is before it
    assert evaluate("left", [before], [sofa], viewpoint=NOBODY).trust < 1 == evaluate("left", [before], [sofa]).trust


def test_between(cube):
    targets = [cube(0, (0, 0.3, 0)), cube(3, (0, 3, 0)), cube(4, (4, 0, 0))]
    fits = evaluate("between", targets, [cube(1, (-2, 0, 0))], second_anchors=[cube(2, (2, 0, 0))])
    assert (fits.values[:, 0] >= HOLDS).tolist() == [True, False, False]
    assert "from cube O1 to cube O2" in fits.sentence(0, 0)


@pytest.mark.parametrize(
    ("relation", "first"),
    [("leftmost", 0), ("rightmost", 2), ("largest", 2), ("smallest", 0), ("tallest", 2), ("shortest", 0),
     ("longest", 2), ("highest", 2), ("lowest", 0), ("frontmost", 1), ("backmost", 2), ("closest", 1), ("farthest", 2)],
)  # fmt: skip
def test_ranks(cube, relation, first):
    row = [cube(i, (i, (i == 1) * -0.5 + 0.1 * i, i / 10), (0.1 + i / 10,) * 3) for i in range(3)]
    assert evaluate(relation, row).values[:, 0].argmax() == first


def test_closest_is_by_surfaces_and_a_wall_between_makes_far(cube, thing_of):
    long, small = cube(0, (3, 0, 0), (5, 0.4, 0.4)), cube(1, (0, 1.2, 0))
    assert evaluate("closest", [long, small], [cube(9, (0, 0, 0))]).values.argmax() == 0
    room = GraphNode(
        id="R1", parent="F0", tags=(), box=np.array([[0, 0, 3], [4, 4, 6.0]]), footprint=np.zeros((0, 2)),
        first_frame=-1, last_frame=-1,
    )  # fmt: skip
    above, beside = thing_of(1, "R1", "cube", (1, 1, 3.3), (0.4,) * 3), cube(2, (3, 1, 2.5))
    layout = layout_of(SceneGraph.of([*places_of([[0, 0, 0], [4, 4, 3.0]]), room, cube(0, (1, 1, 2.5)), above, beside]))
    query = RelationQuery(
        "closest", layout.all.take([1, 2]), layout.all.take([0]), layout, ViewpointSelector(layout, NOBODY)
    )
    assert relations_by_name()["closest"].evaluate(query).values.argmax() == 1


def test_in_the_room(cube):
    room = [[0, 0, 0], [4, 4, 2.5]]
    nodes = [cube(0, (0.3, 0.3, 0.2)), cube(1, (2, 2, 0.2)), cube(2, (2, 0.3, 0.2))]
    for relation, expected in (("corner", [True, False, False]), ("center", [False, True, False])):
        assert (evaluate(relation, nodes, room=room).values[:, 0] >= HOLDS).tolist() == expected


def test_what_faces_is_known_of_things_with_a_front_only(cube):
    chair, desk = dataclasses.replace(cube(0, (0, 0, 0)), front=(1.0, 0.0)), cube(1, (1, 0, 0))
    assert fit("facing", chair, desk) >= HOLDS > fit("facing", dataclasses.replace(chair, front=(-1.0, 0.0)), desk)
    assert not evaluate("facing", [cube(0, (0, 0, 0))], [desk]).known


@pytest.mark.parametrize(
    ("height", "words"),
    [(0.4, "level with the top"), (0.45, "0.05 m above the top"), (0.3, "0.10 m below the top")],
)
def test_what_lies_on_something_is_told_from_its_top(cube, height, words):
    fits = evaluate("on", [cube(1, (0, 0, height))], [cube(0, (0, 0, 0))])
    assert fits.sentence(0, 0).startswith(f"the bottom of cube O1 is {words} of cube O0")


def test_what_stands_before_the_end_of_a_wide_thing_is_before_it_and_not_beside(cube):
    sofa, before, beside = cube(1, (0, 0, 0), (2.4, 0.8, 0.8)), cube(0, (-1.0, -0.8, 0)), cube(2, (-2.0, -0.1, 0))
    left, front = (evaluate(name, [before, beside], [sofa]).values[:, 0] for name in ("left", "front"))
    assert (left.argmax(), front.argmax()) == (1, 0)
