"""Narrow the search by the place words of a request: floors, then rooms and locations, then objects.

Source: paper, "Selecting Related Objects". Not as in the paper: code matches names, without a model call per layer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from placegraph.nodes.grounding.name_matching import NameMatch, NameMatcher
from placegraph.nodes.grounding.phrase_segmentation import ORDINALS, WHOLE_MAP
from placegraph.nodes.grounding.program import Condition, Thing
from placegraph.nodes.grounding.program_syntax import format_program
from placegraph.nodes.grounding.word_lists import word_table
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import GraphNode, SceneGraph

# What rooms of a kind typically hold, the most typical first; used when the map has no room of that name.
TYPICAL_OBJECTS: dict[str, list[str]] = word_table("typical_objects")

RankPlaces = Callable[[Thing, Sequence[NameMatch]], list[GraphNode]]


@dataclass
class SearchScope:
    """Where to search: the objects and places left, notes on what was narrowed, and whether all words were followed.

    thing: the target without its place conditions; those that geometry must judge ("in the closet") stay among its
    conditions. hints: conditions that raise scores without having to hold.
    """

    objects: list[GraphNode]
    places: list[GraphNode]  # floors, rooms and locations that can be asked for themselves
    thing: Thing = field(default_factory=Thing)
    notes: list[str] = field(default_factory=list)
    sure: bool = True
    hints: list[Condition] = field(default_factory=list)


def narrow_scope(graph: SceneGraph, target: Thing, names: NameMatcher, rank_places: RankPlaces) -> SearchScope:
    """The objects below the floors and rooms that the target is said to be in. An unknown place narrows nothing.

    rank_places: chooses, of the places with a matching name, those that fit the place's conditions best ("the bedroom
    with the desk").
    """
    scope = SearchScope(graph.layer("object"), [*graph.layer("floor"), *graph.layer("room"), *graph.layer("location")])
    remaining: list[Condition] = []
    for condition in target.conditions_named("floor"):  # first: the largest bedroom upstairs is not that of the house
        _by_floor(graph, scope, condition)
    for condition in (other for other in target.conditions if other.name != "floor"):
        if condition.name == "room" or (condition.name == "in" and _names_place(graph, condition.things[0], names)):
            remaining += _by_room(graph, scope, condition, names, rank_places)
        else:
            remaining.append(condition)
    scope.thing = target.model_copy(update={"conditions": tuple(remaining)})
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
    """Narrow by one place condition; returns the conditions that are left for geometry to judge."""
    place = condition.things[0]
    if place.noun in WHOLE_MAP and not place.conditions:
        return []  # in the house, in the room
    floors = [inner for inner in place.conditions if inner.name == "floor"]
    for inner in floors:
        _by_floor(graph, scope, inner)
    place = place.model_copy(update={"conditions": tuple(inner for inner in place.conditions if inner not in floors)})
    matches = match_places(place.noun, [node for node in scope.places if node.layer != "floor"], names)
    if matches:
        places = rank_places(place, matches)
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
    """Whether an object has this name by its words; by embedding similarity alone a bathroom would be a toilet."""
    return any(
        match.score >= names.settings.other_modifier_fit for match in names.best_matches(noun, graph.layer("object"))
    )


def _typical_objects(noun: str, names: NameMatcher) -> Sequence[str]:
    return next(
        (
            things
            for kind, things in TYPICAL_OBJECTS.items()
            if names.similarity(noun, kind) >= names.settings.min_place_similarity
        ),
        (),
    )


def _names_place(graph: SceneGraph, thing: Thing, names: NameMatcher) -> bool:
    """Whether X in "in (X)" is a place: the name of a place and of no object, or a kind of room."""
    if thing.noun in ("", "room") or _is_thing(thing.noun, graph, names):
        return False
    places = [*graph.layer("room"), *graph.layer("location")]
    return bool(match_places(thing.noun, places, names)) or bool(_typical_objects(thing.noun, names))


def _keep_below(graph: SceneGraph, scope: SearchScope, tops: Sequence[GraphNode], *, outside: bool = False) -> None:
    floor_words = {top.id for top in tops}

    def is_kept(node: GraphNode) -> bool:
        return outside != any(step.id in floor_words for step in graph.path(node.id))

    scope.objects = [node for node in scope.objects if is_kept(node)]
    scope.places = [node for node in scope.places if is_kept(node)]


def match_places(name: str, places: Sequence[GraphNode], names: NameMatcher) -> list[NameMatch]:
    """Rooms and locations with that name: those whose strongest tag it is, else those that have it among their tags."""
    matches = [
        m
        for m in names.best_matches(name, places)
        if names.similarity(name, m.tag) >= names.settings.min_place_similarity
    ]
    strongest = [match for match in matches if match.node.tags and match.tag == match.node.tags[0].name]
    return strongest or matches


def match_floors(graph: SceneGraph, words: str) -> list[GraphNode]:
    """Floors by words: "upstairs" is all but the lowest, "second floor" the second from below; or by tag or id."""
    floors = sorted(graph.layer("floor"), key=lambda floor: (float(floor.box[0, 2]), floor.id))
    floor_words = normal_form(words)
    tagged = [floor for floor in floors if floor_words in {normal_form(tag.name) for tag in floor.tags}]
    tagged = tagged or [floor for floor in floors if floor.id.lower() == floor_words]
    if tagged or not floors:
        return tagged
    content_words = [
        word for word in floor_words.split() if word not in ("on", "in", "the", "of", "at", "floor", "level", "house")
    ]
    first = content_words[0] if content_words else ""
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
