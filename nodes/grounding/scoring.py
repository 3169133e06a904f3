"""Scores of a thing's candidates while its conditions are applied one after the other, with the sentences that say why.

Each condition multiplies the scores by its fits, raised to the power of its trust. Not as in the paper: a candidate
that fails a condition is not dropped; it stays listed with a low score.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import HOLDS, rank_positions
from placegraph.nodes.grounding.settings import ScoreSettings
from placegraph.runtime.arrays import F64, Bool
from placegraph.runtime.scene_graph import GraphNode

Sentence = Callable[[int], str]


class ScoredCandidates:
    """The scores of n candidates.

    holds (n,): every condition so far fits. peers (n,): the candidates whose names fit about equally well.
    is_unique: exactly one candidate has the best name. nodes: None for parts of rooms.
    """

    def __init__(
        self, boxes: Boxes, nodes: Sequence[GraphNode | None], names: F64, settings: ScoreSettings, *, narrowed: bool
    ) -> None:
        """`names` (n,) is how well each is named, 0..1; narrowed: the request says more than the noun."""
        self.boxes, self.nodes, self.settings = boxes, nodes, settings
        steps = (settings.same_name_margin, settings.similar_name_margin, settings.related_name_margin)
        self.scores = names.astype(float)
        self.sentences: list[Sentence] = []
        best = float(names.max()) if len(names) else 0.0
        groups = [names >= best - step for step in steps]
        # who says more than the noun needs to: several things must have that name, if need be a less fitting one
        peers = next((group for group in groups if group.sum() > 1), groups[0]) if narrowed else groups[0]
        self.is_unique = bool(groups[0].sum() == 1)  # one thing alone bears the name
        self.peers: Bool = peers
        self.scores = np.where(peers, self.scores, settings.worse_name_factor * self.scores)
        self.holds: Bool = groups[-1]
        self._rankable: Bool | None = None  # fixed by the first rank

    def __len__(self) -> int:
        return len(self.boxes)

    def apply_fits(self, values: F64, sentence: Sentence, *, trust: float = 1.0, negated: bool = False) -> None:
        """Apply a condition's fits (n,) 0..1; negated: the request denies the condition."""
        fits = 1.0 - values if negated else values
        holds = fits >= HOLDS - 1e-9
        self.scores = self.scores * np.power(np.clip(fits, self.settings.min_fit, 1.0), trust)
        self.holds = self.holds & holds
        self.sentences.append(lambda i: sentence(i) if holds[i] else f"not as said: {sentence(i)}")

    def apply_hint(self, values: F64, sentence: Sentence, trust: float) -> None:
        """Raise the scores of those that something fits, without demanding that it holds."""
        self.scores = self.scores * np.power(np.clip(values, self.settings.min_fit, 1.0), trust)
        self.sentences.append(sentence)

    def rankable(self) -> Bool:
        """(n,) the candidates that a rank compares: those that hold so far, else those with the better scores."""
        if self._rankable is not None:
            return self._rankable
        holding = self.holds & self.peers
        if holding.any():
            return holding
        return np.asarray(self.peers & (self.scores >= 0.5 * self.scores[self.peers].max(initial=0.0)))

    def apply_rank(
        self, measure: F64, number: int, margin: float, sentence: Sentence, *, trust: float, negated: bool
    ) -> None:
        """Apply a rank: the number-th greatest measure (n,) among the rankable candidates is meant."""
        settings, self._rankable = self.settings, self.rankable()
        rows = np.flatnonzero(self._rankable & np.isfinite(measure))
        if len(rows) < number and int(self.peers.sum()) >= number:
            # "the second" where only one holds: another condition was misread
            rows = np.flatnonzero(self.peers & np.isfinite(measure))
        values = np.full(len(self), settings.outranked_rank)
        places = rank_positions(measure[rows])
        count = len(rows)
        reached = min(number, count)  # "the fifth" of three: a misread number, the last comes nearest
        if count:
            reached_value = float(measure[rows][places == reached][0])
            off = np.abs(measure[rows] - reached_value)
            runners = settings.runner_up_rank / np.maximum(np.abs(places - reached), 1) ** 0.5
            values[rows] = np.where(places == reached, 1.0, np.where(off <= margin, settings.level_rank, runners))
            values[rows] *= 1.0 if count >= number else settings.runner_up_rank
        if negated:  # candidates outside the comparison must not gain by the negation
            values[np.setdiff1d(np.arange(len(self)), rows)] = 1 - settings.outranked_rank
        position_of_row = {int(row): int(k) for row, k in zip(rows, places, strict=True)}
        short = f"; there are only {count}, not {number}" if count < number else ""

        def rank_sentence(i: int) -> str:
            return (
                f"{sentence(i)}, number {position_of_row[i]} of {count}{short}"
                if i in position_of_row
                else f"{sentence(i)}, set aside"
            )

        self.apply_fits(values, rank_sentence, trust=trust, negated=negated)

    def evidence(self, i: int) -> list[str]:
        """The sentences about candidate i."""
        return [text for sentence in self.sentences if (text := sentence(i))]

    def relative_scores(self) -> F64:
        """(n,) scores divided by the best score."""
        top = float(self.scores.max(initial=0.0))
        return np.asarray(self.scores / top if top > 0 else self.scores)
