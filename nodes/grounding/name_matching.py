"""How well a noun names a node: same words, same head noun, synonyms, misspellings, then word embeddings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.grounding.settings import DEFAULTS, NameSettings
from placegraph.runtime.arrays import F32
from placegraph.runtime.language.word_forms import hyponyms, normal_form, synonyms
from placegraph.runtime.scene_graph import ID_PATTERN, GraphNode

Encode = Callable[[Sequence[str]], F32]  # texts to (N, D) unit rows; a zero row for an empty text

NEAREST_NAMES = 3
MISSPELLED_LETTERS = (5, 9)  # words of at least so many letters may have one wrong letter, or two; chosen by hand
MAX_KEPT = 50_000  # pairs of words whose likeness is remembered


@dataclass(frozen=True)
class NameMatch:
    """A node, how well a noun names it (0..1), and the tag that gave this score."""

    node: GraphNode
    score: float
    tag: str


class NameMatcher:
    """Compares nouns with tags."""

    def __init__(self, encode: Encode, settings: NameSettings = DEFAULTS.names) -> None:
        self._encode, self.settings = encode, settings
        self._similarity: dict[tuple[str, str], float] = {}
        self._rows: dict[str, F32] = {}

    def with_settings(self, settings: NameSettings) -> NameMatcher:
        """A matcher with other settings and the same encoded words."""
        matcher = NameMatcher(self._encode, settings)
        matcher._rows = self._rows
        return matcher

    def similarity(self, noun: str, tag: str) -> float:
        """How well a noun names a thing with this tag, 0..1; 0: not at all. Both may be plural."""
        if (noun, tag) not in self._similarity:
            if len(self._similarity) >= MAX_KEPT:
                self._similarity.clear()
            self._similarity[noun, tag] = self._compare(normal_form(noun), normal_form(tag))
        return self._similarity[noun, tag]

    def _compare(self, noun: str, tag: str) -> float:
        if not noun or not tag:
            return 0.0
        by_words = _word_similarity(noun, tag, self.settings)
        if by_words:
            return by_words
        if noun.startswith(tag) or tag.startswith(noun):
            return 0.0  # the last part of a compound says what it is: a tablecloth is no table, a bedroom no bed
        cosine = self.cosine(noun, tag)
        return cosine if cosine >= self.settings.min_cosine else 0.0

    def cosine(self, a: str, b: str) -> float:
        """Cosine of two phrases' embeddings."""
        return float(self._in_front_of_row(a) @ self._in_front_of_row(b))

    def _encode_tags(self, nodes: Sequence[GraphNode]) -> None:
        """Encode all tags of the nodes in one batch, which is a hundred times as fast as one by one."""
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

    def match(self, noun: str, node: GraphNode) -> NameMatch:
        """The best match over a node's tags. An id names exactly its node; an empty noun names everything."""
        if not noun:
            return NameMatch(node, 1.0, node.name)
        if ID_PATTERN.fullmatch(noun.upper()):
            return NameMatch(node, float(noun.upper() == node.id), node.id)
        return self._best(noun, node, self.similarity)

    def _best(self, noun: str, node: GraphNode, similarity: Callable[[str, str], float]) -> NameMatch:
        best = NameMatch(node, 0.0, "")
        strongest = max((tag.weight for tag in node.tags), default=0.0)
        for tag in node.tags:
            share = tag.weight / strongest if strongest > 0 else 1.0
            score = similarity(noun, tag.name) * (0.5 + 0.5 * share) if share >= self.settings.min_tag_share else 0.0
            if score > best.score:
                best = NameMatch(node, score, tag.name)
        return best

    def matches(self, noun: str, nodes: Sequence[GraphNode]) -> list[NameMatch]:
        """All nodes that the noun names with a score above 0, in the order given."""
        self._encode_tags(nodes)
        return [match for match in (self.match(noun, node) for node in nodes) if match.score > 0]

    def nearest_matches(self, noun: str, nodes: Sequence[GraphNode]) -> list[NameMatch]:
        """For a noun that names nothing: the nodes with the most similar names, if they are similar enough."""
        if not noun or ID_PATTERN.fullmatch(noun.upper()):
            return []
        self._encode_tags(nodes)
        matches = [self._best(normal_form(noun), node, self._cosine_similarity) for node in nodes]
        best = max((match.score for match in matches), default=0.0)
        return [
            match
            for match in matches
            if best >= self.settings.min_nearest_cosine and match.score >= best - self.settings.tie_margin / 2
        ]

    def _cosine_similarity(self, noun: str, tag: str) -> float:
        return max(self.cosine(noun, normal_form(tag)), 0.0)

    def best_matches(self, noun: str, nodes: Sequence[GraphNode]) -> list[NameMatch]:
        """The nodes whose score is within `tie` of the best, in the order given."""
        matches = self.matches(noun, nodes)
        best = max((match.score for match in matches), default=0.0)
        return [match for match in matches if match.score >= best - self.settings.tie_margin]

    def is_known(self, noun: str, nodes: Iterable[GraphNode]) -> bool:
        """Whether the noun names any of the nodes."""
        return any(self.match(noun, node).score > 0 for node in nodes)

    def nearest_names(self, noun: str, nodes: Iterable[GraphNode], max_count: int = NEAREST_NAMES) -> list[str]:
        """The names in the map that are the most similar to a noun, best first."""
        names = sorted({node.tags[0].name for node in nodes if node.tags})
        if not names or not noun:
            return names[:max_count]
        rows = self._encode([noun, *names])
        order = np.argsort(-(rows[1:] @ rows[0]), kind="stable")
        return [names[i] for i in order[:max_count]]


def _word_similarity(noun: str, tag: str, settings: NameSettings) -> float:
    """Similarity 0..1 by the words alone, both in normal form; 0 when they have nothing in common."""
    if noun == tag or _one_word(noun) == _one_word(tag):
        return settings.same_words_fit
    if tag.endswith(f" {noun}"):
        return settings.head_noun_fit  # an office chair is a chair
    if _are_synonyms(noun, tag):
        return settings.synonym_fit + settings.shared_word_bonus * noun.endswith(
            f" {tag}"
        )  # of a duffel bag: a bag before a backpack
    if tag in hyponyms().get(noun, ()):
        return settings.superclass_fit  # a chair is a seat
    if is_misspelling(noun, tag):
        return settings.misspelled_fit
    if noun.endswith(f" {tag}"):
        return settings.other_modifier_fit  # a "wooden chair" may be tagged chair
    best_score = 0.0
    for noun_head in _heads(noun):
        for tag_head in _heads(tag):
            if (noun_head, tag_head) == (noun, tag):
                continue
            weight = (settings.other_modifier_fit if noun_head != noun else 1.0) * (
                settings.head_noun_fit if tag_head != tag else 1.0
            )
            if _are_synonyms(noun_head, tag_head) or (noun_head == tag_head and noun_head != noun and tag_head != tag):
                # "leather couch" and "green sofa": less, because the words before the heads may contradict each other
                best_score = max(best_score, weight * (settings.synonym_fit if noun_head != tag_head else 0.9))
            elif tag_head in hyponyms().get(noun_head, ()):
                best_score = max(best_score, weight * settings.superclass_fit)
            elif is_misspelling(noun_head, tag_head):
                best_score = max(best_score, weight * settings.misspelled_fit)
    return best_score


def _one_word(text: str) -> str:
    return text.replace(" ", "")


def _are_synonyms(a: str, b: str) -> bool:
    return b in synonyms().get(a, ()) or _one_word(b) in synonyms().get(_one_word(a), ())


def _heads(text: str) -> list[str]:
    """A noun phrase and its shorter ends: "big red box" gives "big red box", "red box" and "box"."""
    words = text.split()
    return [" ".join(words[i:]) for i in range(len(words))]


def is_misspelling(noun: str, word: str) -> bool:
    """Whether a noun is a misspelling of a word: one wrong letter, or two in long words."""
    shorter = min(len(noun), len(word))
    max_edits = 0 if shorter < MISSPELLED_LETTERS[0] else 1 if shorter < MISSPELLED_LETTERS[1] else 2
    if not max_edits or abs(len(noun) - len(word)) > max_edits or noun[0] != word[0]:
        return False
    if noun in synonyms() or noun in hyponyms():
        return False  # the noun is itself a known word
    return _edit_distance(noun, word) <= max_edits


def _edit_distance(a: str, b: str) -> int:
    """Damerau-Levenshtein distance: letters omitted, inserted, changed or swapped with a neighbour."""
    rows = [list(range(len(b) + 1))]
    for i, letter in enumerate(a, 1):
        row = [i]
        for j, b_letter in enumerate(b, 1):
            row.append(min(row[-1] + 1, rows[-1][j] + 1, rows[-1][j - 1] + (letter != b_letter)))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == b_letter:
                row[j] = min(row[j], rows[-2][j - 2] + 1)
        rows.append(row)
    return rows[-1][-1]
