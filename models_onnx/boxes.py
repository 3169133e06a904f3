"""Boxes of a detector's raw output: overlap and non-maximum suppression."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.models_onnx import NamedBoxes
from placegraph.runtime.arrays import F32, I64
from placegraph.runtime.vision.geometry import box_iou

MAX_CANDIDATES = 1000  # that enter suppression; bounds its time when a network detects things everywhere


def image_box_iou(box: F32, boxes: F32) -> F32:
    """Intersection over union of a box (4,) with boxes (N, 4), px; 0 where both are empty."""
    return np.asarray(box_iou(box.reshape(2, 2), boxes.reshape(-1, 2, 2)), np.float32)


def corners_from_centers(centers: F32) -> F32:
    """(N, 4) cx cy w h to x_min y_min x_max y_max."""
    half = centers[:, 2:] / 2
    return np.concatenate([centers[:, :2] - half, centers[:, :2] + half], axis=1).astype(np.float32)


def non_maximum_suppression(boxes: F32, scores: F32, classes: I64, nms_iou: float) -> I64:
    """Greedily, within each class: indices of the boxes (N, 4) kept, best score first (ties: lower index)."""
    order = np.argsort(-scores, kind="stable")[:MAX_CANDIDATES]
    kept: list[int] = []
    while len(order):
        best, rest = order[0], order[1:]
        kept.append(int(best))
        repeats = (image_box_iou(boxes[best], boxes[rest]) > nms_iou) & (classes[rest] == classes[best])
        order = rest[~repeats]
    return np.array(kept, np.int64)


def best_classes(scores: F32, min_score: float) -> tuple[I64, I64, F32]:
    """Anchors of (A, C) class scores whose best class reaches `min_score`: anchor classes and scores."""
    if scores.shape[1] == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.float32)
    classes = scores.argmax(axis=1)
    best = np.take_along_axis(scores, classes[:, None], axis=1)[:, 0]
    anchors = np.flatnonzero(best >= min_score)
    return anchors, classes[anchors], best[anchors].astype(np.float32)


def named_boxes(names: Sequence[str], classes: I64, boxes: F32, scores: F32) -> NamedBoxes:
    """Boxes (N, 4) of class indices (N,) as named boxes; empty ones (all outside the image) are left out."""
    has_area = np.all(boxes[:, 2:] > boxes[:, :2], axis=1)
    kept_names = tuple(names[i] for i in classes[has_area].tolist())
    clipped = np.clip(scores[has_area], 0, 1).astype(np.float32)
    return NamedBoxes(kept_names, np.ascontiguousarray(boxes[has_area], np.float32), clipped)
