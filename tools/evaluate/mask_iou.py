"""Intersection over union of masks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.runtime.arrays import F64, Bool


def mask_overlaps(masks: Sequence[Bool], true_masks: Sequence[Bool]) -> F64:
    """(N,) IoU of each mask (H, W) with the true one at the same index; NaN where both are empty."""
    values = []
    for mask, true_mask in zip(masks, true_masks, strict=True):
        union = int((mask | true_mask).sum())
        values.append(int((mask & true_mask).sum()) / union if union else float("nan"))
    return np.array(values, np.float64)
