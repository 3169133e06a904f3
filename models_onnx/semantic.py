"""Read semantic segmentation exports: one class a pixel, split into connected pieces that stand for instances.

Layout: input (1, 3, H, W) float32, R G B; output (1, C, h, w) logits, C as many as labels. Two things of one class
that touch in the image come out as one piece: nothing in such an export tells them apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from placegraph.models_onnx import Boxes, Instances, Masks, ScoredNames
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.session import Session
from placegraph.runtime.arrays import F32, U8, Bool
from placegraph.runtime.errors import ModelError
from placegraph.runtime.vision.geometry import box_iou


class Options(ModelOptions):
    """What differs between semantic segmentation weights."""

    ignore: list[str] = Field(default_factory=list)  # labels that are no objects: background, wall, floor
    min_confidence: float = Field(0.5, ge=0, le=1)  # softmax of a pixel's class; less sure pixels belong to nothing
    min_area_px: int = Field(64, ge=1)  # px of the image; a smaller piece is noise more often than a thing
    mean: list[float] = Field([0.0, 0.0, 0.0], min_length=3, max_length=3)  # of 0..255 values, R G B
    std: list[float] = Field([255.0, 255.0, 255.0], min_length=3, max_length=3)


class FAMILY:
    """A semantic segmentation network as InstanceSegmenter, Detector, Tagger, and Segmenter prompted by boxes."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load and check the layout; raises ModelError when it is not such an export."""
        self._options = weights.parse_options(Options)
        self._labels = weights.class_names()
        unknown = sorted(set(self._options.ignore) - set(self._labels))
        if unknown:
            raise ModelError(f"weights {weights.name!r}, options: ignore: no label named {', '.join(unknown)}")
        self._session = Session(weights.file("model"), threads)
        self._input, self._output = self._session.only_input(), self._session.only_output()
        self._session.expect({self._input: (1, 3, "H", "W")}, {self._output: (1, len(self._labels), "h", "w")})
        self._objects = [i for i, label in enumerate(self._labels) if label not in self._options.ignore]
        self._mean = np.array(self._options.mean, np.float32)
        self._std = np.array(self._options.std, np.float32)

    def instances(self, image: U8, names: Sequence[str]) -> Instances:
        """Boxes of the network's own classes with a mask each, surest first; `names` are ignored.

        A piece's score is the mean confidence of its pixels. Raises ModelError when the network cannot be run.
        """
        labels, confidence = self.classify(image)
        found: list[tuple[float, str, list[int], Bool]] = []
        sure = confidence >= self._options.min_confidence
        for label in self._objects:
            of_class = ((labels == label) & sure).astype(np.uint8)
            count, pieces, stats, _ = cv2.connectedComponentsWithStats(of_class, connectivity=8)
            for piece in range(1, count):
                x, y, width, height, area = (int(value) for value in stats[piece])
                if area >= self._options.min_area_px:
                    mask = np.asarray(pieces == piece)
                    score = float(confidence[mask].mean(dtype=np.float64))
                    found.append((score, self._labels[label], [x, y, x + width, y + height], mask))
        found.sort(key=lambda item: -item[0])  # stable: equal scores stay in order of class, then of first row
        boxes = Boxes(
            names=tuple(name for _, name, _, _ in found),
            boxes_px=np.array([box for _, _, box, _ in found], np.float32).reshape(-1, 4),
            scores=np.array([score for score, _, _, _ in found], np.float32),
        )
        return Instances(boxes, [mask for _, _, _, mask in found])

    def detect(self, image: U8, names: Sequence[str]) -> Boxes:
        """Boxes of the network's own classes; `names` are ignored. Raises ModelError when it cannot be run."""
        return self.instances(image, names).boxes

    def tag(self, image: U8) -> ScoredNames:
        """Each class that has a piece in the image, with its surest piece's score. Raises ModelError."""
        best: dict[str, np.float32] = {}
        boxes = self.detect(image, ())
        for name, score in zip(boxes.names, boxes.scores, strict=True):
            best.setdefault(name, score)  # boxes come surest first
        return ScoredNames(tuple(best), np.array(list(best.values()), np.float32))

    def segment(self, image: U8, depth_m: F32, boxes_px: F32) -> Masks:
        """A mask for each box (N, 4) px: the piece whose box fits it best by IoU, empty where none overlaps.

        Depth is not used. Raises ModelError when the network cannot be run.
        """
        if not len(boxes_px):
            return []
        pieces = self.instances(image, ())
        nothing = np.zeros(image.shape[:2], bool)
        masks: Masks = []
        for box in boxes_px:
            overlap = box_iou(box.reshape(2, 2), pieces.boxes.boxes_px.reshape(-1, 2, 2))
            best = int(overlap.argmax()) if len(overlap) else -1
            masks.append(pieces.masks[best] if best >= 0 and overlap[best] > 0 else nothing)
        return masks

    def classify(self, image: U8) -> tuple[NDArray[np.intp], F32]:
        """Class index (H, W) and its softmax probability (H, W) of each pixel of `image` (H, W, 3) uint8 sRGB.

        Raises ModelError when the network cannot be run on this image.
        """
        height, width = image.shape[:2]
        logits = self._session.run({self._input: self.prepare(image)})[self._output][0]
        labels = logits.argmax(axis=0)
        top = logits.max(axis=0)
        confidence = np.asarray(1 / np.exp(logits - top).sum(axis=0), np.float32)
        if labels.shape != (height, width):  # nearest: between class 2 and class 4 there is no class 3
            labels = cv2.resize(labels.astype(np.int32), (width, height), interpolation=cv2.INTER_NEAREST).astype(
                np.intp
            )
            confidence = np.asarray(
                cv2.resize(confidence, (width, height), interpolation=cv2.INTER_NEAREST), np.float32
            )
        return labels, confidence

    def prepare(self, image: U8) -> F32:
        """(H, W, 3) uint8 sRGB to the input (1, 3, H', W'), squashed to the size that the export fixes, if it does."""
        fixed = self._session.inputs[self._input]
        height = fixed[2] if isinstance(fixed[2], int) else image.shape[0]
        width = fixed[3] if isinstance(fixed[3], int) else image.shape[1]
        if (height, width) != image.shape[:2]:
            image = np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
        scaled = (image.astype(np.float32) - self._mean) / self._std
        return np.ascontiguousarray(scaled.transpose(2, 0, 1)[None])
