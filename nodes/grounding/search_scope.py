"""Narrow the hierarchy by the place words of a request: floors, then rooms and locations, then objects.

Source: paper, "Selecting Related Objects". Departs: in code, by names and ids that exist, instead of a call a layer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from placegraph.nodes.grounding.name_matching import HEAD, NameMatch, NameMatcher
from placegraph.nodes.grounding.phrase_segmentation import ORDINALS, WHOLE_MAP
from placegraph.nodes.grounding.program import Condition, Thing
from placegraph.nodes.grounding.program_syntax import format_program
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import Node, SceneGraph

PLACE_LIKENESS = 0.7  # departs: the embeddings put bedroom and living room at 0.5, which are not the same place
# What a room of a kind holds, for maps that have no rooms or none of that name; the first ones tell most.
TYPICAL_OBJECTS: dict[str, tuple[str, ...]] = {
    "bathroom": ("toilet", "bathtub", "shower", "urinal", "bathroom vanity"),
    "kitchen": ("stove", "refrigerator", "kitchen counter", "kitchen cabinet", "dishwasher"),
    "bedroom": ("bed", "nightstand"),
    "living room": ("sofa", "coffee table", "tv"),
    "office": ("desk", "office chair"),
    "work area": ("desk", "office chair"),
    "dining room": ("dining table", "table"),
    "dining area": ("dining table", "table"),
    "laundry room": ("washing machine", "clothes dryer"),
    "sitting area": ("sofa", "armchair"),
    "cooking area": ("stove",),
    "sleeping area": ("bed",),
}

RankPlaces = Callable[[Thing, Sequence[NameMatch]], list[Node]]


@dataclass
class SearchScope:
    """Where to look: the objects and places left, what was done in words, and whether the words could be followed.

    thing: the target without its place words; what they leave for geometry ("in the closet") is among its conditions.
    """

    objects: list[Node]
    places: list[Node]  # floors, rooms and locations that can be asked for themselves
    thing: Thing = field(default_factory=Thing)
    notes: list[str] = field(default_factory=list)
    sure: bool = True
    hints: list[Condition] = field(default_factory=list)  # what speaks for the target without force


def narrow_scope(graph: SceneGraph, target: Thing, names: NameMatcher, rank_places: RankPlaces) -> SearchScope:
    """Objects under the floors and rooms that a target is said to be in. A place that is not there narrows nothing.

    rank_places: the places of those called so that fit the conditions of a place best ("the bedroom with the desk").
    """
    scope = SearchScope(graph.layer("object"), [*graph.layer("floor"), *graph.layer("room"), *graph.layer("location")])
    kept: list[Condition] = []
    for condition in target.conditions_named("floor"):  # first: the largest bedroom upstairs is not that of the house
        _by_floor(graph, scope, condition)
    for condition in (one for one in target.conditions if one.name != "floor"):
        if condition.name == "room" or (condition.name == "in" and _names_place(graph, condition.things[0], names)):
            kept += _by_room(graph, scope, condition, names, rank_places)
        else:
            kept.append(condition)
    scope.thing = target.model_copy(update={"conditions": tuple(kept)})
    return scope


def _by_floor(graph: SceneGraph, scope: SearchScope, condition: Condition) -> None:
    floors = match_floors(graph, condition.words)
    if floors:
        looked = "away from" if condition.negated else "on"
        scope.notes.append(f"looked {looked} {condition.words}: {', '.join(floor.id for floor in floors)}")
        _keep_below(graph, scope, floors, outside=condition.negated)
        return
    scope.sure = False
    count = len(graph.layer("floor"))
    looked = "on its only floor" if count == 1 else f"on all {count} floors" if count else "everywhere"
    scope.notes.append(f"the map has no {condition.words}; looked {looked}")


def _by_room(
    graph: SceneGraph, scope: SearchScope, condition: Condition, names: NameMatcher, rank_places: RankPlaces
) -> list[Condition]:
    """Narrow by one place; returns what is left of it for geometry to judge."""
    place = condition.things[0]
    if place.noun in WHOLE_MAP and not place.conditions:
        return []  # in the house, in the room
    floors = [inner for inner in place.conditions if inner.name == "floor"]
    for inner in floors:
        _by_floor(graph, scope, inner)
    place = place.model_copy(update={"conditions": tuple(one for one in place.conditions if one not in floors)})
    fits = match_places(place.noun, [node for node in scope.places if node.layer != "floor"], names)
    if fits:
        places = rank_places(place, fits)
        listed = ", ".join(f"{node.name} {node.id}" for node in places)
        scope.notes.append(f"looked {'outside' if condition.negated else 'in'} {format_program(place)}: {listed}")
        _keep_below(graph, scope, places, outside=condition.negated)
        return []
    if _is_thing(place.noun, graph, names):  # the closet, the shower: a thing that one can be in
        return [condition.model_copy(update={"name": "in"})]
    scope.sure = False
    typical = next((noun for noun in _typical_objects(place.noun, names) if names.is_known(noun, scope.objects)), "")
    if typical:
        scope.notes.append(f"no place in the map is called {place.noun}; took what is near the {typical} for it")
        scope.hints.append(Condition(name="near", things=(Thing(noun=typical),), negated=condition.negated))
        return []
    scope.notes.append(f"no place in the map is called {place.noun}; looked everywhere else")
    return []


def _is_thing(noun: str, graph: SceneGraph, names: NameMatcher) -> bool:
    """Whether an object is called so by its words; likeness alone makes a toilet of a bathroom."""
    return any(fit.score >= HEAD for fit in names.best_matches(noun, graph.layer("object")))


def _typical_objects(noun: str, names: NameMatcher) -> tuple[str, ...]:
    return next((things for kind, things in TYPICAL_OBJECTS.items() if names.similarity(noun, kind) >= PLACE_LIKENESS), ())


def _names_place(graph: SceneGraph, thing: Thing, names: NameMatcher) -> bool:
    """Whether "in (X)" speaks of a room: a place is called so and no object, or it is a word for a kind of room."""
    if thing.noun in ("", "room") or _is_thing(thing.noun, graph, names):
        return False
    places = [*graph.layer("room"), *graph.layer("location")]
    return bool(match_places(thing.noun, places, names)) or bool(_typical_objects(thing.noun, names))


def _keep_below(graph: SceneGraph, scope: SearchScope, tops: Sequence[Node], *, outside: bool = False) -> None:
    wanted = {top.id for top in tops}

    def is_kept(node: Node) -> bool:
        return outside != any(step.id in wanted for step in graph.path(node.id))

    scope.objects = [node for node in scope.objects if is_kept(node)]
    scope.places = [node for node in scope.places if is_kept(node)]


def match_places(name: str, places: Sequence[Node], names: NameMatcher) -> list[NameMatch]:
    """Rooms and locations with that name: where it is the strongest one, else where it is among the likely ones."""
    fits = [fit for fit in names.best_matches(name, places) if names.similarity(name, fit.tag) >= PLACE_LIKENESS]
    strongest = [fit for fit in fits if fit.node.tags and fit.tag == fit.node.tags[0].name]
    return strongest or fits


def match_floors(graph: SceneGraph, words: str) -> list[Node]:
    """Floors by words: "upstairs" is all but the lowest, "second floor" the second from below, or by tag or id."""
    floors = sorted(graph.layer("floor"), key=lambda floor: (float(floor.box[0, 2]), floor.id))
    wanted = normal_form(words)
    tagged = [floor for floor in floors if wanted in {normal_form(tag.name) for tag in floor.tags}]
    tagged = tagged or [floor for floor in floors if floor.id.lower() == wanted]
    if tagged or not floors:
        return tagged
    said = [word for word in wanted.split() if word not in ("on", "in", "the", "of", "at", "floor", "level", "house")]
    first = said[0] if said else ""
    if first in ("upstairs", "upstair", "upper", "above"):
        return floors[1:]
    if first in ("downstairs", "downstair", "lower", "below"):
        return floors[:-1]
    if first in ("ground", "bottom", "lowest", "main", "basement", "cellar"):
        return floors[:1]
    if first in ("top", "highest", "last", "attic"):
        return floors[-1:]
    if first in ("middle", "center", "centre") and len(floors) % 2:
        return [floors[len(floors) // 2]]
    number = int(first) if first.isdigit() else ORDINALS.get(first, _CARDINALS.get(first, 0))
    return floors[number - 1 : number] if number > 0 else []


_CARDINALS = {"one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6}
