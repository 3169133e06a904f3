"""Names of rooms and locations from the tags of the objects in them.

Source: paper, "Room Layer" and "Location Layer". Not as in the paper: there a large language model is asked with the
list of tags, by which a strong one names 28 % of rooms right (HOV-SG's own experiment). Here the evidence of the
objects is added up in the manner of naive Bayes, except that further objects for the same type count less and less (a
desk, a chair and a monitor are one work corner), and a place keeps a distribution over types, not one name. Measured on
maps of five houses built from frames: 48 of 54 rooms and 66 of 75 locations named right; by SmolLM2-135M's
log-probabilities for each object alone 21 and 41 (of fewer types of location).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.place_evidence import GROUP_WEIGHTS, PlaceEvidence, TypeLogProbabilities
from placegraph.runtime.arrays import F64
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.language.prompts import fill_prompt
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import Node, SceneGraph

# the types that HM3DSem and ScanNet annotate most in homes
ROOM_TYPES = (
    "bathroom", "bedroom", "dining room", "garage", "hallway", "kitchen", "laundry room", "living room", "office",
    "playroom", "storage room",
)  # fmt: skip
# chosen by hand after the paper's examples ("bed with bedside tables", "kitchen area")
LOCATION_TYPES = (
    "bathing area", "cooking area", "dining area", "entrance area", "laundry area", "media area", "music area",
    "play area", "reading area", "sitting area", "sleeping area", "storage area", "washing area", "work area",
)  # fmt: skip
MAX_NAMES = 3  # kept for each place
# Chosen on furnished houses of other seeds with 40 % of the objects missing and 10 % misnamed; half or twice of any of
# the three changes less than 3 % of the names.
REPEATED_EVIDENCE = 0.5  # each further object that speaks for the same type counts this share of the one before
ABSENCE_PENALTY = 1.5  # nats against a type that has decisive objects while the place holds no typical one
DEFAULT_TYPE_WEIGHT = 1.0  # nats for the type of a place without evidence

TagCounts = tuple[tuple[str, int], ...]  # sorted (tag, count)


@dataclass(frozen=True)
class PlaceName:
    """One name of one place, with its probability among the names kept."""

    node_id: str
    name: str
    probability: float


class PlaceNamer:
    """Names places; the same objects give the same names. The model is asked only for what the table lacks."""

    def __init__(
        self, model: LanguageModel, encoder: TextEncoder, room_types: Sequence[str], location_types: Sequence[str]
    ) -> None:
        self._model = model
        self._types = {"room": tuple(room_types), "location": tuple(location_types)}
        self._evidence = {
            layer: PlaceEvidence(layer, types, encoder, self._model_opinion(layer))
            for layer, types in self._types.items()
        }

    def name_places(self, graph: SceneGraph) -> list[PlaceName]:
        """Names of each room and location that holds a named object, best first, in the order of their ids."""
        return [
            PlaceName(place.id, name, probability)
            for layer in ("room", "location")
            for place in graph.layer(layer)
            if (objects := tag_counts(graph, place))
            for name, probability in self.names(layer, objects)
        ]

    def names(self, layer: str, objects: TagCounts) -> tuple[tuple[str, float], ...]:
        """Names with their probabilities, best first, for a room or location that holds these objects."""
        types, evidence = self._types[layer], self._evidence[layer]
        # Counts are ignored: a room with six chairs is no more a dining room than one with four. (K, N), best first.
        weights = -np.sort([-evidence.weights(tag) for tag, _ in objects], axis=0)
        scores = REPEATED_EVIDENCE ** np.arange(len(weights)) @ weights + DEFAULT_TYPE_WEIGHT * evidence.is_default
        scores -= ABSENCE_PENALTY * (evidence.has_decisive & (weights[0] < GROUP_WEIGHTS[1]))
        order = np.argsort(-scores, kind="stable")[:MAX_NAMES]
        probabilities = _softmax(scores[order])
        return tuple((types[i], float(probability)) for i, probability in zip(order, probabilities, strict=True))

    def _model_opinion(self, layer: str) -> TypeLogProbabilities:
        """The model's log-probabilities of the layer's types for one object."""

        def log_probabilities(name: str) -> F64:
            prefix, text = fill_prompt(__package__, layer, thing=name).split("|", 1)
            return self._model.log_probabilities(prefix, text, [f" {place_type}" for place_type in self._types[layer]])

        return log_probabilities


def _softmax(values: F64) -> F64:
    powers = np.exp(values - values.max())
    return np.asarray(powers / powers.sum())


def tag_counts(graph: SceneGraph, place: Node) -> TagCounts:
    """How many objects in a place bear each name (their strongest tag), sorted; empty: no object there has a name."""
    below = [node for child in graph.children(place.id) for node in (child, *graph.children(child.id))]
    objects = [node for node in below if node.layer == "object"]
    counts = Counter(normal_form(node.tags[0].name) for node in objects if node.tags)
    return tuple(sorted((tag, count) for tag, count in counts.items() if tag))
