"""Node `segmenter`: keyframe and boxes to masks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from placegraph.models_onnx import Segmenter
from placegraph.models_onnx.load import load, wrong_task
from placegraph.models_onnx.masks import pack_segments
from placegraph.runtime.messages import Detections, Keyframe, Message, Segments
from placegraph.runtime.messages.synchronizer import FrameSynchronizer
from placegraph.runtime.node import Node, NodeConfig


class SegmenterConfig(NodeConfig):
    """Settings of the segmenter."""

    model: str  # a name of the manifest
    min_score: float = Field(default=0.0, ge=0, le=1)  # boxes below are not segmented; the detector has chosen already
    max_objects: int = Field(default=50, ge=1)  # boxes segmented of one image, best first


class SegmenterNode(Node):
    """Give each detected box its mask; boxes in which nothing is found are dropped.

    Source: paper, object layer: MobileSAMv2 prompted with the boxes.
    """

    config_type: ClassVar[type[NodeConfig]] = SegmenterConfig
    inputs = (Keyframe, Detections)
    outputs = (Segments,)
    restartable: ClassVar[bool] = True

    def start(self) -> None:
        """Load the network.

        Raises:
            ModelError: its weights are absent, damaged, or not of the family's layout.
            ConfigError: it does not segment boxes.
        """
        model = load(self.config.model, self.context.model_dirs, self.context.threads)
        if not isinstance(model, Segmenter):
            raise wrong_task("segmenter", self.config.model, model, "give masks for boxes")
        self._model: Segmenter = model
        self._synchronizer = FrameSynchronizer(Keyframe, Detections)

    def step(self, message: Message) -> Sequence[Message]:
        """When both a Keyframe and its Detections are there, give its Segments, in the order of the boxes."""
        match self._synchronizer.add(message):
            case (Keyframe() as keyframe, Detections() as detections):
                return [self._segment(keyframe, detections)]
            case _:
                return []

    def _segment(self, keyframe: Keyframe, detections: Detections) -> Segments:
        kept = np.flatnonzero(detections.scores >= self.config.min_score)[: self.config.max_objects]
        depth_m = keyframe.depth.astype(np.float32) * np.float32(keyframe.depth_unit_m)
        masks = self._model.segment(keyframe.color, depth_m, detections.boxes_px[kept])
        return pack_segments(keyframe, [detections.names[i] for i in kept.tolist()], detections.scores[kept], masks)


NODE = SegmenterNode
