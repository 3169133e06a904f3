"""Image classifiers of the ImageNet kind, as taggers of the whole image.

Source: the common export layout: input (1, 3, H, W) or (1, H, W, 3) RGB, (pixel - mean) / std, the image squashed to
the input; output (1, C) logits or probabilities.
"""

from __future__ import annotations

from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from placegraph.models_onnx import ScoredNames
from placegraph.models_onnx.manifest import ModelOptions, Weights
from placegraph.models_onnx.session import Session
from placegraph.runtime.arrays import F32, U8
from placegraph.runtime.errors import ModelError

Triple = Annotated[tuple[float, float, float], Field(strict=False)]


class Options(ModelOptions):
    """What differs between classifiers."""

    mean: Triple = (123.675, 116.28, 103.53)  # ImageNet's, RGB of 0..255
    std: Triple = (58.395, 57.12, 57.375)
    label_offset: int = Field(default=0, ge=0)  # leading classes that are no thing, such as "background"
    min_score: float = 0.05  # floor of the probability
    max_tags: int = Field(default=5, ge=1)  # ImageNet's top five


class FAMILY:
    """A classifier as a Tagger."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load and check the layout; raises ModelError when it is not such an export."""
        self._options = weights.parse_options(Options)
        self._session = Session(weights.file("model"), threads)
        self._input, self._output = self._session.only_input(), self._session.only_output()
        labels = weights.class_names()
        self._session.expect(outputs={self._output: (1, len(labels))})
        if self._options.label_offset >= len(labels):
            raise ModelError(f"weights {weights.name!r}: label_offset leaves none of {len(labels)} labels")
        self._names = tuple(first_synonym(label) for label in labels)
        self._channels_first, self._height, self._width = _image_layout(self._session, self._input)

    def tag(self, image: U8) -> ScoredNames:
        """The most probable classes of an image, best first; raises ModelError when the network cannot be run."""
        resized = cv2.resize(image, (self._width, self._height), interpolation=cv2.INTER_AREA)
        feed = (resized - np.array(self._options.mean, np.float32)) / np.array(self._options.std, np.float32)
        feed = feed.transpose(2, 0, 1) if self._channels_first else feed
        raw = self._session.run({self._input: np.ascontiguousarray(feed[None], np.float32)})[self._output][0]
        scores = probabilities(raw)
        scores[: self._options.label_offset] = 0
        order = np.argsort(-scores, kind="stable")[: self._options.max_tags]
        order = order[(scores[order] >= self._options.min_score) & (scores[order] > 0)]
        best: dict[str, float] = {}  # two classes can share a first synonym ("crane"): the better one stands for both
        for i in order.tolist():
            best.setdefault(self._names[i], float(scores[i]))
        return ScoredNames(tuple(best), np.array(list(best.values()), np.float32))


def probabilities(raw: F32) -> F32:
    """Softmax of (C,), unless it already holds probabilities (none negative, sum 1 within the error of 8 bits)."""
    values = np.array(raw, np.float32)
    if values.min() >= 0 and abs(float(values.sum()) - 1) < 0.02:
        return values
    shifted = np.exp(values - values.max())
    return np.asarray(shifted / shifted.sum(), np.float32)


def first_synonym(label: str) -> str:
    """The text before the first comma ("tench" of "tench, Tinca tinca"), with underscores as spaces."""
    return label.split(",")[0].replace("_", " ").strip()


def _image_layout(session: Session, name: str) -> tuple[bool, int, int]:
    """Whether channels come first, height and width in px."""
    shape = session.inputs[name]
    if len(shape) == 4 and 3 in (shape[1], shape[3]):
        channels_first = shape[1] == 3
        height, width = shape[2:] if channels_first else shape[1:3]
        if isinstance(height, int) and isinstance(width, int):
            return channels_first, height, width
    raise ModelError(f"{session.path}: input {name!r} has shape {list(shape)}, expected [1, 3, H, W] or [1, H, W, 3]")
