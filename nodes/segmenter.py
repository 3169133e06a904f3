"""Node `segmenter`: keyframe and boxes to masks."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from placegraph.models_onnx import NamedBoxes, Segmenter
from placegraph.models_onnx.load import load_for_node
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

    config_type = SegmenterConfig
    inputs = (Keyframe, Detections)
    outputs = (Segments,)
    restartable = True

    def start(self) -> None:
        """Load the network; raises ModelError, ConfigError."""
        self._model = load_for_node(Segmenter, self.config.model, "segmenter", self.context)
        self._synchronizer = FrameSynchronizer(Keyframe, Detections)

    def step(self, message: Message) -> Sequence[Message]:
        """When both a Keyframe and its Detections are there, give its Segments, in the order of the boxes."""
        match self._synchronizer.add(message):
            case (Keyframe() as keyframe, Detections() as detections):
                return [self._segment(keyframe, detections)]
            case _:
                return []

    def _segment(self, keyframe: Keyframe, detections: Detections) -> Segments:
        boxes = NamedBoxes(detections.names, detections.boxes_px, detections.scores)
        boxes = boxes.best(self.config.min_score, self.config.max_objects)
        masks = self._model.segment(keyframe.color, keyframe.depth_m, boxes.boxes_px)
        return pack_segments(keyframe, boxes.names, boxes.scores, masks)


NODE = SegmenterNode
