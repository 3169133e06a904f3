"""YOLOv8-seg exports: boxes, classes and masks in one pass, or masks for boxes that another network found.

Source: the Ultralytics export layout: input as in yolo.py; output (1, 4 + C + 32, A) with cx cy w h, C class
probabilities and 32 mask coefficients; prototypes (1, 32, h, w). A mask is the sigmoid of coefficients times
prototypes, cut to its box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.models_onnx import Instances, Masks, NamedBoxes, boxes
from placegraph.models_onnx.letterbox import Letterbox
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.masks import mask_in_box
from placegraph.models_onnx.session import Session
from placegraph.models_onnx.yolo import input_size, prepare_input
from placegraph.runtime.arrays import F32, U8, Bool
from placegraph.runtime.errors import ModelError


class Options(ModelOptions):
    """What differs between YOLO-seg weights."""

    min_score: float = 0.1  # floor of the class probability
    nms_iou: float = 0.7  # Ultralytics default
    max_objects: int = 100  # masks made in one image; each costs .1 to .6 ms at 640 x 480
    prompt_iou: float = 0.5  # a box of another network needs an anchor that overlaps it by this
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
        detections, anchors = self._detections(raw)
        return Instances(detections, [self._mask(raw, raw.coefficients[i], raw.boxes_px[i]) for i in anchors])

    def detect(self, image: U8, names: Sequence[str]) -> NamedBoxes:
        """Boxes of the network's own classes; `names` are ignored. Raises ModelError when it cannot be run."""
        return self._detections(self._run(image))[0]

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
            overlap = boxes.image_box_iou(box, raw.boxes_px)
            fitness = np.where(overlap >= self._options.prompt_iou, overlap * certainty, -1)
            best = int(fitness.argmax()) if len(fitness) else -1
            if best < 0 or fitness[best] < 0:
                masks.append(np.zeros(image.shape[:2], bool))
            else:
                masks.append(self._mask(raw, raw.coefficients[best], box))
        return masks

    def _run(self, image: U8) -> _Raw:
        feed, placed = prepare_input(image, self._height, self._width)
        outputs = self._session.run({self._input: feed})
        raw = np.asarray(outputs[self._boxes][0].T, np.float32)
        classes = len(self._labels)
        return _Raw(
            placed.to_image(boxes.corners_from_centers(raw[:, :4])),
            raw[:, 4 : 4 + classes],
            raw[:, 4 + classes :],
            np.asarray(outputs[self._prototypes][0], np.float32),
            placed,
        )

    def _detections(self, raw: _Raw) -> tuple[NamedBoxes, list[int]]:
        """Named boxes and the anchor of each."""
        anchors, classes, scores = boxes.best_classes(raw.scores, self._options.min_score)
        solid = np.all(raw.boxes_px[anchors, 2:] > raw.boxes_px[anchors, :2], axis=1)
        anchors, classes, scores = anchors[solid], classes[solid], scores[solid]
        boxes_px = raw.boxes_px[anchors]
        kept = boxes.non_maximum_suppression(boxes_px, scores, classes, self._options.nms_iou)
        kept = kept[: self._options.max_objects]
        return boxes.named_boxes(self._labels, classes[kept], boxes_px[kept], scores[kept]), anchors[kept].tolist()

    def _mask(self, raw: _Raw, coefficients: F32, box_px: F32) -> Bool:
        """Coefficients (M,) to a mask (H, W) of the image, cut to a box in px.

        Not as in the export's reference code, which resizes to the input and then to the image: the logits are resized
        to the image in one bilinear step and only inside the box. Their sign is the sigmoid's threshold at .5.
        """
        placed, (_, rows, columns) = raw.placed, raw.prototypes.shape
        logits = np.tensordot(coefficients, raw.prototypes, axes=1).astype(np.float32)
        cells = np.array([columns / self._width, rows / self._height])  # prototype cells per px of the input
        scale = np.array([placed.scale_x, placed.scale_y])
        offset = (0.5 * scale + (placed.pad_x, placed.pad_y)) * cells - 0.5
        return mask_in_box(logits, scale * cells, offset, box_px, (placed.height, placed.width))


def _output_names(session: Session) -> tuple[str, str]:
    """The box output and the prototype output, told apart by their ranks."""
    by_rank = {len(shape): name for name, shape in session.outputs.items()}
    if set(by_rank) != {3, 4} or len(session.outputs) != 2:
        listing = ", ".join(f"{name} {list(shape)}" for name, shape in session.outputs.items())
        raise ModelError(f"{session.path}: expected boxes (1, 4+C+M, A) and prototypes (1, M, h, w), found {listing}")
    return by_rank[3], by_rank[4]
