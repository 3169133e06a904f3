"""Average precision of boxes in images, as COCO computes it at one overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64, I64, Bool
from placegraph.runtime.vision.geometry import box_iou

MAX_BOXES = 100  # of one image count, best first; COCO's maxDets
RECALLS = np.linspace(0, 1, 101)  # at which the precision is read; COCO


@dataclass(frozen=True, eq=False)
class FoundBoxes:
    """What a detector found in one image: boxes (N, 4) x0 y0 x1 y1 in px, classes (N,), scores (N,)."""

    boxes: F64
    classes: I64
    scores: F64


@dataclass(frozen=True, eq=False)
class TrueBoxes:
    """What one image shows: boxes (M, 4) x0 y0 x1 y1 in px, classes (M,), and which are too poor to ask for (M,)."""

    boxes: F64
    classes: I64
    ignored: Bool


def average_precisions(
    found: Sequence[FoundBoxes], true: Sequence[TrueBoxes], classes: int, min_iou: float = 0.5
) -> F64:
    """AP (classes,) over images in order; NaN where a class has no truth that counts.

    Best score first, a box takes the free true box of its class that it overlaps most, by `min_iou` at least; one
    that overlaps only an ignored true box so much is neither right nor wrong.
    """
    limited = [_best(one) for one in found]
    return np.array([_of_class(limited, true, k, min_iou) for k in range(classes)])


def mean_of_known(values: F64) -> float:
    """Mean of what is not NaN; NaN when there is nothing."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")


def _best(found: FoundBoxes) -> FoundBoxes:
    order = np.argsort(-found.scores, kind="stable")[:MAX_BOXES]
    return FoundBoxes(found.boxes[order], found.classes[order], found.scores[order])


def _of_class(found: Sequence[FoundBoxes], true: Sequence[TrueBoxes], k: int, min_iou: float) -> float:
    scores, right, count = [np.zeros(0)], [np.zeros(0, bool)], 0
    for one, truth in zip(found, true, strict=True):
        mine, theirs = one.classes == k, truth.classes == k
        counts = theirs & ~truth.ignored
        count += int(counts.sum())
        if not mine.any():
            continue
        hit = _matched(one.boxes[mine], truth.boxes[counts], min_iou)
        aside = overlaps(one.boxes[mine], truth.boxes[theirs & truth.ignored]).max(axis=1, initial=0) >= min_iou
        judged = hit | ~aside
        scores.append(one.scores[mine][judged])
        right.append(hit[judged])
    if not count:
        return float("nan")
    return _interpolated(np.concatenate(scores), np.concatenate(right), count)


def _matched(boxes: F64, true: F64, min_iou: float) -> Bool:
    """Which boxes (N, 4), best first, find a true box (M, 4) of their own."""
    hit = np.zeros(len(boxes), bool)
    if len(true):
        iou = overlaps(boxes, true)
        for i in range(len(boxes)):
            j = int(iou[i].argmax())
            if iou[i, j] >= min_iou:
                hit[i] = True
                iou[:, j] = -1
    return hit


def _interpolated(scores: F64, right: Bool, count: int) -> float:
    """Mean over RECALLS of the best precision at that recall or beyond it, 0 where it is never reached."""
    hits = np.cumsum(right[np.argsort(-scores, kind="stable")])
    precision = hits / np.arange(1, len(hits) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    at = np.searchsorted(hits / count, RECALLS - 1e-9)  # the slack: 3 / 10 is not .3
    return float(np.append(envelope, 0.0)[at].mean())


def overlaps(a: F64, b: F64) -> F64:
    """(N, M) intersection over union of boxes (N, 4) and (M, 4) x0 y0 x1 y1; 0 where both are empty."""
    return np.asarray(box_iou(a.reshape(-1, 1, 2, 2), b.reshape(1, -1, 2, 2)), np.float64)
