"""Spatial relations, computed when a question needs them: one group of relations per module, exported as RELATION.

A module evaluates all pairs of targets and anchors at once from their boxes. A relation's fit is 0..1 and holds from
0.5 on. A rank ("closest", "leftmost") gives a measure instead, greatest first. Each pair has a sentence with numbers.
Source: paper, "Selecting Related Objects" (semantic and metric edges between targets and anchors).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes, Layout
from placegraph.nodes.grounding.settings import GroundingSettings
from placegraph.nodes.grounding.viewpoint import ViewpointSelector
from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.node import available, plugin

HOLDS = 0.5  # a relation holds from this fit on


@dataclass(frozen=True, eq=False)
class RelationQuery:
    """The input of a relation: n targets and m anchors; no anchors for `corner` and ranks without a thing.

    second_anchors: for "between", the other anchor of each pair. reference: anchors of the targets' other conditions,
    which give ranks their viewpoint when nothing else does.
    """

    relation: str
    targets: Boxes
    anchors: Boxes | None
    layout: Layout
    viewpoints: ViewpointSelector
    second_anchors: Boxes | None = None
    reference: Boxes | None = None

    @property
    def settings(self) -> GroundingSettings:
        """The numbers of all relations."""
        return self.viewpoints.settings


@dataclass(frozen=True, eq=False)
class PairFits:
    """The output of a relation: values (n, m), m = 1 without anchors, and the sentence of each pair.

    margin: rank measures closer than this are equal. trust: 0..1, how much it counts; lower without a named viewpoint.
    """

    values: F64
    sentence: Callable[[int, int], str]
    margin: float = 0.0
    trust: float = 1.0
    known: bool = True  # False: the map holds no evidence for it


@dataclass(frozen=True)
class Relation:
    """The relations of one module: the phrases by which the rule parser knows each, and the function for all."""

    phrases: dict[str, tuple[str, ...]]
    evaluate: Callable[[RelationQuery], PairFits]


@cache
def relations_by_name() -> dict[str, Relation]:
    """The relation module of each relation and rank name in `CONDITIONS`."""
    relations: dict[str, Relation] = {}
    for module in available(__package__ or ""):
        family: Relation = plugin(__package__ or "", module, "RELATION", "relation")
        relations.update(dict.fromkeys(family.phrases, family))
    return relations


@cache
def trigger_phrases() -> dict[tuple[str, ...], str]:
    """Relation names by trigger phrase (a tuple of words); a phrase belongs to one relation."""
    return {
        tuple(phrase.split()): name
        for name, family in sorted(relations_by_name().items())
        for phrase in family.phrases[name]
    }


def axis_gaps_m(a: Boxes, b: Boxes) -> F64:
    """(n, m, 3) gap in metres between boxes along each axis; negative where they overlap."""
    return np.maximum(a.low[:, None] - b.high[None], b.low[None] - a.high[:, None])


def distance_m(gaps: F64) -> F64:
    """(n, m) metres between the surfaces of boxes; 0 when they touch. gaps: of `axis_gaps_m`."""
    return np.asarray(np.linalg.norm(np.maximum(gaps, 0), axis=2))


def horizontal_distance_m(gaps: F64) -> F64:
    """(n, m) horizontal metres between the boxes' footprints."""
    return np.asarray(np.linalg.norm(np.maximum(gaps[..., :2], 0), axis=2))


def decay(values_m: F64, half_m: float) -> F64:
    """Exponential decay: 1 at 0 m, 0.5 at half_m."""
    return np.asarray(np.power(0.5, np.maximum(values_m, 0) / half_m))


def footprint_overlap(targets: Boxes, anchors: Boxes, gaps: F64, *, smaller: bool = False) -> F64:
    """(n, m) share of the target's footprint (smaller: of the smaller footprint) that overlaps the anchor's."""
    low = np.maximum(targets.low[:, None, :2], anchors.low[None, :, :2])
    high = np.minimum(targets.high[:, None, :2], anchors.high[None, :, :2])
    common = np.prod(np.clip(high - low, 0, None) + 0.01 * (high >= low), axis=2)
    area = np.prod(targets.size[:, :2] + 0.01, axis=1)[:, None]
    if smaller:
        area = np.minimum(area, np.prod(anchors.size[:, :2] + 0.01, axis=1)[None])
    return np.asarray(np.minimum(common / area, 1.0) * (gaps[..., :2].max(axis=2) <= 0))


def rank_positions(values: F64) -> I64:
    """(n,) the rank of each value, 1 for the greatest; equal values keep their order."""
    places = np.empty(len(values), np.int64)
    places[np.argsort(-values, kind="stable")] = np.arange(1, len(values) + 1)
    return places
