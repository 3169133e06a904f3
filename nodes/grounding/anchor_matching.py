"""One condition between targets and the things that its anchor may be: the best pair of each target.

Source: METHOD section 10, step 3. Departs: soft: a pair counts by the relation and by how well its anchor fits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes, Layout, concatenate
from placegraph.nodes.grounding.program import Condition
from placegraph.nodes.grounding.relations import HOLDS, PairFits, RelationQuery, relations_by_name
from placegraph.nodes.grounding.relations.nearness import in_different_rooms
from placegraph.nodes.grounding.scoring import ScoredCandidates
from placegraph.nodes.grounding.viewpoint import ViewpointSelector
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
    is_unique: bool = False  # the map holds one thing that is called so

    @classmethod
    def of(cls, weighings: Sequence[ScoredCandidates], trust: float, count: int) -> Anchors:
        """The outcome of weighings, best first; at least one."""
        boxes = concatenate([one.boxes for one in weighings])
        weights = np.concatenate([one.best() for one in weighings])
        order = np.argsort(-weights, kind="stable")
        return cls(boxes.take(order), weights[order], trust, count, len(weighings) == 1 and weighings[0].is_unique)

    def first(self, most: int) -> Anchors:
        """The best of them, at most so many."""
        if len(self.boxes) <= most:
            return self
        return Anchors(self.boxes.take(np.arange(most)), self.weights[:most], self.trust, self.count, self.is_unique)

    def best(self, level: float = 0.999) -> Boxes:
        """Those that fit as well as the best."""
        return self.boxes.take(np.flatnonzero(self.weights >= level))


@dataclass(frozen=True, eq=False)
class TargetFits:
    """What a condition gives: values (n,), fits or measures, a sentence for each, and how much it decides."""

    values: F64
    sentence: Callable[[int], str]
    margin: float
    trust: float
    known: bool


def match_anchors(condition: Condition, targets: Boxes, anchors: Sequence[Anchors], layout: Layout, viewpoints: ViewpointSelector) -> TargetFits:
    """A condition's best anchor for each of n targets; a thing is never its own anchor."""
    name = condition.name
    evaluate = relations_by_name()[name].evaluate
    if not anchors:
        return fits_without_anchor(RelationQuery(name, targets, None, layout, viewpoints))
    first = anchors[0]
    trust = min(one.trust for one in anchors)
    if name == "between":
        a, b, weights = _anchor_pairs(anchors)
        query = RelationQuery(name, targets, first.boxes.take(a), layout, viewpoints, anchors[-1].boxes.take(b))
        assert query.second_anchors is not None
        own = _same_node(targets, first.boxes.take(a)) | _same_node(targets, query.second_anchors)
    else:
        query = RelationQuery(name, targets, first.boxes, layout, viewpoints)
        weights, own = first.weights, _same_node(targets, first.boxes)
    fits = evaluate(query)
    trust *= fits.trust
    if name in ("closest", "farthest"):
        return _rank_by_distance(fits, weights, own, name, trust)
    assert query.anchors is not None
    values = np.where(own, 0.0, fits.values)
    if name not in UNDAMPED and query.anchors.ids and any(query.anchors.ids):
        values = values * np.where(in_different_rooms(targets, query.anchors) > 0, OTHER_ROOM, 1.0)
    soft = values * weights[None]
    best = soft.argmax(axis=1) if soft.size else np.zeros(len(targets), np.int64)
    found = soft.max(axis=1, initial=0.0)
    if first.count and len(anchors) == 1:
        held = ((values >= HOLDS) & (weights[None] >= HOLDS)).sum(axis=1)
        found = found * np.power(MISCOUNT, np.abs(held - first.count))
    return TargetFits(found, _sentences(fits, best, own, targets, name), 0.0, trust, fits.known)


def fits_without_anchor(query: RelationQuery) -> TargetFits:
    """A condition without a thing."""
    fits = relations_by_name()[query.relation].evaluate(query)
    return TargetFits(fits.values[:, 0], lambda i: fits.sentence(i, 0), fits.margin, fits.trust, fits.known)


def _rank_by_distance(fits: PairFits, weights: F64, own: Bool, name: str, trust: float) -> TargetFits:
    """Distances to the nearest anchor, where one that is less likely meant counts as farther away."""
    doubt = -DOUBT_M * np.log2(np.maximum(weights, 1e-3))[None]
    away = np.where(own, np.inf, np.abs(fits.values) + doubt)
    best = away.argmin(axis=1) if away.size else np.zeros(len(away), np.int64)
    nearest = away.min(axis=1, initial=np.inf)
    values = np.where(np.isfinite(nearest), -nearest if name == "closest" else nearest, np.nan)
    return TargetFits(values, lambda i: fits.sentence(i, int(best[i])), fits.margin, trust, fits.known)


def _anchor_pairs(anchors: Sequence[Anchors]) -> tuple[I64, I64, F64]:
    """Rows of the first and the second anchor of each pair, and the weights of the pairs."""
    first, second = anchors[0], anchors[-1]
    n, m = min(len(first.boxes), MAX_ENDS), min(len(second.boxes), MAX_ENDS)
    a, b = (part.ravel() for part in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    same = np.array([first.boxes.ids[i] == second.boxes.ids[j] for i, j in zip(a, b, strict=True)], bool)
    twice = (a >= b) if len(anchors) == 1 else same
    a, b = a[~twice], b[~twice]
    return a, b, first.weights[a] * second.weights[b]


def _same_node(targets: Boxes, anchors: Boxes) -> Bool:
    """(n, m) whether a target is the anchor."""
    rows = {name: j for j, name in enumerate(anchors.ids) if name}
    if len(rows) == sum(map(bool, anchors.ids)):
        same = np.zeros((len(targets), len(anchors)), bool)
        for i, name in enumerate(targets.ids):
            if name and name in rows:
                same[i, rows[name]] = True
        return same
    return np.asarray(np.array(targets.ids, object)[:, None] == np.array(anchors.ids, object)[None])


def _sentences(fits: PairFits, best: I64, own: Bool, targets: Boxes, name: str) -> Callable[[int], str]:
    def sentence(i: int) -> str:
        if not own.shape[1] or own[i].all():
            return f"{targets.labels[i]} has nothing to be {name}"
        return fits.sentence(i, int(best[i]))

    return sentence
