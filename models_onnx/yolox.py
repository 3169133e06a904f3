"""YOLOX exports: raw head outputs on the grids of three strides. Fixed classes.

Source: the layout of the official ONNX export (Megvii-BaseDetection/YOLOX, demo/ONNXRuntime): input (1, 3, S, S) BGR
0..255, letterboxed top left with grey 114; output (1, A, 5 + C) with, per anchor, centre offset and log size in grid
cells, objectness and class probabilities.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.models_onnx import NamedBoxes, boxes
from placegraph.models_onnx.letterbox import letterbox_image
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.session import Session
from placegraph.runtime.arrays import F32, I64, U8
from placegraph.runtime.errors import ModelError

STRIDES = (8, 16, 32)


class Options(ModelOptions):
    """What differs between YOLOX weights."""

    min_score: float = 0.1  # floor of objectness x class probability; the official demo shows from .3
    nms_iou: float = 0.45  # official demo


class FAMILY:
    """A YOLOX network as a Detector."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load and check the layout; raises ModelError when it is not such an export."""
        self._options = weights.parse_options(Options)
        self._labels = weights.class_names()
        self._session = Session(weights.file("model"), threads)
        self._input, self._output = self._session.only_input(), self._session.only_output()
        self._session.expect({self._input: (1, 3, "S", "T")}, {self._output: (1, "A", 5 + len(self._labels))})
        height, width = self._session.inputs[self._input][2:]
        if not isinstance(height, int) or not isinstance(width, int) or height % 32 or width % 32:
            raise ModelError(f"{self._session.path}: input must have a fixed size of whole strides of 32 px")
        self._height, self._width = height, width
        self._cells, self._strides = _grid(height, width)

    def detect(self, image: U8, names: Sequence[str]) -> NamedBoxes:
        """Boxes of the network's own classes; `names` are ignored. Raises ModelError when it cannot be run."""
        canvas, placed = letterbox_image(image, self._height, self._width, centered=False)
        feed = canvas[:, :, ::-1].astype(np.float32).transpose(2, 0, 1)[None]
        raw = self._session.run({self._input: np.ascontiguousarray(feed)})[self._output][0]
        if len(raw) != len(self._cells):
            raise ModelError(f"{self._session.path}: {len(raw)} anchors, expected {len(self._cells)} of {STRIDES}")
        anchors, classes, scores = boxes.best_classes(raw[:, 4:5] * raw[:, 5:], self._options.min_score)
        boxes_px = placed.to_image(boxes.corners_from_centers(self._decode(raw[anchors, :4], anchors)))
        kept = boxes.non_maximum_suppression(boxes_px, scores, classes, self._options.nms_iou)
        return boxes.named_boxes(self._labels, classes[kept], boxes_px[kept], scores[kept])

    def _decode(self, raw: F32, anchors: I64) -> F32:
        """Grid offsets and log sizes (K, 4) to cx cy w h in px of the input."""
        strides = self._strides[anchors, None]
        centers = (raw[:, :2] + self._cells[anchors]) * strides
        sizes = np.exp(np.minimum(raw[:, 2:], 10)) * strides  # e^10 cells exceed any input: only guards the overflow
        return np.concatenate([centers, sizes], axis=1).astype(np.float32)


def _grid(height: int, width: int) -> tuple[F32, F32]:
    """Column and row of each anchor (A, 2) and its stride in px (A,), finest grid first, row by row."""
    cells, strides = [], []
    for stride in STRIDES:
        rows, columns = np.mgrid[: height // stride, : width // stride]
        cells.append(np.stack([columns.ravel(), rows.ravel()], axis=1))
        strides.append(np.full(rows.size, stride))
    return np.concatenate(cells).astype(np.float32), np.concatenate(strides).astype(np.float32)
