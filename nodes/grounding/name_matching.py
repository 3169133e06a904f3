"""How well a noun names a node: same words, same head noun, synonyms, then word embeddings; and slips of spelling.

Source: METHOD section 3 ("couch" meets "sofa") and section 10 (most loss is in matching words to tags).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F32
from placegraph.runtime.language.word_forms import kinds, normal_form, synonyms
from placegraph.runtime.scene_graph import ID_PATTERN, Node

Encode = Callable[[Sequence[str]], F32]  # texts to (N, D) unit rows; a zero row for an empty text

# departs: the steps of fit, in the order people use names
SAME, KIND, SYNONYM, SLIP, MEMBER, HEAD = 1.0, 0.95, 0.9, 0.88, 0.85, 0.8
SHARED = 0.03  # departs: of synonyms the one whose word is in the noun is meant more
COSINE = 0.45  # departs: lowest cosine that counts; see tests/nodes/grounding/test_names.py for the pairs it parts
FAIR = 0.35  # departs: lowest cosine of a name that is taken, with doubt, where nothing is called so
TAG_SHARE = 0.2  # departs: a tag with less than this share of the strongest tag's weight is a slip of the detector
STEP = 0.08  # departs: nodes within this of the best fit are named equally well
NEAREST_NAMES = 3
SLIP_LETTERS = (5, 9)  # departs: words from so many letters on may hold one wrong letter, or two
MAX_KEPT = 50_000  # pairs of words whose likeness is remembered


@dataclass(frozen=True)
class NameMatch:
    """How well a noun names one node, 0..1, and the tag that decided it."""

    node: Node
    score: float
    tag: str


class NameMatcher:
    """Compares nouns with tags."""

    def __init__(self, encode: Encode) -> None:
        self._encode = encode
        self._similarity: dict[tuple[str, str], float] = {}
        self._rows: dict[str, F32] = {}

    def similarity(self, noun: str, tag: str) -> float:
        """How well a noun names a thing with this tag, 0..1; 0: not at all. Both in any form."""
        if (noun, tag) not in self._similarity:
            if len(self._similarity) >= MAX_KEPT:
                self._similarity.clear()
            self._similarity[noun, tag] = self._compare(normal_form(noun), normal_form(tag))
        return self._similarity[noun, tag]

    def _compare(self, noun: str, tag: str) -> float:
        if not noun or not tag:
            return 0.0
        known = _by_words(noun, tag)
        if known:
            return known
        if noun.startswith(tag) or tag.startswith(noun):
            return 0.0  # a tablecloth is no table, and a bedroom no bed: the last part of a compound says what it is
        cosine = self.cosine(noun, tag)
        return cosine if cosine >= COSINE else 0.0

    def cosine(self, a: str, b: str) -> float:
        """Cosine of two phrases' embeddings."""
        return float(self._in_front_of_row(a) @ self._in_front_of_row(b))

    def _encode_tags(self, nodes: Sequence[Node]) -> None:
        """Encode all their tags at once: one at a time takes a hundred times as long."""
        if len(self._rows) >= MAX_KEPT:
            self._rows.clear()
        unknown = sorted({normal_form(tag.name) for node in nodes for tag in node.tags} - self._rows.keys())
        if unknown:
            self._rows.update(zip(unknown, self._encode(unknown), strict=True))

    def _in_front_of_row(self, text: str) -> F32:
        if text not in self._rows:
            if len(self._rows) >= MAX_KEPT:
                self._rows.clear()
            self._rows[text] = self._encode([text])[0]
        return self._rows[text]

    def fit(self, noun: str, node: Node) -> NameMatch:
        """How well a noun names a node, over its tags; an id names exactly its node, an empty noun everything."""
        if not noun:
            return NameMatch(node, 1.0, node.name)
        if ID_PATTERN.fullmatch(noun.upper()):
            return NameMatch(node, float(noun.upper() == node.id), node.id)
        return self._best(noun, node, self.similarity)

    @staticmethod
    def _best(noun: str, node: Node, similarity: Callable[[str, str], float]) -> NameMatch:
        best = NameMatch(node, 0.0, "")
        strongest = max((tag.weight for tag in node.tags), default=0.0)
        for tag in node.tags:
            share = tag.weight / strongest if strongest > 0 else 1.0
            score = similarity(noun, tag.name) * (0.5 + 0.5 * share) if share >= TAG_SHARE else 0.0
            if score > best.score:
                best = NameMatch(node, score, tag.name)
        return best

    def matches(self, noun: str, nodes: Sequence[Node]) -> list[NameMatch]:
        """All nodes that the noun names, well or less well, in the order given."""
        self._encode_tags(nodes)
        return [fit for fit in (self.fit(noun, node) for node in nodes) if fit.score > 0]

    def nearest_matches(self, noun: str, nodes: Sequence[Node]) -> list[NameMatch]:
        """Where nothing is called so: the nodes whose name is the most like the noun, if that is fair; else none."""
        if not noun or ID_PATTERN.fullmatch(noun.upper()):
            return []
        self._encode_tags(nodes)
        fits = [self._best(normal_form(noun), node, self._cosine_similarity) for node in nodes]
        best = max((fit.score for fit in fits), default=0.0)
        return [fit for fit in fits if best >= FAIR and fit.score >= best - STEP / 2]

    def _cosine_similarity(self, noun: str, tag: str) -> float:
        return max(self.cosine(noun, normal_form(tag)), 0.0)

    def best_matches(self, noun: str, nodes: Sequence[Node], step: float = STEP) -> list[NameMatch]:
        """The nodes that the noun names best, in the order given: those within `step` (0..1) of the best fit."""
        fits = self.matches(noun, nodes)
        best = max((fit.score for fit in fits), default=0.0)
        return [fit for fit in fits if fit.score >= best - step]

    def is_known(self, noun: str, nodes: Iterable[Node]) -> bool:
        """Whether any of the nodes is called so."""
        return any(self.fit(noun, node).score > 0 for node in nodes)

    def nearest_names(self, noun: str, nodes: Iterable[Node], most: int = NEAREST_NAMES) -> list[str]:
        """The names in the map most like a noun, best first, at most so many."""
        names = sorted({node.tags[0].name for node in nodes if node.tags})
        if not names or not noun:
            return names[:most]
        rows = self._encode([noun, *names])
        order = np.argsort(-(rows[1:] @ rows[0]), kind="stable")
        return [names[i] for i in order[:most]]


def _by_words(noun: str, tag: str) -> float:
    """Likeness by the words themselves, both in normal form; 0 where they say nothing."""
    if noun == tag or _one_word(noun) == _one_word(tag):
        return SAME
    if tag.endswith(f" {noun}"):
        return KIND  # an office chair is a chair
    if _are_synonyms(noun, tag):
        return SYNONYM + SHARED * noun.endswith(f" {tag}")  # of a duffel bag: a bag before a backpack
    if tag in kinds().get(noun, ()):
        return MEMBER  # a chair is a seat
    if is_misspelling(noun, tag):
        return SLIP
    if noun.endswith(f" {tag}"):
        return HEAD  # a "wooden chair" may be tagged chair
    found = 0.0
    for own in _heads(noun):
        for other in _heads(tag):
            if (own, other) == (noun, tag):
                continue
            worth = (HEAD if own != noun else 1.0) * (KIND if other != tag else 1.0)
            if _are_synonyms(own, other) or (own == other and own != noun and other != tag):
                # "leather couch" and "green sofa"; the words before the heads may speak against each other
                found = max(found, worth * (SYNONYM if own != other else 0.9))
            elif other in kinds().get(own, ()):
                found = max(found, worth * MEMBER)
            elif is_misspelling(own, other):
                found = max(found, worth * SLIP)
    return found


def _one_word(text: str) -> str:
    return text.replace(" ", "")


def _are_synonyms(a: str, b: str) -> bool:
    return b in synonyms().get(a, ()) or _one_word(b) in synonyms().get(_one_word(a), ())


def _heads(text: str) -> list[str]:
    """A noun phrase, and what is left of it when words are taken off its front."""
    words = text.split()
    return [" ".join(words[i:]) for i in range(len(words))]


def is_misspelling(noun: str, word: str) -> bool:
    """Whether a noun is another word with one wrong letter, or two where both are long."""
    shorter = min(len(noun), len(word))
    most = 0 if shorter < SLIP_LETTERS[0] else 1 if shorter < SLIP_LETTERS[1] else 2
    if not most or abs(len(noun) - len(word)) > most or noun[0] != word[0]:
        return False
    if noun in synonyms() or noun in kinds():
        return False  # a word of its own: a desk is no dusk
    return _edits(noun, word) <= most


def _edits(a: str, b: str) -> int:
    """Letters left out, put in, changed or swapped with their neighbour between two words."""
    rows = [list(range(len(b) + 1))]
    for i, letter in enumerate(a, 1):
        row = [i]
        for j, other in enumerate(b, 1):
            row.append(min(row[-1] + 1, rows[-1][j] + 1, rows[-1][j - 1] + (letter != other)))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                row[j] = min(row[j], rows[-2][j - 2] + 1)
        rows.append(row)
    return rows[-1][-1]
