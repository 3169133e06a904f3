"""RAM++ exports: many tags of the whole image, each with its own threshold.

Source: xinyu1205/recognize-anything (RAM++, arXiv 2310.15200): input (1, 3, 384, 384) RGB, squashed, ImageNet mean and
deviation; output (1, T) logits; tags (`labels`) and thresholds (`thresholds`) one a line, in the order of the output.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from placegraph.models_onnx import ScoredNames
from placegraph.models_onnx.manifest import ModelOptions, Weights, read_lines
from placegraph.models_onnx.session import Session
from placegraph.runtime.arrays import F32, U8
from placegraph.runtime.errors import ModelError

MEAN = np.array([0.485, 0.456, 0.406], np.float32)  # ImageNet's, RGB of 0..1
STD = np.array([0.229, 0.224, 0.225], np.float32)


class Options(ModelOptions):
    """RAM weights differ in nothing but their files."""


class FAMILY:
    """A RAM network as a Tagger."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load and check the layout; raises ModelError when it is not such an export."""
        weights.parse_options(Options)
        self._names = weights.class_names()
        self._thresholds = _thresholds(weights, len(self._names))
        self._session = Session(weights.file("model"), threads)
        self._input, self._output = self._session.only_input(), self._session.only_output()
        sizes = self._session.expect({self._input: (1, 3, "S", "S")}, {self._output: (1, len(self._names))})
        self._size = sizes.get("S", 384)  # RAM++ Swin-L

    def tag(self, image: U8) -> ScoredNames:
        """Tags whose probability exceeds their threshold, best first; raises ModelError when it cannot be run."""
        resized = cv2.resize(image, (self._size, self._size), interpolation=cv2.INTER_LINEAR)
        feed = ((resized.astype(np.float32) / np.float32(255) - MEAN) / STD).transpose(2, 0, 1)[None]
        logits = self._session.run({self._input: np.ascontiguousarray(feed)})[self._output][0]
        scores = (1 / (1 + np.exp(-np.clip(logits, -60, 60)))).astype(np.float32)  # clipped: e^60 fits float32
        order = np.argsort(-scores, kind="stable")
        order = order[scores[order] > self._thresholds[order]]
        return ScoredNames(tuple(self._names[i] for i in order.tolist()), scores[order])


def _thresholds(weights: Weights, tags: int) -> F32:
    path = weights.file("thresholds")
    lines = read_lines(path)
    if len(lines) != tags:
        raise ModelError(f"{path}: {len(lines)} thresholds for {tags} tags")
    values = []
    for number, line in enumerate(lines, start=1):
        try:
            value = float(line)
        except ValueError:
            value = math.nan
        if not 0 <= value <= 1:
            raise ModelError(f"{path}: entry {number}: expected a threshold in 0..1, got {line!r}")
        values.append(value)
    return np.array(values, np.float32)
