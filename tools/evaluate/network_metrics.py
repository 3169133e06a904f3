"""Metrics of networks: average precision of boxes (as COCO computes it at one overlap) and of tags, IoU of masks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64, I64, Bool
from placegraph.runtime.vision.geometry import box_iou

MAX_BOXES = 100  # of one image that count, best first; COCO's maxDets
RECALLS = np.linspace(0, 1, 101)  # at which the precision is read; COCO


@dataclass(frozen=True, eq=False)
class DetectedBoxes:
    """What a detector gave for one image: boxes (N, 4) x0 y0 x1 y1 in px, classes (N,), scores (N,)."""

    boxes: F64
    classes: I64
    scores: F64


@dataclass(frozen=True, eq=False)
class TrueBoxes:
    """What one image shows: boxes (M, 4) x0 y0 x1 y1 in px, classes (M,), and which do not count for recall (M,)."""

    boxes: F64
    classes: I64
    ignored: Bool


def box_average_precisions(
    detected: Sequence[DetectedBoxes], true: Sequence[TrueBoxes], classes: int, min_iou: float = 0.5
) -> F64:
    """AP (classes,) over images in order; NaN where no true box of a class counts.

    Best score first, a box takes the free true box of its class that it overlaps most, by `min_iou` at least; one that
    overlaps only an ignored true box by that much is neither right nor wrong.
    """
    best = [_best(boxes) for boxes in detected]
    return np.array([_box_average_precision(best, true, k, min_iou) for k in range(classes)])


def mean_of_defined(values: F64) -> float:
    """Mean of the values that are not NaN; NaN when there are none."""
    defined = values[~np.isnan(values)]
    return float(defined.mean()) if len(defined) else float("nan")


def _best(detected: DetectedBoxes) -> DetectedBoxes:
    order = np.argsort(-detected.scores, kind="stable")[:MAX_BOXES]
    return DetectedBoxes(detected.boxes[order], detected.classes[order], detected.scores[order])


def _box_average_precision(
    detected: Sequence[DetectedBoxes], true: Sequence[TrueBoxes], class_index: int, min_iou: float
) -> float:
    scores, right, count = [np.zeros(0)], [np.zeros(0, bool)], 0
    for boxes, truth in zip(detected, true, strict=True):
        of_class, true_of_class = boxes.classes == class_index, truth.classes == class_index
        counted = true_of_class & ~truth.ignored
        count += int(counted.sum())
        if not of_class.any():
            continue
        hit = _hits(boxes.boxes[of_class], truth.boxes[counted], min_iou)
        ignored_iou = box_ious(boxes.boxes[of_class], truth.boxes[true_of_class & truth.ignored])
        judged = hit | (ignored_iou.max(axis=1, initial=0) < min_iou)
        scores.append(boxes.scores[of_class][judged])
        right.append(hit[judged])
    if not count:
        return float("nan")
    return _interpolated_precision(np.concatenate(scores), np.concatenate(right), count)


def _hits(boxes: F64, true: F64, min_iou: float) -> Bool:
    """Which boxes (N, 4), best first, get a true box (M, 4) of their own."""
    hit = np.zeros(len(boxes), bool)
    if len(true):
        iou = box_ious(boxes, true)
        for i in range(len(boxes)):
            j = int(iou[i].argmax())
            if iou[i, j] >= min_iou:
                hit[i] = True
                iou[:, j] = -1
    return hit


def _interpolated_precision(scores: F64, right: Bool, count: int) -> float:
    """Mean over RECALLS of the best precision at that recall or beyond it, 0 where it is never reached."""
    hits = np.cumsum(right[np.argsort(-scores, kind="stable")])
    precision = hits / np.arange(1, len(hits) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    at = np.searchsorted(hits / count, RECALLS - 1e-9)  # the slack: in floating point 3 / 10 is not .3
    return float(np.append(envelope, 0.0)[at].mean())


def box_ious(a: F64, b: F64) -> F64:
    """(N, M) intersection over union of boxes (N, 4) and (M, 4) x0 y0 x1 y1; 0 where both are empty."""
    return np.asarray(box_iou(a.reshape(-1, 1, 2, 2), b.reshape(1, -1, 2, 2)), np.float64)


def tag_average_precisions(scores: F64, true: F64) -> F64:
    """AP (C,) of scores (V, C) of views and classes; true (V, C) is 1, 0, or NaN where the view does not say.

    NaN for a class that no view shows. Views of equal score count together, so that their order does not matter.
    """
    return np.array([_tag_average_precision(scores[:, k], true[:, k]) for k in range(scores.shape[1])])


def _tag_average_precision(scores: F64, true: F64) -> float:
    judged = ~np.isnan(true)
    scores, shown = scores[judged], true[judged] > 0
    if not shown.any():
        return float("nan")
    order = np.argsort(-scores, kind="stable")
    last_of_score = np.append(scores[order][1:] != scores[order][:-1], True)
    hits = np.cumsum(shown[order])[last_of_score]
    precision = hits / (np.flatnonzero(last_of_score) + 1)
    return float((np.diff(hits, prepend=0) * precision).sum() / shown.sum())


def mask_ious(masks: Sequence[Bool], true_masks: Sequence[Bool]) -> F64:
    """(N,) IoU of each mask (H, W) with the true one at the same index; NaN where both are empty."""
    values = []
    for mask, true_mask in zip(masks, true_masks, strict=True):
        union = int((mask | true_mask).sum())
        values.append(int((mask & true_mask).sum()) / union if union else float("nan"))
    return np.array(values, np.float64)
