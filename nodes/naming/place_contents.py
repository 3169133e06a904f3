"""What a room or location contains, as far as it helps to name it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import GraphNode, SceneGraph


@dataclass(frozen=True)
class PlaceContents:
    """How many objects in a place bear each name, sorted by name; of a room also the names of its locations."""

    objects: tuple[tuple[str, int], ...]
    locations: tuple[str, ...] = ()


def place_contents(graph: SceneGraph, place: GraphNode) -> PlaceContents:
    """The strongest tags of the objects and locations in a place; objects in a room's locations are in the room too."""
    children = graph.children(place.id)
    below = [node for child in children for node in (child, *graph.children(child.id))]
    names = [normal_form(node.tags[0].name) for node in below if node.layer == "object" and node.tags]
    counts = Counter(name for name in names if name)
    locations = [child.tags[0].name for child in children if child.layer == "location" and child.tags]
    return PlaceContents(tuple(sorted(counts.items())), tuple(sorted(locations)))
