import numpy as np
import pytest

from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.runtime.scene_graph.place_graph import Approach, Connection, RouteSegment
from placegraph.runtime.scene_graph.route import find_route, room_at

BUILDING = GraphNode(
    id="B0", parent="", tags=(), box=np.zeros((2, 3)), footprint=np.zeros((0, 2)), first_frame=0, last_frame=0
)


def square(node_id: str, parent: str, x: float, z: float = 0.0, **more: object) -> GraphNode:
    outline = np.array([[x, 0], [x + 4, 0], [x + 4, 4], [x, 4]], float)
    box = np.array([[x, 0, z], [x + 4, 4, z + 2.6]])
    fields: dict = {"tags": (), "box": box, "footprint": outline}
    return GraphNode(id=node_id, parent=parent, first_frame=0, last_frame=1, **(fields | more))


def passage(connection_id: str, kind: str, rooms: tuple[str, str], low: tuple, high: tuple, length: float = 0.0):
    ends = np.array([low, high], float)
    return Connection(id=connection_id, kind=kind, rooms=rooms, ends=ends, width_m=0.9, length_m=length)


def segment(room: str, ends: tuple[str, str], *points: tuple[float, float]) -> RouteSegment:
    line = np.array(points, float)
    return RouteSegment(
        room=room, ends=ends, length_m=float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()), points=line
    )


def approach(x: float, y: float, z: float = 0.0, **travel: float) -> Approach:
    return Approach((x, y, z), 0.0, tuple(sorted(travel.items())))


@pytest.fixture
def graph() -> SceneGraph:
    """R0 and R1 side by side with two doors, C0 the nearer one and C1; R2 above R1 by stairs; R3 above R0, closed."""
    nodes = [
        BUILDING,
        square("F0", "B0", 0), square("F1", "B0", 0, 3),
        square("R0", "F0", 0), square("R1", "F0", 4), square("R2", "F1", 4, 3), square("R3", "F1", 0, 3),
        square("O0", "R0", 0), square("O1", "R0", 0, approach=approach(1, 1, C0=3.2, C1=4.3, R0=1.5)),
        square("O2", "R2", 4, 3, approach=approach(7, 3, 3, C2=2.0, R2=1.0)),
        square("O3", "R0", 0, approach=approach(3, 1)), square("L0", "R1", 4),
    ]  # fmt: skip
    connections = [
        passage("C0", "door", ("R0", "R1"), (4, 1, 0), (4, 1, 0)),
        passage("C1", "door", ("R1", "R0"), (4, 3, 0), (4, 3, 0)),
        passage("C2", "stairs", ("R1", "R2"), (5, 3.5, 0), (7, 1, 3), 5.0),
    ]
    route_segments = [
        segment("R0", ("C0", "C1"), (4, 1), (4, 3)), segment("R0", ("C0", "R0"), (4, 1), (2, 2)),
        segment("R0", ("C1", "R0"), (4, 3), (3, 4), (2, 2)), segment("R1", ("C0", "R1"), (4, 1), (7, 1), (6, 2)),
        segment("R1", ("C1", "R1"), (4, 3), (6, 2)), segment("R1", ("C1", "C2"), (4, 3), (5, 3.5)),
        segment("R1", ("C0", "C2"), (4, 1), (8, 1), (8, 3.5), (5, 3.5)), segment("R2", ("C2", "R2"), (7, 1), (6, 2)),
    ]  # fmt: skip
    return SceneGraph.of(nodes, connections, route_segments)


def test_the_shorter_way_not_the_nearer_door(graph: SceneGraph) -> None:
    route = find_route(graph, "R0", "R2")
    assert route is not None and route.ids == ("R0", "C1", "R1", "C2", "R2")
    expected = np.hypot(1, 1) + np.hypot(1, 2) + np.hypot(1, 0.5) + 5.0 + np.hypot(1, 1)
    assert route.length_m == pytest.approx(expected) and not route.straight
    assert route.points.tolist() == [[2, 2, 0], [3, 4, 0], [4, 3, 0], [5, 3.5, 0], [7, 1, 3], [6, 2, 3]]


def test_there_and_back_are_equally_long(graph: SceneGraph) -> None:
    there, back = find_route(graph, "O1", "O2"), find_route(graph, "O2", "O1")
    assert there is not None and back is not None
    assert there.ids == back.ids[::-1] and there.length_m == pytest.approx(back.length_m)
    assert there.points.tolist() == back.points[::-1].tolist()
    assert there.points[0].tolist() == [1, 1, 0] and there.points[-1].tolist() == [7, 3, 3]


def test_inside_one_room(graph: SceneGraph) -> None:
    same = find_route(graph, "R0", "R0")
    assert same is not None and (same.ids, same.length_m, len(same.points)) == (("R0",), 0.0, 0)
    to_object = find_route(graph, "R0", "O1")
    assert to_object is not None and to_object.length_m == 1.5 and not to_object.straight
    between = find_route(graph, "O3", "O1")
    assert between is not None and between.length_m == 2.0 and between.straight
    location = find_route(graph, "R0", "L0")
    assert location is not None and location.ids[-1] == "R1"


@pytest.mark.parametrize(("start", "goal"), [("R0", "R3"), ("R3", "R0"), ("R0", "O0"), ("O0", "R1"), ("O3", "R1"),
                                             ("F0", "R1")])  # fmt: skip
def test_no_way(graph: SceneGraph, start: str, goal: str) -> None:
    assert find_route(graph, start, goal) is None


def test_from_a_point_the_first_leg_is_straight(graph: SceneGraph) -> None:
    route = find_route(graph, np.array([3.0, 3.0, 1.5]), "R1")
    assert route is not None and route.ids == ("R0", "C1", "R1") and route.straight
    assert route.length_m == pytest.approx(1 + np.hypot(2, 1)) and route.points[0].tolist() == [3, 3, 0]


@pytest.mark.parametrize(("xyz", "room"), [((1, 1, 1.4), "R0"), ((5, 1, 0), "R1"), ((5, 1, 4.4), "R2"),
                                           ((-3, 9, 1), "R0"), ((9, 1, -2), "R1"), ((1, 1, 50), "R3")])  # fmt: skip
def test_the_room_at_a_point(graph: SceneGraph, xyz: tuple, room: str) -> None:
    assert room_at(graph, np.array(xyz, float)) == room


def test_a_building_without_rooms() -> None:
    alone = SceneGraph.of([BUILDING])
    assert room_at(alone, np.zeros(3)) == "" and find_route(alone, np.zeros(3), "B0") is None
