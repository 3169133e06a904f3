"""Our box-prompted segmenter: one pass of the encoder for each image, one of the decoder for all of its boxes.

The split is SAM's, the layout ours: encoder `images` (1, 3, H, W) RGB 0..1, letterboxed in the middle with grey 114,
and, in exports that take it, `depth` (1, 1, H, W) metres (0 = none), to `image_embeddings`; decoder `image_embeddings`
and `boxes` (N, 4) x0 y0 x1 y1 as shares of the input, to `masks` (N, 1, G, G) logits and `iou_predictions` (N, 1).
Not as in SAM: a mask's grid covers its box, grown by a margin, not the whole image, so small things keep their shape.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from placegraph.models_onnx import Masks
from placegraph.models_onnx.letterbox import Letterbox
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.masks import mask_in_box
from placegraph.models_onnx.session import Session
from placegraph.models_onnx.yolo import prepare_input
from placegraph.runtime.arrays import F32, U8, Bool
from placegraph.runtime.errors import ModelError


class Options(ModelOptions):
    """What differs between such weights."""

    margin: float = Field(default=0.08, ge=0)  # by which a grid exceeds its box on each side, by the box's size
    min_iou: float = Field(default=0.0, ge=0, le=1)  # a mask predicted to be worse is left empty


class FAMILY:
    """Encoder and decoder as a Segmenter; depth is used when the encoder has an input for it."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load both files and check the layout; raises ModelError when it is not such an export."""
        self._options = weights.parse_options(Options)
        self._encoder = Session(weights.file("encoder"), threads)
        self._decoder = Session(weights.file("decoder"), threads)
        self._takes_depth = "depth" in self._encoder.inputs
        inputs: dict[str, tuple[int | str, ...]] = {"images": (1, 3, "H", "W")}
        if self._takes_depth:
            inputs["depth"] = (1, 1, "H", "W")
        sizes = self._encoder.expect(inputs, {"image_embeddings": (1, "C", "h", "w")})
        if sizes.keys() < set("HWChw"):
            raise ModelError(f"{self._encoder.path}: every size but the number of boxes must be fixed")
        self._height, self._width = sizes["H"], sizes["W"]
        self._decoder.expect(
            {"image_embeddings": (1, sizes["C"], sizes["h"], sizes["w"]), "boxes": ("N", 4)},
            {"masks": ("N", 1, "G", "G"), "iou_predictions": ("N", 1)},
        )

    def segment(self, image: U8, depth_m: F32, boxes_px: F32) -> Masks:
        """A mask for each box (N, 4) px of the image; depth is used by exports that take it.

        Raises:
            ModelError: the networks cannot be run on this image.
        """
        if not len(boxes_px):
            return []
        height, width = image.shape[:2]
        feed, placed = prepare_input(image, self._height, self._width)
        feeds = {"images": feed}
        if self._takes_depth:
            feeds["depth"] = self._place_depth(depth_m, placed)
        embedding = self._encoder.run(feeds)["image_embeddings"]
        shares = placed.to_input(boxes_px) / np.array([self._width, self._height] * 2, np.float32)
        outputs = self._decoder.run({"image_embeddings": embedding, "boxes": shares.astype(np.float32)})
        return [
            self._mask(logits[0], box, (height, width))
            if quality[0] >= self._options.min_iou
            else np.zeros((height, width), bool)
            for logits, quality, box in zip(outputs["masks"], outputs["iou_predictions"], boxes_px, strict=True)
        ]

    def _place_depth(self, depth_m: F32, placed: Letterbox) -> F32:
        """Depth (H, W) placed as the image is; nearest neighbour, because a mean of two surfaces lies on neither."""
        canvas = np.zeros((self._height, self._width), np.float32)
        width, height = round(placed.scale_x * placed.width), round(placed.scale_y * placed.height)
        resized = cv2.resize(depth_m, (width, height), interpolation=cv2.INTER_NEAREST)
        canvas[placed.pad_y : placed.pad_y + height, placed.pad_x : placed.pad_x + width] = resized
        return canvas[None, None]

    def _mask(self, logits: F32, box_px: F32, size: tuple[int, int]) -> Bool:
        """One grid of logits (G, G) to the mask (H, W) of the image, cut to the box."""
        box_size = np.maximum(box_px[2:] - box_px[:2], 1e-3).astype(np.float64)  # a box without area has no mask anyway
        low = box_px[:2] - self._options.margin * box_size
        scale = len(logits) / ((1 + 2 * self._options.margin) * box_size)  # cells per px
        return mask_in_box(logits, scale, (0.5 - low) * scale - 0.5, box_px, size)
