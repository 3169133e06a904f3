"""How well masks cover what they should."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.runtime.arrays import F64, Bool


def mask_overlaps(found: Sequence[Bool], true: Sequence[Bool]) -> F64:
    """(N,) intersection over union of each found mask (H, W) with the true one of its place; NaN where both are empty.

    Their mean is the mean IoU.
    """
    values = []
    for one, other in zip(found, true, strict=True):
        union = int((one | other).sum())
        values.append(int((one & other).sum()) / union if union else float("nan"))
    return np.array(values, np.float64)
