"""The truth of a simulated house as GroundTruth, and a map's scores against it.

Of all that is true, only what the walk saw counts for recall.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SourceError
from placegraph.tools.evaluate.aligned_map import align_folder
from placegraph.tools.evaluate.connection_scores import connection_scores
from placegraph.tools.evaluate.ground_truth import (
    ClassVocabulary,
    GroundTruth,
    GroundTruthFloor,
    GroundTruthObject,
    GroundTruthPlace,
    Visibility,
)
from placegraph.tools.evaluate.grounding_scores import ask_all, grounding_scores, read_questions
from placegraph.tools.evaluate.layer_scores import map_scores
from placegraph.tools.evaluate.place_name_scores import place_name_scores
from placegraph.tools.evaluate.trajectory_error import level_alignment, paired, positions_of
from placegraph.tools.map_files.map_folder import TRAJECTORY, read_graph
from placegraph.tools.map_files.trajectory_file import read_trajectory
from placegraph.tools.simulator.ground_truth import FrameCounts, TrueLocation, Truth, read_truth
from placegraph.tools.simulator.object_classes import CLASSES
from placegraph.tools.simulator.occupancy_grid import points_in_polygon

MIN_FRAMES = 5  # an object was seen well when it was clear in so many frames; chosen by hand
MIN_SHARE = 0.5  # of a location's members that the walk must have seen well; chosen by hand
MIN_HEIGHT_M = 1.0  # of a camera over its floor: on the stairs it rises above a storey before the feet do
HOUSE_VOCABULARY = ClassVocabulary({cls.name: (*cls.training_words[1:], *cls.held_out_words) for cls in CLASSES})


def house_scores(folder: Path, source: Path, given: Mapping[int, F64] | None, questions: bool) -> dict[str, Any]:
    """Scores of a map folder against SOURCE/truth; `given` are the source's poses (4, 4) by stamp_ns.

    Raises SourceError when `questions` are to be asked and the house has none, SchemaError for a damaged map.
    """
    truth = read_truth(source)
    estimated, true = paired(positions_of(read_trajectory(folder / TRAJECTORY)), given)
    true_from_map, graph = level_alignment(estimated, true), read_graph(folder)
    aligned_map = align_folder(folder, graph, true_from_map)
    ground_truth = house_ground_truth(truth, truth.seen, true)
    scores = map_scores(aligned_map, ground_truth)
    scores["place_names"] = place_name_scores(graph, aligned_map, truth)
    if truth.connections is not None:
        rooms = zip(truth.rooms, ground_truth.rooms or (), strict=True)
        seen_rooms = frozenset(true_room.id for true_room, room in rooms if room.seen)
        scores["connections"] = connection_scores(graph, true_from_map, truth, seen_rooms)
    if questions:
        asked = read_questions(source)
        if not asked:
            raise SourceError(f"{source}: no questions in truth/questions.json")
        results = ask_all(folder, asked, true_from_map)
        scores["questions"] = grounding_scores(asked, results, {thing.id: thing.box for thing in aligned_map.objects})
    return scores


def house_ground_truth(
    truth: Truth, seen: Sequence[FrameCounts], positions: F64, trajectory: Mapping[int, F64] | None = None
) -> GroundTruth:
    """The truth of a house after a walk through camera positions (N, 3) that saw the objects as `seen`, by id.

    A floor was seen when the walk was on it; a room when the walk entered it or saw an object of it well; a location
    when it saw MIN_SHARE of the members well.
    """
    visibilities = [visibility_of(counts) for counts in seen]
    objects = tuple(
        GroundTruthObject(item.class_name, item.box, visibility)
        for item, visibility in zip(truth.objects, visibilities, strict=True)
    )
    looked_into = {
        item.room for item, visibility in zip(truth.objects, visibilities, strict=True) if visibility == "well"
    }

    def entered(outline: F64, floor: int) -> bool:
        height = positions[:, 2] - truth.floors[floor].z_m
        on_floor = positions[(height > MIN_HEIGHT_M) & (height < truth.floors[floor].height_m)]
        return bool(points_in_polygon(outline, on_floor[:, :2]).any())

    floor_of_room = {room.id: room.floor for room in truth.rooms}
    return GroundTruth(
        floors=tuple(
            GroundTruthFloor(floor.z_m, floor.z_m + floor.height_m, entered(floor.outline, floor.index))
            for floor in truth.floors
        ),
        rooms=tuple(
            GroundTruthPlace(room.floor, room.polygon, room.id in looked_into or entered(room.polygon, room.floor))
            for room in truth.rooms
        ),
        locations=tuple(
            GroundTruthPlace(floor_of_room[place.room], place.outline, _location_seen(place, visibilities))
            for place in truth.locations
        ),
        objects=objects,
        vocabulary=HOUSE_VOCABULARY,
        trajectory=trajectory,
    )


def visibility_of(seen: FrameCounts) -> Visibility:
    """How well the walk saw an object."""
    if seen.clear_frames >= MIN_FRAMES:
        return "well"
    return "poorly" if seen.frames else "never"


def _location_seen(place: TrueLocation, visibilities: Sequence[Visibility]) -> bool:
    well = sum(visibilities[member] == "well" for member in place.members)
    return well > 0 and well >= MIN_SHARE * len(place.members)
