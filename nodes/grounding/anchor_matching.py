"""One condition between targets and the things that its anchor may be: the best pair of each target.

Source: METHOD section 10, step 3. Departs: soft: a pair counts by the relation and by how well its anchor fits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes, Layout, joined
from placegraph.nodes.grounding.program import Condition
from placegraph.nodes.grounding.relations import HOLDS, Case, Fits, families
from placegraph.nodes.grounding.relations.nearness import walled
from placegraph.nodes.grounding.scoring import Weighing
from placegraph.nodes.grounding.viewpoint import Views
from placegraph.runtime.arrays import F64, I64, Bool

OTHER_ROOM = 0.5  # departs: what is said of two things is meant within one room; through a wall it counts half
DOUBT_M = 2.0  # departs: how much farther away an anchor counts for a rank that is half as well named
MISCOUNT = 0.6  # departs: for each thing more or less than was counted
MAX_ENDS = 16  # departs: of "between": the anchors of each side that are paired
UNDAMPED = frozenset(("closest", "farthest", "in", "holds", "with"))  # a wall between counts no further for these


@dataclass(frozen=True, eq=False)
class Anchors:
    """What an anchor may be: m things, weights (m,) 0..1 with the best at 1, and how many there are said to be."""

    boxes: Boxes
    weights: F64
    trust: float = 1.0
    count: int = 0
    single: bool = False  # the map holds one thing that is called so

    @classmethod
    def of(cls, weighings: Sequence[Weighing], trust: float, count: int) -> Anchors:
        """The outcome of weighings, best first; at least one."""
        boxes = joined([one.boxes for one in weighings])
        weights = np.concatenate([one.best() for one in weighings])
        order = np.argsort(-weights, kind="stable")
        return cls(boxes.take(order), weights[order], trust, count, len(weighings) == 1 and weighings[0].single)

    def first(self, most: int) -> Anchors:
        """The best of them, at most so many."""
        if len(self.boxes) <= most:
            return self
        return Anchors(self.boxes.take(np.arange(most)), self.weights[:most], self.trust, self.count, self.single)

    def best(self, level: float = 0.999) -> Boxes:
        """Those that fit as well as the best."""
        return self.boxes.take(np.flatnonzero(self.weights >= level))


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a condition gives: values (n,), fits or measures, a sentence for each, and how much it decides."""

    values: F64
    sentence: Callable[[int], str]
    margin: float
    trust: float
    known: bool


def related(condition: Condition, targets: Boxes, anchors: Sequence[Anchors], layout: Layout, views: Views) -> Outcome:
    """A condition's best anchor for each of n targets; a thing is never its own anchor."""
    name = condition.name
    judge = families()[name].judge
    if not anchors:
        return related_without(Case(name, targets, None, layout, views))
    first = anchors[0]
    trust = min(one.trust for one in anchors)
    if name == "between":
        a, b, weights = _pairs(anchors)
        case = Case(name, targets, first.boxes.take(a), layout, views, anchors[-1].boxes.take(b))
        assert case.seconds is not None
        own = _identical(targets, first.boxes.take(a)) | _identical(targets, case.seconds)
    else:
        case = Case(name, targets, first.boxes, layout, views)
        weights, own = first.weights, _identical(targets, first.boxes)
    fits = judge(case)
    trust *= fits.trust
    if name in ("closest", "farthest"):
        return _farther(fits, weights, own, name, trust)
    assert case.anchors is not None
    values = np.where(own, 0.0, fits.values)
    if name not in UNDAMPED and case.anchors.ids and any(case.anchors.ids):
        values = values * np.where(walled(targets, case.anchors) > 0, OTHER_ROOM, 1.0)
    soft = values * weights[None]
    best = soft.argmax(axis=1) if soft.size else np.zeros(len(targets), np.int64)
    found = soft.max(axis=1, initial=0.0)
    if first.count and len(anchors) == 1:
        held = ((values >= HOLDS) & (weights[None] >= HOLDS)).sum(axis=1)
        found = found * np.power(MISCOUNT, np.abs(held - first.count))
    return Outcome(found, _sentences(fits, best, own, targets, name), 0.0, trust, fits.known)


def related_without(case: Case) -> Outcome:
    """A condition without a thing."""
    fits = families()[case.relation].judge(case)
    return Outcome(fits.values[:, 0], lambda i: fits.sentence(i, 0), fits.margin, fits.trust, fits.known)


def _farther(fits: Fits, weights: F64, own: Bool, name: str, trust: float) -> Outcome:
    """Distances to the nearest anchor, where one that is less likely meant counts as farther away."""
    doubt = -DOUBT_M * np.log2(np.maximum(weights, 1e-3))[None]
    away = np.where(own, np.inf, np.abs(fits.values) + doubt)
    best = away.argmin(axis=1) if away.size else np.zeros(len(away), np.int64)
    nearest = away.min(axis=1, initial=np.inf)
    values = np.where(np.isfinite(nearest), -nearest if name == "closest" else nearest, np.nan)
    return Outcome(values, lambda i: fits.sentence(i, int(best[i])), fits.margin, trust, fits.known)


def _pairs(anchors: Sequence[Anchors]) -> tuple[I64, I64, F64]:
    """Rows of the first and the second anchor of each pair, and the weights of the pairs."""
    first, second = anchors[0], anchors[-1]
    n, m = min(len(first.boxes), MAX_ENDS), min(len(second.boxes), MAX_ENDS)
    a, b = (part.ravel() for part in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    same = np.array([first.boxes.ids[i] == second.boxes.ids[j] for i, j in zip(a, b, strict=True)], bool)
    twice = (a >= b) if len(anchors) == 1 else same
    a, b = a[~twice], b[~twice]
    return a, b, first.weights[a] * second.weights[b]


def _identical(targets: Boxes, anchors: Boxes) -> Bool:
    """(n, m) whether a target is the anchor."""
    rows = {name: j for j, name in enumerate(anchors.ids) if name}
    if len(rows) == sum(map(bool, anchors.ids)):
        same = np.zeros((len(targets), len(anchors)), bool)
        for i, name in enumerate(targets.ids):
            if name and name in rows:
                same[i, rows[name]] = True
        return same
    return np.asarray(np.array(targets.ids, object)[:, None] == np.array(anchors.ids, object)[None])


def _sentences(fits: Fits, best: I64, own: Bool, targets: Boxes, name: str) -> Callable[[int], str]:
    def sentence(i: int) -> str:
        if not own.shape[1] or own[i].all():
            return f"{targets.labels[i]} has nothing to be {name}"
        return fits.sentence(i, int(best[i]))

    return sentence
