"""The task interfaces that every model family reads its export into.

A family module exports `FAMILY`: a class built with a `Weights` (see manifest.py) that implements one or more of these.
Images are (H, W, 3) uint8 sRGB; boxes are (N, 4) float32 x_min y_min x_max y_max in px of that image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from placegraph.runtime.arrays import F32, I64, U8, Bool
from placegraph.runtime.messages import Detections, Keyframe

Masks = list[Bool]


def best_rows(scores: F32, min_score: float, max_count: int) -> I64:
    """Indices of the first `max_count` scores (N,) that reach `min_score`."""
    return np.flatnonzero(scores >= min_score)[:max_count]


@dataclass(frozen=True)
class ScoredNames:
    """Names of an image, best first, with scores (N,) in 0..1."""

    names: tuple[str, ...]
    scores: F32

    def best(self, min_score: float, max_count: int) -> ScoredNames:
        """The first `max_count` names that reach a score."""
        rows = best_rows(self.scores, min_score, max_count)
        return ScoredNames(tuple(self.names[i] for i in rows.tolist()), self.scores[rows])


@dataclass(frozen=True)
class NamedBoxes:
    """Named boxes (N, 4) in px, best first, with scores (N,) in 0..1."""

    names: tuple[str, ...]
    boxes_px: F32
    scores: F32

    def best(self, min_score: float, max_count: int) -> NamedBoxes:
        """The first `max_count` boxes that reach a score."""
        return self.at(best_rows(self.scores, min_score, max_count))

    def at(self, rows: I64) -> NamedBoxes:
        """The boxes with these indices."""
        return NamedBoxes(tuple(self.names[i] for i in rows.tolist()), self.boxes_px[rows], self.scores[rows])

    def as_message(self, keyframe: Keyframe) -> Detections:
        """The Detections of a keyframe."""
        return Detections(
            frame_id=keyframe.frame_id,
            stamp_ns=keyframe.stamp_ns,
            names=self.names,
            boxes_px=self.boxes_px,
            scores=self.scores,
        )


@dataclass(frozen=True)
class Instances:
    """Named boxes with a mask each, (H, W) bool of the whole image."""

    boxes: NamedBoxes
    masks: Masks

    def best(self, min_score: float, max_count: int) -> Instances:
        """The first `max_count` objects that reach a score."""
        rows = best_rows(self.boxes.scores, min_score, max_count)
        return Instances(self.boxes.at(rows), [self.masks[i] for i in rows.tolist()])


@dataclass(frozen=True)
class ScoredMasks:
    """Masks (H, W) bool of the whole image, best first, with scores (N,) in 0..1."""

    masks: Masks
    scores: F32


@runtime_checkable
class Tagger(Protocol):
    """Image to names."""

    def tag(self, image: U8) -> ScoredNames:
        """Names of what the image shows."""
        ...


@runtime_checkable
class Detector(Protocol):
    """Image and the names to look for to boxes; a fixed-class family ignores the names."""

    def detect(self, image: U8, names: Sequence[str]) -> NamedBoxes:
        """The objects that were found, best first."""
        ...


@runtime_checkable
class Segmenter(Protocol):
    """Image (and aligned depth in metres, (H, W) float32, 0 = none) and boxes to one mask a box."""

    def segment(self, image: U8, depth_m: F32, boxes_px: F32) -> Masks:
        """One (H, W) bool mask for each box, in order; an empty mask where nothing was found."""
        ...


@runtime_checkable
class InstanceSegmenter(Protocol):
    """Image to boxes and masks in one pass."""

    def instances(self, image: U8, names: Sequence[str]) -> Instances:
        """The objects that were found, each with its mask, best first."""
        ...


@runtime_checkable
class LocationDetector(Protocol):
    """Bird's-eye image of a room to its locations: places whose objects are used together."""

    def locate(self, image: U8) -> ScoredMasks:
        """One mask for each location that was found; masks may overlap."""
        ...
