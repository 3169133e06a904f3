"""Score one relation between all targets and all candidates of its anchor: each target's best anchor counts.

Not as in the paper: nothing is chosen for good. A pair scores by the relation and by how well its anchor fits its own
description, so a wrong anchor does not rule out the right target.
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

MAX_ENDS = 16  # anchors of each side of "between" that are paired; bounds the pairs
UNDAMPED = frozenset(("closest", "farthest", "in", "holds", "with"))  # a wall between counts no further for these


@dataclass(frozen=True, eq=False)
class Anchors:
    """The m candidates of an anchor, best first; weights (m,) 0..1, the best 1.

    trust: 0..1, how much a relation to them counts. count: how many anchors the request speaks of, 0 when it does not
    say.
    """

    boxes: Boxes
    weights: F64
    trust: float = 1.0
    count: int = 0
    is_unique: bool = False  # exactly one thing in the map has the anchor's name

    @classmethod
    def from_scores(cls, scored_parts: Sequence[ScoredCandidates], trust: float, count: int) -> Anchors:
        """Anchors from one or more scored groups of candidates."""
        boxes = concatenate([scored.boxes for scored in scored_parts])
        weights = np.concatenate([scored.relative_scores() for scored in scored_parts])
        order = np.argsort(-weights, kind="stable")
        return cls(
            boxes.take(order), weights[order], trust, count, len(scored_parts) == 1 and scored_parts[0].is_unique
        )

    def top(self, max_count: int) -> Anchors:
        """The best candidates, at most max_count."""
        if len(self.boxes) <= max_count:
            return self
        rows = np.arange(max_count)
        return Anchors(self.boxes.take(rows), self.weights[:max_count], self.trust, self.count, self.is_unique)

    def best(self, min_weight: float = 0.999) -> Boxes:
        """The candidates with at least this weight, but always the best; by default those as good as the best."""
        return self.boxes.take(np.flatnonzero(self.weights >= min(min_weight, self.weights.max(initial=0.0))))


@dataclass(frozen=True, eq=False)
class TargetFits:
    """What a condition says of n targets: values (n,), a sentence for each, and how much the condition counts.

    values: fits 0..1; for ranks a measure, greatest first. margin: ranks closer than this are equal.
    trust: 0..1. known: whether the map holds any evidence.
    """

    values: F64
    sentence: Callable[[int], str]
    margin: float
    trust: float
    known: bool


def match_anchors(
    condition: Condition, targets: Boxes, anchors: Sequence[Anchors], layout: Layout, viewpoints: ViewpointSelector
) -> TargetFits:
    """Evaluate a condition for n targets, each with its best anchor. A target is never its own anchor."""
    name = condition.name
    evaluate = relations_by_name()[name].evaluate
    if not anchors:
        return fits_without_anchor(RelationQuery(name, targets, None, layout, viewpoints))
    first = anchors[0]
    trust = min(anchor.trust for anchor in anchors)
    if name == "between":
        a, b, weights = _anchor_pairs(anchors)
        query = RelationQuery(name, targets, first.boxes.take(a), layout, viewpoints, anchors[-1].boxes.take(b))
        assert query.second_anchors is not None
        is_self = _same_node(targets, first.boxes.take(a)) | _same_node(targets, query.second_anchors)
    else:
        query = RelationQuery(name, targets, first.boxes, layout, viewpoints)
        weights, is_self = first.weights, _same_node(targets, first.boxes)
    fits = evaluate(query)
    trust *= fits.trust
    if name in ("closest", "farthest"):
        return _rank_by_distance(fits, weights, is_self, name, trust, viewpoints.settings.nearness.uncertain_anchor_m)
    assert query.anchors is not None
    values = np.where(is_self, 0.0, fits.values)
    if name not in UNDAMPED and query.anchors.ids and any(query.anchors.ids):
        values = values * np.where(
            in_different_rooms(targets, query.anchors) > 0, viewpoints.settings.nearness.other_room_factor, 1.0
        )
    weighted = values * weights[None]
    best = weighted.argmax(axis=1) if weighted.size else np.zeros(len(targets), np.int64)
    scores = weighted.max(axis=1, initial=0.0)
    if first.count and len(anchors) == 1:
        matching = ((values >= HOLDS) & (weights[None] >= HOLDS)).sum(axis=1)
        scores = scores * np.power(viewpoints.settings.scores.miscount_factor, np.abs(matching - first.count))
    return TargetFits(scores, _sentences(fits, best, is_self, targets, name), 0.0, trust, fits.known)


def fits_without_anchor(query: RelationQuery) -> TargetFits:
    """Evaluate a condition that has no anchor: "in the corner", "leftmost"."""
    fits = relations_by_name()[query.relation].evaluate(query)
    return TargetFits(fits.values[:, 0], lambda i: fits.sentence(i, 0), fits.margin, fits.trust, fits.known)


def _rank_by_distance(
    fits: PairFits, weights: F64, is_self: Bool, name: str, trust: float, uncertain_anchor_m: float
) -> TargetFits:
    """Closest and farthest by the distance to the nearest anchor; a less likely anchor counts as farther away."""
    penalty_m = -uncertain_anchor_m * np.log2(np.maximum(weights, 1e-3))[None]
    distances_m = np.where(is_self, np.inf, np.abs(fits.values) + penalty_m)
    best = distances_m.argmin(axis=1) if distances_m.size else np.zeros(len(distances_m), np.int64)
    nearest = distances_m.min(axis=1, initial=np.inf)
    values = np.where(np.isfinite(nearest), -nearest if name == "closest" else nearest, np.nan)
    return TargetFits(values, lambda i: fits.sentence(i, int(best[i])), fits.margin, trust, fits.known)


def _anchor_pairs(anchors: Sequence[Anchors]) -> tuple[I64, I64, F64]:
    """For "between": rows of the first and of the second anchor of each pair, and the pairs' weights."""
    first, second = anchors[0], anchors[-1]
    n, m = min(len(first.boxes), MAX_ENDS), min(len(second.boxes), MAX_ENDS)
    a, b = (part.ravel() for part in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    same = np.array([first.boxes.ids[i] == second.boxes.ids[j] for i, j in zip(a, b, strict=True)], bool)
    is_repeated = (a >= b) if len(anchors) == 1 else same
    a, b = a[~is_repeated], b[~is_repeated]
    return a, b, first.weights[a] * second.weights[b]


def _same_node(targets: Boxes, anchors: Boxes) -> Bool:
    """(n, m) whether target and anchor are the same node."""
    rows = {name: j for j, name in enumerate(anchors.ids) if name}
    if len(rows) == sum(map(bool, anchors.ids)):
        same = np.zeros((len(targets), len(anchors)), bool)
        for i, name in enumerate(targets.ids):
            if name and name in rows:
                same[i, rows[name]] = True
        return same
    return np.asarray(np.array(targets.ids, object)[:, None] == np.array(anchors.ids, object)[None])


def _sentences(fits: PairFits, best: I64, is_self: Bool, targets: Boxes, name: str) -> Callable[[int], str]:
    def sentence(i: int) -> str:
        if not is_self.shape[1] or is_self[i].all():
            return f"{targets.labels[i]} has nothing to be {name}"
        return fits.sentence(i, int(best[i]))

    return sentence
