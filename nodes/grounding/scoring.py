"""Several things weighed by one condition after the other: scores, which of them hold, and the sentences that say why.

Source: METHOD section 10, step 4 (rank by evidence). Departs: graded; what fails a condition stays listed below.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import HOLDS, rank_positions
from placegraph.runtime.arrays import F64, Bool
from placegraph.runtime.scene_graph import Node

MIN = 0.03  # departs: what fails a condition stays listed, far below those for which it holds
# departs: names that fit within the first step are the same word for the things; when one thing alone bears it, within
# the next steps others may be meant: an office chair by "chair", a couch by "sofa"; a chair by "seat"; by likeness
NAME_STEPS = (0.04, 0.12, 0.2)
OFF_NAME = 0.4  # departs: what bears a less fitting name than others that are there is meant when little else fits
RUNNER_UP, LEVEL = 0.45, 0.97  # departs: of a rank: what comes next to it, and what cannot be told from it
OUTRANKED = 0.1  # departs: of a rank: what is not among those that it is said of
MEASURED = 0.6  # departs: how much of a runner-up's score its distance in the measure takes

Sentence = Callable[[int], str]


class ScoredCandidates:
    """The state of n things while their conditions are applied."""

    def __init__(self, boxes: Boxes, nodes: Sequence[Node | None], names: F64, *, narrowed: bool) -> None:
        """Names (n,): how well the noun names each; narrowed: more is said of them than the name."""
        self.boxes, self.nodes = boxes, nodes
        self.scores = names.astype(float)
        self.sentences: list[Sentence] = []
        best = float(names.max()) if len(names) else 0.0
        groups = [names >= best - step for step in NAME_STEPS]
        # who says more than the name has a name that does not tell: then others must be called so too
        told = next((group for group in groups if group.sum() > 1), groups[0]) if narrowed else groups[0]
        self.is_unique = bool(groups[0].sum() == 1)  # one thing alone bears the name
        self.peers: Bool = told
        self.scores = np.where(told, self.scores, OFF_NAME * self.scores)
        self.holds: Bool = groups[-1]
        self._rankable: Bool | None = None  # what all ranks are said of

    def __len__(self) -> int:
        return len(self.boxes)

    def apply_fits(self, values: F64, sentence: Sentence, *, trust: float = 1.0, negated: bool = False) -> None:
        """Apply a condition's fits (n,), 0..1; negated: it is said not to be so."""
        fits = 1.0 - values if negated else values
        holds = fits >= HOLDS - 1e-9
        self.scores = self.scores * np.power(np.clip(fits, MIN, 1.0), trust)
        self.holds = self.holds & holds
        self.sentences.append(lambda i: sentence(i) if holds[i] else f"not as said: {sentence(i)}")

    def apply_hint(self, values: F64, sentence: Sentence, trust: float) -> None:
        """Let something speak for those that it fits, without force."""
        self.scores = self.scores * np.power(np.clip(values, MIN, 1.0), trust)
        self.sentences.append(sentence)

    def rankable(self) -> Bool:
        """(n,) those that a rank is said of: what holds so far, else what comes near to it."""
        if self._rankable is not None:
            return self._rankable
        held = self.holds & self.peers
        if held.any():
            return held
        return np.asarray(self.peers & (self.scores >= 0.5 * self.scores[self.peers].max(initial=0.0)))

    def apply_rank(
        self, measure: F64, number: int, margin: float, sentence: Sentence, *, trust: float, negated: bool
    ) -> None:
        """Apply a rank: measure (n,), greatest first; the number-th among those that hold is meant."""
        self._rankable = self.rankable()
        rows = np.flatnonzero(self._rankable & np.isfinite(measure))
        if len(rows) < number and int(self.peers.sum()) >= number:
            rows = np.flatnonzero(self.peers & np.isfinite(measure))  # the second of one: something was misread
        values = np.full(len(self), OUTRANKED)
        places = rank_positions(measure[rows])
        there = len(rows)
        reached = min(number, there)  # of three the fifth is misread or miscounted: the last one comes nearest to it
        if there:
            wanted = float(measure[rows][places == reached][0])
            span = max(float(np.ptp(measure[rows])), 1e-6)
            off = np.abs(measure[rows] - wanted)
            runners = RUNNER_UP * (1 - MEASURED * off / span) / np.maximum(np.abs(places - reached), 1) ** 0.5
            values[rows] = np.where(places == reached, 1.0, np.where(off <= margin, LEVEL, runners))
            values[rows] *= 1.0 if there >= number else RUNNER_UP
        if negated:  # what the rank is not said of stays behind
            values[np.setdiff1d(np.arange(len(self)), rows)] = 1 - OUTRANKED
        place = {int(row): int(k) for row, k in zip(rows, places, strict=True)}
        short = f"; there are only {there}, not {number}" if there < number else ""

        def told(i: int) -> str:
            return f"{sentence(i)}, number {place[i]} of {there}{short}" if i in place else f"{sentence(i)}, set aside"

        self.apply_fits(values, told, trust=trust, negated=negated)

    def evidence(self, i: int) -> list[str]:
        """The sentences about one of them."""
        return [text for sentence in self.sentences if (text := sentence(i))]

    def best(self) -> F64:
        """(n,) scores as shares of the best."""
        top = float(self.scores.max(initial=0.0))
        return np.asarray(self.scores / top if top > 0 else self.scores)
