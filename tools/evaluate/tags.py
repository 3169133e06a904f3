"""Average precision of an image's tags."""

from __future__ import annotations

import numpy as np

from placegraph.runtime.arrays import F64


def average_precisions(scores: F64, true: F64) -> F64:
    """AP (C,) of scores (V, C) of views and classes; true (V, C) is 1, 0, or NaN where the view does not tell.

    NaN for a class that no view shows. Views of equal score count at once, so that their order plays no part.
    """
    return np.array([_of_class(scores[:, k], true[:, k]) for k in range(scores.shape[1])])


def _of_class(scores: F64, true: F64) -> float:
    known = ~np.isnan(true)
    scores, shown = scores[known], true[known] > 0
    if not shown.any():
        return float("nan")
    order = np.argsort(-scores, kind="stable")
    last = np.append(scores[order][1:] != scores[order][:-1], True)  # of its score
    hits = np.cumsum(shown[order])[last]
    precision = hits / (np.flatnonzero(last) + 1)
    return float((np.diff(hits, prepend=0) * precision).sum() / shown.sum())
