"""Spatial relations, computed when a question needs them: one family per module, each exporting RELATION.

A family maps relation names to the phrases that trigger them and judges targets against anchors by their boxes.
Nothing is forced: outside its margin a relation does not hold, and the evidence sentence says so with the numbers.
Source: METHOD section 9; paper, "Selecting Related Objects" (semantic and metric edges between targets and anchors).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.node import available, plugin
from placegraph.runtime.scene_graph import Node

F64 = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """From where left, right, front and behind are meant: (3,) metres, world frame, and whose place that is."""

    source: str  # "asker" or "room centre"
    xyz_world: F64


@dataclass(frozen=True, eq=False)
class Case:
    """What is asked of a relation: which of the targets stand so to one of the anchor tuples."""

    relation: str
    targets: Sequence[Node]
    anchors: Sequence[tuple[Node, ...]]  # alternatives; one node each, two for "between", empty for ranks
    viewpoints: dict[str, Viewpoint]  # by node id, one for each target and anchor
    room_boxes: dict[str, F64]  # (2, 3) box of the room that holds a node, by node id; empty: in no room
    ordinal: int = 1  # 1: the first by rank, 2: the second, ...


@dataclass(frozen=True)
class Verdict:
    """How well one target fits: score 0..1, whether the relation holds, and the sentence that says why."""

    score: float
    holds: bool
    sentence: str
    anchor_ids: tuple[str, ...] = ()


@dataclass(frozen=True)
class Relation:
    """One family: trigger phrases by relation name, anchors each takes, and the judge (one verdict a target)."""

    phrases: dict[str, tuple[str, ...]]
    anchors: dict[str, tuple[int, int]]  # fewest and most anchors by relation name
    judge: Callable[[Case], list[Verdict]]


@cache
def families() -> dict[str, Relation]:
    """Every relation name with its family, found by file name."""
    found: dict[str, Relation] = {}
    for module in available(__package__ or ""):
        family: Relation = plugin(__package__ or "", module, "RELATION", "relation")
        found.update(dict.fromkeys(family.phrases, family))
    return found


@cache
def triggers() -> dict[tuple[str, ...], str]:
    """Trigger phrases as word tuples to relation names; a phrase belongs to one relation."""
    return {
        tuple(phrase.split()): name for name, family in sorted(families().items()) for phrase in family.phrases[name]
    }


def is_rank(relation: str) -> bool:
    """Whether a relation orders the targets (largest, leftmost, closest), so that an ordinal counts."""
    return families()[relation].anchors[relation][0] == 0 and not relation.startswith(("in the", "against"))


def label(node: Node) -> str:
    """A node in a sentence: `chair O3`."""
    return f"{node.name} {node.id}"


def best_over_anchors(case: Case, judge_pair: Callable[[Node, tuple[Node, ...]], Verdict]) -> list[Verdict]:
    """For each target the best verdict over the anchor tuples it is not part of; the first one among equals."""
    verdicts = []
    for target in case.targets:
        pairs = [anchors for anchors in case.anchors if target.id not in {anchor.id for anchor in anchors}]
        judged = [judge_pair(target, anchors) for anchors in pairs]
        if judged:
            verdicts.append(max(judged, key=lambda verdict: (verdict.holds, verdict.score)))
        else:
            verdicts.append(Verdict(0.0, False, f"{label(target)} has nothing to be {case.relation} to"))
    return verdicts


def ranked(case: Case, values: Sequence[float], margin: float, sentences: Sequence[str]) -> list[Verdict]:
    """Verdicts of a superlative: values (N,), greatest first. The n-th holds; those within the margin of it hold too.

    margin: in the unit of the values; two targets closer than that cannot be told apart.
    """
    order = sorted(range(len(values)), key=lambda i: (-values[i], i))
    if case.ordinal > len(order):
        return [Verdict(0.0, False, f"{text}; there are only {len(order)}, not {case.ordinal}") for text in sentences]
    wanted = values[order[case.ordinal - 1]]
    place = {i: rank + 1 for rank, i in enumerate(order)}
    verdicts = []
    for i, value in enumerate(values):
        holds = abs(value - wanted) <= margin or place[i] == case.ordinal
        # a near miss keeps some score, so that candidates are listed in a sensible order
        score = 1.0 if place[i] == case.ordinal else 0.97 if holds else 0.5 / (1 + abs(place[i] - case.ordinal))
        verdicts.append(Verdict(score, holds, f"{sentences[i]}, number {place[i]} of {len(order)}"))
    return verdicts


def overlap_xy(a: F64, b: F64) -> float:
    """Share 0..1 of the smaller footprint of two (2, 3) boxes that lies over the other; thin ones grow by 1 cm."""
    low, high = np.maximum(a[0, :2], b[0, :2]), np.minimum(a[1, :2], b[1, :2])
    common = np.prod(np.clip(high - low, 0, None) + 0.01 * (high >= low))
    smaller = min(np.prod(a[1, :2] - a[0, :2] + 0.01), np.prod(b[1, :2] - b[0, :2] + 0.01))
    return float(min(common / smaller, 1.0))
