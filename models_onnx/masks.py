"""Masks of the whole image to the Segments message."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.models_onnx import Masks
from placegraph.runtime.arrays import F32
from placegraph.runtime.messages import Keyframe, Segments


def pack_segments(keyframe: Keyframe, names: Sequence[str], scores: F32, masks: Masks) -> Segments:
    """Segments of a keyframe: each mask (H, W) cut to the whole-pixel box around it; empty masks are left out.

    `names` and `scores` (N,) belong to the masks, in order.
    """
    kept: list[int] = []
    boxes: list[tuple[int, int, int, int]] = []
    cut: Masks = []
    for i, mask in enumerate(masks):
        columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
        if not len(columns):
            continue
        x0, x1, y0, y1 = int(columns[0]), int(columns[-1]) + 1, int(rows[0]), int(rows[-1]) + 1
        kept.append(i)
        boxes.append((x0, y0, x1, y1))
        cut.append(mask[y0:y1, x0:x1])
    bits, offsets = Segments.pack(cut)
    return Segments(
        frame_id=keyframe.frame_id,
        stamp_ns=keyframe.stamp_ns,
        names=tuple(names[i] for i in kept),
        scores=np.ascontiguousarray(scores[kept], np.float32),
        boxes_px=np.array(boxes, np.int32).reshape(-1, 4),
        mask_bits=bits,
        mask_offsets=offsets,
    )
