"""Average precision of an image's tags."""

from __future__ import annotations

import numpy as np

from placegraph.runtime.arrays import F64


def average_precisions(scores: F64, true: F64) -> F64:
    """AP (C,) of scores (V, C) of views and classes; true (V, C) is 1, 0, or NaN where the view does not say.

    NaN for a class that no view shows. Views of equal score count together, so that their order does not matter.
    """
    return np.array([_class_average_precision(scores[:, k], true[:, k]) for k in range(scores.shape[1])])


def _class_average_precision(scores: F64, true: F64) -> float:
    judged = ~np.isnan(true)
    scores, shown = scores[judged], true[judged] > 0
    if not shown.any():
        return float("nan")
    order = np.argsort(-scores, kind="stable")
    last_of_score = np.append(scores[order][1:] != scores[order][:-1], True)
    hits = np.cumsum(shown[order])[last_of_score]
    precision = hits / (np.flatnonzero(last_of_score) + 1)
    return float((np.diff(hits, prepend=0) * precision).sum() / shown.sum())
