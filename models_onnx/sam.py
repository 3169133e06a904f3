"""SAM and MobileSAM split exports: one pass of the encoder for each image, one of the decoder for each box.

Source: the layout of segment-anything's SamOnnxModel, as published by samexporter: encoder `input_image`, either
(H, W, 3) RGB 0..255 with the preprocessing inside, or (1, 3, 1024, 1024) normalised and padded right and below; decoder
with `image_embeddings`, `point_coords`, `point_labels` (2 and 3: the corners of a box), `mask_input`, `has_mask_input`
and `orig_im_size`.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from placegraph.models_onnx import Masks
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.masks import mask_in_box
from placegraph.models_onnx.session import Session, Shape
from placegraph.runtime.arrays import F32, U8, Bool
from placegraph.runtime.errors import ModelError

LONG_SIDE = 1024  # px of the longer image side in the encoder's input; SAM
MEAN = np.array([123.675, 116.28, 103.53], np.float32)  # RGB of 0..255; SAM
STD = np.array([58.395, 57.12, 57.375], np.float32)
LOW_RES = 256  # px of a low-resolution mask, which covers the whole padded square

DECODER_INPUTS: dict[str, Shape] = {
    "image_embeddings": (1, 256, 64, 64),
    "point_coords": (1, "n", 2),
    "point_labels": (1, "n"),
    "mask_input": (1, 1, LOW_RES, LOW_RES),
    "has_mask_input": (1,),
    "orig_im_size": (2,),
}


class Options(ModelOptions):
    """What differs between SAM weights."""

    min_iou: float = Field(default=0.0, ge=0, le=1)  # a mask predicted to be worse is left empty


class FAMILY:
    """A SAM encoder and decoder as a Segmenter."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load both files and check the layout; raises ModelError when it is not such an export."""
        self._options = weights.parse_options(Options)
        self._encoder = Session(weights.file("encoder"), threads)
        self._decoder = Session(weights.file("decoder"), threads)
        self._input, self._embedding = self._encoder.only_input(), self._encoder.only_output()
        self._raw_image = len(self._encoder.inputs[self._input]) == 3
        shape: Shape = ("H", "W", 3) if self._raw_image else (1, 3, LONG_SIDE, LONG_SIDE)
        self._encoder.expect({self._input: shape}, {self._embedding: (1, 256, 64, 64)})
        self._decoder.expect(DECODER_INPUTS, {"iou_predictions": (1, "M"), "low_res_masks": (1, "M", LOW_RES, LOW_RES)})

    def segment(self, image: U8, depth_m: F32, boxes_px: F32) -> Masks:
        """A mask for each box (N, 4) px of the image; depth is not used.

        Raises:
            ModelError: the networks cannot be run on this image.
        """
        if not len(boxes_px):
            return []
        height, width = image.shape[:2]
        scale = LONG_SIDE / max(height, width)
        new_height, new_width = int(height * scale + 0.5), int(width * scale + 0.5)
        scales = np.array([new_width / width, new_height / height], np.float32)
        embedding = self._encode(image, new_height, new_width)
        return [self._decode(embedding, box, scales, (height, width)) for box in boxes_px]

    def _encode(self, image: U8, new_height: int, new_width: int) -> F32:
        """Image (H, W, 3) resized to its place in the square: embedding (1, 256, 64, 64)."""
        feed = cv2.resize(image, (new_width, new_height), interpolation=cv2.INTER_LINEAR).astype(np.float32)
        if not self._raw_image:
            square = np.zeros((LONG_SIDE, LONG_SIDE, 3), np.float32)  # padded after normalising, so with 0; SAM
            square[:new_height, :new_width] = (feed - MEAN) / STD
            feed = np.ascontiguousarray(square.transpose(2, 0, 1)[None])
        return np.asarray(self._encoder.run({self._input: feed})[self._embedding], np.float32)

    def _decode(self, embedding: F32, box_px: F32, scales: F32, size: tuple[int, int]) -> Bool:
        """One box (4,) px to its mask (H, W): of the masks offered, that with the best predicted IoU."""
        corners = (box_px.reshape(2, 2) * scales).astype(np.float32)
        # The padding point (label -1) is part of the published use; with it, three points make exports that choose
        # among their masks themselves choose the one for unambiguous prompts.
        points = np.concatenate([corners, np.zeros((1, 2), np.float32)])[None]
        outputs = self._decoder.run(
            {
                "image_embeddings": embedding,
                "point_coords": points,
                "point_labels": np.array([[2, 3, -1]], np.float32),
                "mask_input": np.zeros((1, 1, LOW_RES, LOW_RES), np.float32),
                "has_mask_input": np.zeros(1, np.float32),
                "orig_im_size": np.array(size, np.float32),
            }
        )
        quality, low = outputs["iou_predictions"][0], outputs["low_res_masks"][0]
        if low.shape[1:] != (LOW_RES, LOW_RES) or len(low) != len(quality):
            raise ModelError(f"{self._decoder.path}: low_res_masks {low.shape} do not match {len(quality)} predictions")
        best = int(quality.argmax())
        if quality[best] < self._options.min_iou:
            return np.zeros(size, bool)
        return upscale(np.asarray(low[best], np.float32), scales, size)


def upscale(low: F32, scales: F32, size: tuple[int, int]) -> Bool:
    """Low-resolution logits (256, 256) of the padded square to a mask (H, W) of the image: positive inside.

    Not as in SAM: one bilinear step from the logits instead of two through the 1024 px square. The export's own `masks`
    are not used, because tracing freezes the crop of some exports to the aspect of the image they were traced with.
    """
    cells = scales * (LOW_RES / LONG_SIDE)  # low-resolution cells per px of the image
    whole_px = np.array([0, 0, size[1], size[0]], np.float32)
    return mask_in_box(low, cells, 0.5 * cells - 0.5, whole_px, size)
