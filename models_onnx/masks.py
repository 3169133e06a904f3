"""Masks: from a network's grid of logits to the image, and from the image to the Segments message."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from placegraph.models_onnx import Masks
from placegraph.runtime.arrays import F32, Bool, Points
from placegraph.runtime.messages import Keyframe, Segments


def mask_in_box(logits: F32, scale: Points, offset: Points, box_px: F32, size: tuple[int, int]) -> Bool:
    """A mask of an image (height, width) from logits on another grid, cut to a box (4,) in px.

    scale, offset (2,): pixel x y of the image is at cell (x, y) * scale + offset, whole numbers are centres. Logits are
    resampled bilinearly; positive is inside.
    """
    mask = np.zeros(size, bool)
    x0, y0 = (max(int(v), 0) for v in np.floor(box_px[:2] + 0.5))
    x1, y1 = (min(int(v), limit) for v, limit in zip(np.floor(box_px[2:] + 0.5), size[::-1], strict=True))
    if x1 > x0 and y1 > y0:
        to_cell = np.column_stack((np.diag(scale), np.array([x0, y0]) * scale + offset)).astype(np.float64)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        window = cv2.warpAffine(logits, to_cell, (x1 - x0, y1 - y0), flags=flags, borderMode=cv2.BORDER_REPLICATE)
        mask[y0:y1, x0:x1] = window > 0
    return mask


def pack_segments(keyframe: Keyframe, names: Sequence[str], scores: F32, masks: Masks) -> Segments:
    """Segments of a keyframe: each mask (H, W) cut to the whole-pixel box around it; empty masks are left out.

    `names` and `scores` (N,) belong to the masks, in order.
    """
    kept: list[int] = []
    boxes: list[tuple[int, int, int, int]] = []
    cut_masks: Masks = []
    for i, mask in enumerate(masks):
        columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
        if not len(columns):
            continue
        x0, x1, y0, y1 = int(columns[0]), int(columns[-1]) + 1, int(rows[0]), int(rows[-1]) + 1
        kept.append(i)
        boxes.append((x0, y0, x1, y1))
        cut_masks.append(mask[y0:y1, x0:x1])
    bits, offsets = Segments.pack(cut_masks)
    return Segments(
        frame_id=keyframe.frame_id,
        stamp_ns=keyframe.stamp_ns,
        names=tuple(names[i] for i in kept),
        scores=np.ascontiguousarray(scores[kept], np.float32),
        boxes_px=np.array(boxes, np.int32).reshape(-1, 4),
        mask_bits=bits,
        mask_offsets=offsets,
    )
