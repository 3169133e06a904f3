"""Names of rooms and locations from what they contain: a pure function of the tags of their objects.

Source: paper, "Room Layer" and "Location Layer". Departs: the paper asks a large language model with the list of tags,
of which a strong one names 28 % of rooms right (METHOD section 6). Here each thing tells what telling.py knows of it,
things that tell of one kind of place count less and less (a desk, a chair and a monitor are one work corner), and a
place keeps a distribution, not one name. Measured on maps of five houses built from frames: 48 of 54 rooms and 66 of
75 locations named right, by SmolLM2-135M's opinion of each thing alone 21 and 41 (of fewer types of location).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.grounding.name_matching import Encode
from placegraph.nodes.grounding.place_evidence import STRENGTHS, Opinion, Telling
from placegraph.runtime.arrays import F64
from placegraph.runtime.language.language_model import LanguageModel, prompt
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import Node, SceneGraph

ROOM_TYPES = (
    "bathroom", "bedroom", "dining room", "garage", "hallway", "kitchen", "laundry room", "living room", "office",
    "playroom", "storage room",
)  # fmt: skip  # departs: the types that HM3DSem and ScanNet annotate most in homes
LOCATION_TYPES = (
    "bathing area", "cooking area", "dining area", "entrance area", "laundry area", "media area", "music area",
    "play area", "reading area", "sitting area", "sleeping area", "storage area", "washing area", "work area",
)  # fmt: skip  # departs: what the paper's examples ("bed with bedside tables", "kitchen area") come down to
KEPT = 3
# departs: chosen on furnished houses of other seeds with 40 % of the objects missing and 10 % misnamed; half or twice
# of any of them changes less than 3 % of the names
REPEATED = 0.5  # each further thing that tells of the same kind of place counts so much less
MISSED = 1.5  # nats against a kind of place of which nothing typical is there
BARE = 1.0  # nats for the kind of place that a room is when nothing tells

Evidence = tuple[tuple[str, int], ...]  # sorted (tag, count)


@dataclass(frozen=True)
class PlaceName:
    """One name of one place, with its probability among the names kept."""

    node_id: str
    name: str
    weight: float


class Namer:
    """Names places; the same evidence gives the same names. The model is asked for what the table does not hold."""

    def __init__(
        self, model: LanguageModel, encode: Encode, room_types: Sequence[str], location_types: Sequence[str]
    ) -> None:
        self._model = model
        self._types = {"room": tuple(room_types), "location": tuple(location_types)}
        self._telling = {
            layer: Telling(layer, types, encode, self._asks(layer)) for layer, types in self._types.items()
        }

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
        types, telling = self._types[layer], self._telling[layer]
        # how many there are of a thing says little: a room with six chairs is no more a dining room than one with four
        told = -np.sort([-telling.row(tag) for tag, _ in evidence], axis=0)
        scores = REPEATED ** np.arange(len(told)) @ told + BARE * telling.is_bare
        scores -= MISSED * (telling.is_settled & (told[0] < STRENGTHS[1]))
        order = np.argsort(-scores, kind="stable")[:KEPT]
        shares = _softmax(scores[order])
        return tuple((types[i], float(share)) for i, share in zip(order, shares, strict=True))

    def _asks(self, layer: str) -> Opinion:
        """The model's log-probability of each type of place for one thing."""

        def opinion(thing: str) -> F64:
            opening, rest = prompt(__package__, layer, thing=thing).split("|", 1)
            return self._model.log_probabilities(opening, rest, [f" {name}" for name in self._types[layer]])

        return opinion


def _softmax(values: F64) -> F64:
    powers = np.exp(values - values.max())
    return np.asarray(powers / powers.sum())


def evidence_of(graph: SceneGraph, place: Node) -> Evidence:
    """Strongest tags of the objects in a place with how many carry them, sorted; empty: nothing there has a name."""
    below = [node for child in graph.children(place.id) for node in (child, *graph.children(child.id))]
    objects = [node for node in below if node.layer == "object"]
    counts = Counter(normal_form(node.tags[0].name) for node in objects if node.tags)
    return tuple(sorted((tag, count) for tag, count in counts.items() if tag))
