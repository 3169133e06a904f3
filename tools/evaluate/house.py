"""A map of a procedural house against the house's truth; of all that is true, what the walk showed is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SourceError
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.aligned_map import read_aligned
from placegraph.tools.evaluate.connections import connection_scores
from placegraph.tools.evaluate.ground_truth import Known, KnownFloor, KnownObject, KnownPlace, Sight, Words
from placegraph.tools.evaluate.grounding import ask_all, grounding_scores, read_questions
from placegraph.tools.evaluate.place_names import place_name_scores
from placegraph.tools.evaluate.scores import map_scores
from placegraph.tools.evaluate.trajectory import level_alignment, paired
from placegraph.tools.map_folder import TRAJECTORY, find_graph, read_trajectory
from placegraph.tools.simulator.ground_truth import FrameCounts, TrueLocation, TrueRoom, Truth, read_truth
from placegraph.tools.simulator.object_classes import CLASSES
from placegraph.tools.simulator.occupancy_grid import points_in_polygon

MIN_FRAMES = 5  # seen well: clear in so many frames
MIN_SHARE = 0.5  # of a location's members must have been seen well
MIN_HEIGHT_M = 1.0  # of a camera over the floor it is on: on the stairs it rises above a storey before the feet do
HOUSE_WORDS = Words({one.name: (*one.training_words[1:], *one.held_out_words) for one in CLASSES})


def house_scores(folder: Path, source: Path, given: Mapping[int, F64] | None, questions: bool) -> dict[str, Any]:
    """Scores of a map folder against SOURCE/truth; `given` are the source's poses (4, 4) by stamp_ns.

    Raises SourceError when the questions are asked for and there are none, SchemaError for a damaged map.
    """
    truth = read_truth(source)
    estimated, true = paired(read_trajectory(folder / TRAJECTORY), given)
    true_from_map = level_alignment(estimated, true)
    aligned = read_aligned(folder, true_from_map)
    known = known_of(truth, truth.seen, true)
    found = map_scores(aligned, known)
    graph = SceneGraph.load(find_graph(folder))
    found["place_names"] = place_name_scores(graph, aligned, truth)
    if truth.connections is not None:
        rooms = zip(truth.rooms, known.rooms or (), strict=True)
        seen = frozenset(one.id for one, shown in rooms if shown.seen)
        found["connections"] = connection_scores(graph, true_from_map, truth, seen)
    if questions:
        asked = read_questions(source)
        if not asked:
            raise SourceError(f"{source}: no questions in truth/questions.json")
        replies = ask_all(folder, asked, true_from_map)
        found["questions"] = grounding_scores(asked, replies, {one.id: one.box for one in aligned.objects})
    return found


def known_of(
    truth: Truth, seen: Sequence[FrameCounts], positions: F64, trajectory: Mapping[int, F64] | None = None
) -> Known:
    """A house as scoring reads it, after a walk that was at positions (N, 3) and saw the objects as `seen`, by id.

    A floor was seen when the walk was on it; a room when the walk entered it or saw an object of it well; a location
    when it saw MIN_SHARE of the members well.
    """
    sights = [sight_of(one) for one in seen]
    looked_into = {one.room for one, sight in zip(truth.objects, sights, strict=True) if sight == "well"}
    floor_of_room = {room.id: room.floor for room in truth.rooms}
    return Known(
        floors=tuple(
            KnownFloor(one.z_m, one.z_m + one.height_m, _entered(one.outline, one.index, truth, positions))
            for one in truth.floors
        ),
        rooms=tuple(
            KnownPlace(one.floor, one.polygon, one.id in looked_into or _entered_room(one, truth, positions))
            for one in truth.rooms
        ),
        locations=tuple(
            KnownPlace(floor_of_room[one.room], one.outline, _location_seen(one, sights)) for one in truth.locations
        ),
        objects=tuple(
            KnownObject(one.class_name, one.box, sight) for one, sight in zip(truth.objects, sights, strict=True)
        ),
        words=HOUSE_WORDS,
        trajectory=trajectory,
    )


def sight_of(seen: FrameCounts) -> Sight:
    """Whether the walk showed an object well enough to ask for it."""
    if seen.clear_frames >= MIN_FRAMES:
        return "well"
    return "poorly" if seen.frames else "never"


def _entered_room(room: TrueRoom, truth: Truth, positions: F64) -> bool:
    return _entered(room.polygon, room.floor, truth, positions)


def _entered(outline: F64, floor_index: int, truth: Truth, positions: F64) -> bool:
    floor = truth.floors[floor_index]
    height = positions[:, 2] - floor.z_m
    here = positions[(height > MIN_HEIGHT_M) & (height < floor.height_m)]
    return bool(points_in_polygon(outline, here[:, :2]).any())


def _location_seen(place: TrueLocation, sights: Sequence[Sight]) -> bool:
    well = sum(sights[member] == "well" for member in place.members)
    return well > 0 and well >= MIN_SHARE * len(place.members)
