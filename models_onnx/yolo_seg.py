"""Read YOLOv8-seg exports: boxes, classes and masks from one pass; also masks for boxes that another network found.

Source: the Ultralytics export layout: input as in yolo.py; output (1, 4 + C + 32, A) with cx cy w h, C class
probabilities and 32 mask coefficients; prototypes (1, 32, h, w). A mask is the sigmoid of coefficients times
prototypes, cut to its box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.models_onnx import Boxes, Instances, Masks, boxes
from placegraph.models_onnx.letterbox import Letterbox
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.session import Session
from placegraph.models_onnx.yolo import input_size, prepare
from placegraph.runtime.arrays import F32, U8
from placegraph.runtime.errors import ModelError
from placegraph.runtime.vision.geometry import box_iou


class Options(ModelOptions):
    """What differs between YOLO-seg weights."""

    min_score: float = 0.1  # floor of the class probability
    nms_iou: float = 0.7  # Ultralytics default
    max_objects: int = 100  # masks made in one image; each costs .1 to .6 ms at 640 x 480
    prompt_iou: float = 0.5  # a box given from outside needs an anchor that overlaps it at least so much
    size: int = 640  # px, used where the export leaves its input size open; Ultralytics default


@dataclass(frozen=True)
class _Raw:
    """One pass: boxes (A, 4) in px of the image, class scores (A, C), coefficients (A, 32), prototypes (32, h, w)."""

    boxes_px: F32
    scores: F32
    coefficients: F32
    prototypes: F32
    placed: Letterbox


class FAMILY:
    """A YOLO-seg network as InstanceSegmenter, Detector, and Segmenter prompted by boxes."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load and check the layout; raises ModelError when it is not such an export."""
        self._options = weights.parse_options(Options)
        self._labels = weights.class_names()
        self._session = Session(weights.file("model"), threads)
        self._input = self._session.only_input()
        self._boxes, self._prototypes = _output_names(self._session)
        sizes = self._session.expect({self._input: (1, 3, "S", "T")}, {self._prototypes: (1, "M", "h", "w")})
        if "M" not in sizes:
            raise ModelError(f"{self._session.path}: the number of prototypes in {self._prototypes!r} must be fixed")
        self._session.expect(outputs={self._boxes: (1, 4 + len(self._labels) + sizes["M"], "A")})
        self._height, self._width = input_size(self._session, self._input, self._options.size)

    def instances(self, image: U8, names: Sequence[str]) -> Instances:
        """Boxes of the network's own classes with a mask each; `names` are ignored.

        Raises:
            ModelError: the network cannot be run on this image.
        """
        raw = self._run(image)
        found, anchors = self._find(raw)
        return Instances(found, [self._mask(raw, raw.coefficients[i], raw.boxes_px[i]) for i in anchors])

    def detect(self, image: U8, names: Sequence[str]) -> Boxes:
        """Boxes of the network's own classes; `names` are ignored. Raises ModelError when it cannot be run."""
        return self._find(self._run(image))[0]

    def segment(self, image: U8, depth_m: F32, boxes_px: F32) -> Masks:
        """A mask for each box (N, 4) px: that of the anchor that fits it best, cut to the box; empty where none fits.

        The best fit is the highest IoU times best class score among anchors of IoU >= `prompt_iou`; depth is not used.

        Raises:
            ModelError: the network cannot be run on this image.
        """
        if not len(boxes_px):
            return []
        raw = self._run(image)
        certainty = raw.scores.max(axis=1)
        masks: Masks = []
        for box in boxes_px:
            overlap = box_iou(box.reshape(2, 2), raw.boxes_px.reshape(-1, 2, 2))
            fit = np.where(overlap >= self._options.prompt_iou, overlap * certainty, -1)
            best = int(fit.argmax()) if len(fit) else -1
            if best < 0 or fit[best] < 0:
                masks.append(np.zeros(image.shape[:2], bool))
            else:
                masks.append(self._mask(raw, raw.coefficients[best], box))
        return masks

    def _run(self, image: U8) -> _Raw:
        feed, placed = prepare(image, self._height, self._width)
        outputs = self._session.run({self._input: feed})
        raw = np.asarray(outputs[self._boxes][0].T, np.float32)
        classes = len(self._labels)
        return _Raw(
            placed.to_image(boxes.from_centres(raw[:, :4])),
            raw[:, 4 : 4 + classes],
            raw[:, 4 + classes :],
            np.asarray(outputs[self._prototypes][0], np.float32),
            placed,
        )

    def _find(self, raw: _Raw) -> tuple[Boxes, list[int]]:
        """Named boxes and the anchor of each."""
        anchors, classes, scores = boxes.best_classes(raw.scores, self._options.min_score)
        solid = np.all(raw.boxes_px[anchors, 2:] > raw.boxes_px[anchors, :2], axis=1)
        anchors, classes, scores = anchors[solid], classes[solid], scores[solid]
        found = raw.boxes_px[anchors]
        kept = boxes.suppress(found, scores, classes, self._options.nms_iou)[: self._options.max_objects]
        return boxes.named(self._labels, classes[kept], found[kept], scores[kept]), anchors[kept].tolist()

    def _mask(self, raw: _Raw, coefficients: F32, box_px: F32) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Coefficients (M,) to a mask (H, W) of the image, cut to a box in px.

        Departs: the logits are brought to image size in one bilinear step and only inside the box (the export's
        reference code resizes to the input and then to the image); their sign is the sigmoid at .5.
        """
        placed, (_, rows, columns) = raw.placed, raw.prototypes.shape
        mask = np.zeros((placed.height, placed.width), bool)
        x0, y0 = (max(int(v), 0) for v in np.floor(box_px[:2] + 0.5))
        x1, y1 = (min(int(v), limit) for v, limit in zip(np.floor(box_px[2:] + 0.5), mask.shape[::-1], strict=True))
        if x1 <= x0 or y1 <= y0:
            return mask
        logits = np.tensordot(coefficients, raw.prototypes, axes=1).astype(np.float32)
        step_x, step_y = columns / self._width, rows / self._height  # prototype cells per px of the input
        to_cell = np.array(
            [
                [placed.scale_x * step_x, 0, ((x0 + 0.5) * placed.scale_x + placed.pad_x) * step_x - 0.5],
                [0, placed.scale_y * step_y, ((y0 + 0.5) * placed.scale_y + placed.pad_y) * step_y - 0.5],
            ]
        )
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        inside = cv2.warpAffine(logits, to_cell, (x1 - x0, y1 - y0), flags=flags, borderMode=cv2.BORDER_REPLICATE)
        mask[y0:y1, x0:x1] = inside > 0
        return mask


def _output_names(session: Session) -> tuple[str, str]:
    """The box output and the prototype output, told apart by their ranks."""
    by_rank = {len(shape): name for name, shape in session.outputs.items()}
    if set(by_rank) != {3, 4} or len(session.outputs) != 2:
        listing = ", ".join(f"{name} {list(shape)}" for name, shape in session.outputs.items())
        raise ModelError(f"{session.path}: expected boxes (1, 4+C+M, A) and prototypes (1, M, h, w), found {listing}")
    return by_rank[3], by_rank[4]
