from pathlib import Path

import numpy as np
import pytest

from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.runtime.scene_graph.place_graph import Connection, RouteSegment
from placegraph.tools.evaluate.connection_scores import connection_scores, match_connections, travel_lengths
from placegraph.tools.simulator.ground_truth import HouseRun, TrueConnection, Truth

MOVED = np.eye(4)
MOVED[:3, 3] = (1, 2, 0.5)


def node(node_id, parent):
    box = np.array([[0, 0, 0], [1, 1, 1]], float)
    return GraphNode(
        id=node_id, parent=parent, tags=(), box=box, footprint=np.zeros((0, 2)), first_frame=0, last_frame=0
    )


def door(i, x, rooms=("R0", "R1"), kind="door", width=0.8):
    ends = np.array([[x, 0.0, 0.0], [x, 0.0, 0.0 if kind != "stairs" else 3.0]])
    return Connection(id=f"C{i}", kind=kind, rooms=rooms, ends=ends, width_m=width, length_m=4.0 * (kind == "stairs"))


def true_door(i, x, rooms=(0, 1), kind="door", travel=()):
    top = 0.0 if kind != "stairs" else 3.0
    return TrueConnection(i, kind, rooms, np.array([[x + 1, 2.0, 0.5], [x + 1, 2.0, 0.5 + top]]), 0.9, travel)


def segment(room, one, other, length):
    return RouteSegment(room=room, ends=(one, other), length_m=length, points=np.zeros((2, 2)))


def graph_of(connections, route_segments=()):
    rooms = [node("R0", "F0"), node("R1", "F0"), node("R2", "F1")]
    return SceneGraph.of([node("B0", ""), node("F0", "B0"), node("F1", "B0"), *rooms], connections, route_segments)


def scores(connections, true, route_segments=(), seen=(0, 1, 2)):
    truth = Truth(HouseRun(0, None, 0, 1, 1, "", 1), (), (), (), (), (), tuple(true))
    return connection_scores(graph_of(connections, route_segments), MOVED, truth, frozenset(seen))


def test_nothing_found_and_nothing_true():
    empty = scores([], [])
    assert np.isnan(empty["doors"]["precision"]) and np.isnan(empty["stairs"]["recall"])
    assert empty["travel"]["pairs"] == 0 and np.isnan(empty["travel"]["mean_ratio"])
    missed = scores([], [true_door(0, 0)])
    assert missed["doors"]["recall"] == 0 and np.isnan(missed["doors"]["precision"])


def test_a_perfect_map_is_perfect():
    found = scores(
        [door(5, 0), door(6, 4), door(7, 8, ("R1", "R2"), "stairs")],
        [true_door(0, 0, travel=((1, 4.0),)), true_door(1, 4, kind="archway"), true_door(2, 8, kind="stairs")],
        [segment("R0", "C5", "C6", 4.4)],
    )
    for what, count in (("doors", 2), ("stairs", 1)):
        row = found[what]
        assert (row["truth"], row["of"], row["map"], row["precision"], row["recall"]) == (count, count, count, 1, 1)
        assert row["width_error_m"] == pytest.approx(0.1)
    assert found["travel"] == {"pairs": 1, **dict.fromkeys(("mean_ratio", "min_ratio", "max_ratio"), 1.1)}


def test_false_missed_unseen_and_doubled_doors():
    found = scores([door(0, 0), door(1, 0.2), door(2, 20)], [true_door(0, 0), true_door(1, 4), true_door(2, 9, (0, 7))])
    assert (found["doors"]["truth"], found["doors"]["of"], found["doors"]["map"]) == (2, 3, 3)
    assert (found["doors"]["precision"], found["doors"]["recall"]) == (pytest.approx(1 / 3), 0.5)


def test_a_door_is_no_stairs_and_both_ends_of_stairs_must_be_near():
    found = scores([door(0, 0)], [true_door(0, 0, kind="stairs")])
    assert found["doors"]["precision"] == 0 and found["stairs"]["recall"] == 0
    low = TrueConnection(0, "stairs", (0, 1), np.array([[1.0, 2, 0.5], [1, 4, 3.5]]), 0.9, ())
    assert scores([door(0, 0, ("R1", "R2"), "stairs")], [low])["stairs"]["recall"] == 0


def test_each_true_one_is_used_once_and_the_total_distance_decides():
    pairs = match_connections([door(0, 0.3), door(1, 0.6)], [true_door(0, 0), true_door(1, 0.4)], MOVED, 0.5)
    assert {i: one.id for i, one in pairs.items()} == {"C0": 0, "C1": 1}
    assert match_connections([door(0, 0.6)], [true_door(0, 0)], MOVED, 0.5) == {}


def test_travel_goes_through_any_room_of_the_floor_by_the_shortest_way():
    connections = [door(0, 0), door(1, 3), door(2, 6)]
    route_segments = [
        segment("R0", "C0", "C1", 9.0),
        segment("R1", "C0", "C1", 3.0),
        segment("R0", "C1", "C2", 3.5),
        segment("R1", "C1", "R1", 1.0),
    ]
    assert travel_lengths(graph_of(connections, route_segments)) == {
        ("C0", "C1"): 3.0,
        ("C0", "C2"): 6.5,
        ("C1", "C2"): 3.5,
    }
    assert travel_lengths(graph_of([])) == {}


def test_a_truth_without_connections_is_not_scored(cli, tmp_path: Path):
    """Houses made before doors were truth are still scored for all else."""
    from placegraph.tools.simulator.ground_truth import read_truth, truth_of, write_truth
    from placegraph.tools.simulator.house_frames import generate_house

    made = truth_of(generate_house(5, 1), HouseRun(5, 1, 4, 64, 48, "", 4), ())
    write_truth(made.__class__(**{**vars(made), "objects": (), "connections": None}), tmp_path)
    assert not (tmp_path / "truth" / "connections.json").exists() and read_truth(tmp_path).connections is None
