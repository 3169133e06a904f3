import dataclasses

import numpy as np
import pytest

from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.runtime.vision import area_overlap
from placegraph.tools.evaluate.aligned_map import EMPTY_MAP, AlignedMap, MapPlace
from placegraph.tools.evaluate.place_name_scores import name_scores, place_name_scores
from placegraph.tools.evaluate.place_overlap import CELL_M
from placegraph.tools.simulator.ground_truth import FrameCounts, HouseRun, truth_of
from placegraph.tools.simulator.house_frames import generate_house


def overlaps(found, true):
    return area_overlap.overlaps(found, true, CELL_M)


def square(x, side=1.0):
    return 0, np.array([[x, 0], [x + side, 0], [x + side, side], [x, side]])


def test_nothing_is_judged_without_places():
    for found, true in (([], []), ([square(0)], []), ([], [square(0)])):
        scores = name_scores([["kitchen"]] * len(found), overlaps(found, true), ["kitchen"] * len(true))
        assert (scores["map"], scores["judged"]) == (len(found), 0)
        assert np.isnan([scores["top_1"], scores["top_3"]]).all()


def test_names_are_judged_by_the_place_that_holds_most_of_each():
    true = [square(0), square(1), square(2)]
    found = [square(0.2), square(1.2), square(2.0), square(2.6), square(0.0)]  # the fourth lies mostly outside
    names = [["kitchen", "office"], ["office", "kitchen", "hallway", "bathroom"], ["lounge"], ["bedroom"], []]
    scores = name_scores(names, overlaps(found, true), ["kitchen", "bathroom", "living room"])
    assert scores == {"map": 5, "judged": 4, "top_1": pytest.approx(2 / 4), "top_3": pytest.approx(2 / 4)}


def test_words_for_the_same_place_are_as_good():
    for name, kind in (("hallway", "corridor"), ("laundry room", "laundry"), ("sitting area", "seating area")):
        assert name_scores([["garage", name]], overlaps([square(0)], [square(0)]), [kind])["top_3"] == 1


@pytest.fixture(scope="module")
def house():
    built = generate_house(3, 2)
    run = HouseRun(3, 2, 0, 64, 48, "", 0)
    return truth_of(built, run, tuple(FrameCounts(item.id, 0, 0) for item in built.items))


def test_a_map_like_the_house_has_all_names(house):
    def node(id, parent, name, outline, floor):
        box = np.array([[*outline.min(axis=0), floor.z_m], [*outline.max(axis=0), floor.z_m + 1]])
        tags = (Tag(name, 1.0),) if name else ()
        return GraphNode(id=id, parent=parent, tags=tags, box=box, footprint=outline, first_frame=0, last_frame=0)

    floors, rooms = house.floors, house.rooms
    everything = np.concatenate([floor.outline for floor in floors])
    nodes = [
        node("B0", "", "", everything, floors[0]),
        *(node(f"F{one.index}", "B0", "", one.outline, one) for one in floors),
        *(node(f"R{one.id}", f"F{one.floor}", one.type, one.polygon, floors[one.floor]) for one in rooms),
        *(node(f"L{one.id}", f"R{one.room}", one.kind, one.outline, floors[0]) for one in house.locations),
    ]
    floor_of = {room.id: room.floor for room in rooms}
    aligned_map = AlignedMap(
        np.array([[one.z_m, one.z_m + one.height_m] for one in floors]),
        tuple(MapPlace(f"R{one.id}", one.floor, one.polygon) for one in rooms),
        tuple(MapPlace(f"L{one.id}", floor_of[one.room], one.outline) for one in house.locations),
        (),
    )
    scores = place_name_scores(SceneGraph.of(nodes), aligned_map, house)
    assert scores["rooms"] == {"map": len(rooms), "judged": len(rooms), "top_1": 1, "top_3": 1}
    assert scores["locations"]["judged"] == len(house.locations) > 0
    assert scores["locations"]["top_1"] > 0.9  # outlines of two groups may overlap
    wrong = [dataclasses.replace(one, tags=()) if one.id == "R0" else one for one in nodes]
    assert place_name_scores(SceneGraph.of(wrong), aligned_map, house)["rooms"]["top_1"] == 1 - 1 / len(rooms)
    assert place_name_scores(SceneGraph.of(nodes), EMPTY_MAP, house)["rooms"]["judged"] == 0
