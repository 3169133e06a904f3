"""YOLOv8 and YOLO-World exports: decoded boxes and class scores in one tensor.

Source: the Ultralytics export layout: input (1, 3, S, S) RGB 0..1, letterboxed in the middle with grey 114; output
(1, 4 + N, A) with cx cy w h in px of the input and N class probabilities. A prompted export (YOLO-World) has a second
input (1, N, D): unit text features of the names to look for.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.models_onnx import NamedBoxes, boxes
from placegraph.models_onnx.letterbox import Letterbox, letterbox_image
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.session import Session
from placegraph.models_onnx.text_encoder import DIMENSIONS, TextEncoder
from placegraph.runtime.arrays import F32, U8
from placegraph.runtime.errors import ModelError


class Options(ModelOptions):
    """What differs between YOLO weights."""

    min_score: float = 0.1  # floor of the class probability
    nms_iou: float = 0.7  # Ultralytics default
    size: int = 640  # px, used where the export leaves its input size open; Ultralytics default


class FAMILY:
    """A YOLO network as a Detector: of its own classes, or of the names asked for when the export takes text."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load and check the layout; raises ModelError when it is not such an export."""
        self._options = weights.parse_options(Options)
        self._session = Session(weights.file("model"), threads)
        self._output = self._session.only_output()
        self._input, self._text_input = _input_names(self._session)
        self._session.expect({self._input: (1, 3, "S", "T")}, {self._output: (1, "4+N", "A")})
        self._height, self._width = input_size(self._session, self._input, self._options.size)
        self._labels: tuple[str, ...] = ()
        self._slots: int | None = None  # how many names one run takes; None: any number
        if self._text_input:
            self._encoder = TextEncoder()
            self._check_prompted(weights)
        else:
            self._labels = weights.class_names()
            self._session.expect(outputs={self._output: (1, 4 + len(self._labels), "A")})

    def detect(self, image: U8, names: Sequence[str]) -> NamedBoxes:
        """Boxes of the names asked for (prompted), or of the network's own classes (`names` ignored).

        Raises:
            ModelError: the network cannot be run on this image, or gives another number of classes than names.
        """
        prompts = tuple(dict.fromkeys(names)) if self._text_input else self._labels
        feed, placed = prepare_input(image, self._height, self._width)
        centers = [np.zeros((0, 4), np.float32)]
        classes, scores = [np.zeros(0, np.int64)], [np.zeros(0, np.float32)]
        step = self._slots or max(len(prompts), 1)
        for start in range(0, len(prompts), step):
            raw = self._run(feed, prompts[start : start + step])
            anchors, part, best = boxes.best_classes(raw[:, 4:], self._options.min_score)
            centers.append(raw[anchors, :4])
            classes.append(part + start)
            scores.append(best)
        boxes_px = placed.to_image(boxes.corners_from_centers(np.concatenate(centers)))
        class_ids, best = np.concatenate(classes), np.concatenate(scores)
        kept = boxes.non_maximum_suppression(boxes_px, best, class_ids, self._options.nms_iou)
        return boxes.named_boxes(prompts, class_ids[kept], boxes_px[kept], best[kept])

    def _run(self, feed: F32, names: Sequence[str]) -> F32:
        """One pass for as many names as the export takes: (A, 4 + names)."""
        feeds, classes = {self._input: feed}, len(names)
        if self._text_input:
            classes = self._slots or len(names)
            features = np.zeros((1, classes, DIMENSIONS), np.float32)
            features[0, : len(names)] = self._encoder.encode(names)  # slots without a name stay zero and are not read
            feeds[self._text_input] = features
        raw = self._session.run(feeds)[self._output][0].T
        if raw.shape[1] != 4 + classes:
            raise ModelError(f"{self._session.path}: {raw.shape[1]} numbers a box, expected {4 + classes}")
        return np.asarray(raw[:, : 4 + len(names)], np.float32)

    def _check_prompted(self, weights: Weights) -> None:
        sizes = self._session.expect({self._text_input: (1, "N", "D")})
        if sizes.get("D", DIMENSIONS) != DIMENSIONS:
            raise ModelError(
                f"{self._session.path}: text features of {sizes['D']} numbers, but the text encoder gives {DIMENSIONS}"
            )
        if weights.labels:
            raise ModelError(f"weights {weights.name!r}: a prompted network has no labels of its own")
        self._slots = sizes.get("N")


def prepare_input(image: U8, height: int, width: int) -> tuple[F32, Letterbox]:
    """Letterbox (H, W, 3) in the middle and scale to 0..1: (1, 3, height, width), and where the image lies in it."""
    canvas, placed = letterbox_image(image, height, width, centered=True)
    feed = canvas.transpose(2, 0, 1)[None].astype(np.float32) / np.float32(255)
    return np.ascontiguousarray(feed), placed


def input_size(session: Session, name: str, default_px: int) -> tuple[int, int]:
    """Height and width of an image input (1, 3, H, W), `default_px` where the export leaves them open."""
    height, width = session.inputs[name][2:]
    return (
        height if isinstance(height, int) else default_px,
        width if isinstance(width, int) else default_px,
    )


def _input_names(session: Session) -> tuple[str, str]:
    """The image input and the text input ("" when there is none), told apart by their ranks."""
    images = [name for name, shape in session.inputs.items() if len(shape) == 4]
    texts = [name for name, shape in session.inputs.items() if len(shape) == 3]
    if len(images) != 1 or len(texts) > 1 or len(session.inputs) != len(images) + len(texts):
        raise ModelError(
            f"{session.path}: expected one image input (1, 3, S, S) and at most one text input (1, N, D), found "
            + ", ".join(f"{name} {list(shape)}" for name, shape in session.inputs.items())
        )
    return images[0], texts[0] if texts else ""
