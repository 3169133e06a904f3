"""YOLO-seg exports of one class, location: a bird's-eye image to masks with scores.

Source: paper, "Location Detector Module" (YOLOv11 for instance segmentation, one class); the layout is yolo_seg.py's.
"""

from __future__ import annotations

from dataclasses import replace

from placegraph.models_onnx import ScoredMasks, yolo_seg
from placegraph.models_onnx.manifest import Weights
from placegraph.runtime.arrays import U8
from placegraph.runtime.errors import ModelError

LABEL = "location"


class FAMILY:
    """A YOLO-seg network of one class as a LocationDetector."""

    def __init__(self, weights: Weights, threads: int = 1) -> None:
        """Load and check the layout; raises ModelError when it is not such an export."""
        if weights.labels not in ((), (LABEL,)):
            raise ModelError(f"weights {weights.name!r}: the one class of a location network is {LABEL!r}")
        self._network = yolo_seg.FAMILY(replace(weights, labels=(LABEL,)), threads)

    def locate(self, image: U8) -> ScoredMasks:
        """Masks of the locations in a bird's-eye image, best first.

        Raises:
            ModelError: the network cannot be run on this image.
        """
        instances = self._network.instances(image, ())
        return ScoredMasks(instances.masks, instances.boxes.scores)
