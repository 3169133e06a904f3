"""How well a noun names a node: same words, same head noun, synonyms, then word embeddings.

Source: METHOD section 3 ("couch" meets "sofa") and section 10 (most loss is in matching words to tags).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.grounding.words import normal_form, synonyms
from placegraph.runtime.scene_graph import ID_PATTERN, Node

Encode = Callable[[Sequence[str]], NDArray[np.float32]]  # texts to (N, D) unit rows; a zero row for an empty text

SAME, KIND, SYNONYM, HEAD = 1.0, 0.95, 0.9, 0.8  # departs: the steps of fit, in the order people use names
COSINE = 0.45  # departs: lowest cosine that counts; see tests/nodes/grounding/test_names.py for the pairs it parts
TAG_SHARE = 0.2  # departs: a tag with less than this share of the strongest tag's weight is a slip of the detector
STEP = 0.08  # departs: nodes within this of the best fit are named equally well
NEAREST_NAMES = 3


@dataclass(frozen=True)
class Fit:
    """How well a noun names one node, 0..1, and the tag that decided it."""

    node: Node
    score: float
    tag: str


class Names:
    """Compares nouns with tags."""

    def __init__(self, encode: Encode) -> None:
        self._encode = encode

    def likeness(self, noun: str, tag: str) -> float:
        """How well a noun names a thing with this tag, 0..1; 0: not at all. Both in any form."""
        noun, tag = normal_form(noun), normal_form(tag)
        if not noun or not tag:
            return 0.0
        if noun == tag:
            return SAME
        if tag.endswith(f" {noun}"):
            return KIND  # an office chair is a chair
        if tag in synonyms().get(noun, ()):
            return SYNONYM
        if noun.endswith(f" {tag}"):
            return HEAD  # a "wooden chair" may be tagged chair
        if noun.startswith(tag) or tag.startswith(noun):
            return 0.0  # a tablecloth is no table, and a bedroom no bed: the last part of a compound says what it is
        cosine = self.cosine(noun, tag)
        return cosine if cosine >= COSINE else 0.0

    def cosine(self, a: str, b: str) -> float:
        """Cosine of two phrases' embeddings."""
        rows = self._encode([a, b])
        return float(rows[0] @ rows[1])

    def fit(self, noun: str, node: Node) -> Fit:
        """How well a noun names a node, over its tags; an id names exactly its node, an empty noun everything."""
        if not noun:
            return Fit(node, 1.0, node.name)
        if ID_PATTERN.fullmatch(noun.upper()):
            return Fit(node, float(noun.upper() == node.id), node.id)
        best = Fit(node, 0.0, "")
        strongest = max((tag.weight for tag in node.tags), default=0.0)
        for tag in node.tags:
            share = tag.weight / strongest if strongest > 0 else 1.0
            score = self.likeness(noun, tag.name) * (0.5 + 0.5 * share) if share >= TAG_SHARE else 0.0
            if score > best.score:
                best = Fit(node, score, tag.name)
        return best

    def named(self, noun: str, nodes: Iterable[Node], step: float = STEP) -> list[Fit]:
        """The nodes that the noun names best, in the order given: those within `step` (0..1) of the best fit."""
        fits = [fit for fit in (self.fit(noun, node) for node in nodes) if fit.score > 0]
        best = max((fit.score for fit in fits), default=0.0)
        return [fit for fit in fits if fit.score >= best - step]

    def is_known(self, noun: str, nodes: Iterable[Node]) -> bool:
        """Whether any of the nodes is called so."""
        return any(self.fit(noun, node).score > 0 for node in nodes)

    def nearest(self, noun: str, nodes: Iterable[Node], most: int = NEAREST_NAMES) -> list[str]:
        """The names in the map most like a noun, best first, at most so many."""
        names = sorted({node.tags[0].name for node in nodes if node.tags})
        if not names or not noun:
            return names[:most]
        rows = self._encode([noun, *names])
        order = np.argsort(-(rows[1:] @ rows[0]), kind="stable")
        return [names[i] for i in order[:most]]
