"""Narrow the hierarchy by the program's place words: floors, then rooms and locations, then objects.

Source: paper, "Selecting Related Objects". Departs: in code, by names and ids that exist, instead of a call a layer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from placegraph.nodes.grounding.names import Fit, Names
from placegraph.nodes.grounding.phrases import ORDINALS
from placegraph.nodes.grounding.program import Program
from placegraph.nodes.grounding.words import normal_form
from placegraph.runtime.scene_graph import Node, SceneGraph

PLACE_LIKENESS = 0.7  # departs: the embeddings put bedroom and living room at 0.5, which are not the same place


@dataclass
class Scope:
    """Where to look: the objects and places left, what was done in words, and whether the words could be followed."""

    objects: list[Node]
    places: list[Node]  # floors, rooms and locations that can be asked for themselves
    notes: list[str] = field(default_factory=list)
    sure: bool = True


def narrow(graph: SceneGraph, program: Program, names: Names) -> Scope:
    """Objects under the floors and rooms that the program names. A place that is not in the map narrows nothing."""
    scope = Scope(graph.layer("object"), [*graph.layer("floor"), *graph.layer("room"), *graph.layer("location")])
    if program.floor:
        floors = floors_called(graph, program.floor)
        if floors:
            scope.notes.append(f"looked on {program.floor}: {', '.join(floor.id for floor in floors)}")
            _keep_below(graph, scope, floors)
        else:
            scope.sure = False
            count = len(graph.layer("floor"))
            looked = "on its only floor" if count == 1 else f"on all {count} floors" if count else "everywhere"
            scope.notes.append(f"the map has no {program.floor}; looked {looked}")
    if program.room:
        fits = places_called(program.room, [node for node in scope.places if node.layer != "floor"], names)
        places = [fit.node for fit in fits]
        if places:
            listed = ", ".join(f"{place.name} {place.id}" for place in places)
            scope.notes.append(f"looked {'outside' if program.outside else 'in'} {program.room}: {listed}")
            _keep_below(graph, scope, places, outside=program.outside)
        else:
            scope.sure = False
            scope.notes.append(f"no place in the map is called {program.room}; looked everywhere else")
    return scope


def _keep_below(graph: SceneGraph, scope: Scope, tops: Sequence[Node], *, outside: bool = False) -> None:
    wanted = {top.id for top in tops}

    def is_kept(node: Node) -> bool:
        return outside != any(step.id in wanted for step in graph.path(node.id))

    scope.objects = [node for node in scope.objects if is_kept(node)]
    scope.places = [node for node in scope.places if is_kept(node)]


def places_called(name: str, places: Sequence[Node], names: Names) -> list[Fit]:
    """Rooms and locations with that name: where it is the strongest one, else where it is among the likely ones."""
    fits = [fit for fit in names.named(name, places) if names.likeness(name, fit.tag) >= PLACE_LIKENESS]
    strongest = [fit for fit in fits if fit.node.tags and fit.tag == fit.node.tags[0].name]
    return strongest or fits


def floors_called(graph: SceneGraph, words: str) -> list[Node]:
    """Floors by words: "upstairs" is all but the lowest, "second floor" the second from below, or by tag."""
    floors = sorted(graph.layer("floor"), key=lambda floor: (float(floor.box[0, 2]), floor.id))
    tagged = [floor for floor in floors if words in {normal_form(tag.name) for tag in floor.tags}]
    if tagged or not floors:
        return tagged
    first = words.split()[0]
    if first == "upstairs" or first == "upper":
        return floors[1:]
    if first == "downstairs" or first == "lower":
        return floors[:-1]
    if first in ("ground", "bottom", "lowest", "main"):
        return floors[:1]
    if first in ("top", "highest", "last"):
        return floors[-1:]
    number = ORDINALS.get(first, 0)
    return floors[number - 1 : number] if number else []
