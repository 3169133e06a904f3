"""Node `instances`: keyframe to boxes and masks by one network, in place of tagger, detector and segmenter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from placegraph.models_onnx import InstanceSegmenter
from placegraph.models_onnx.load import load_for_node
from placegraph.models_onnx.masks import pack_segments
from placegraph.runtime.messages import Detections, Keyframe, Message, Segments
from placegraph.runtime.node import Node, NodeConfig


class InstancesConfig(NodeConfig):
    """Settings of the one-pass perception."""

    model: str  # a name of the manifest
    min_score: float = Field(default=0.35, ge=0, le=1)  # chosen on 7-Scenes: few false positives with YOLOv8n-seg
    max_objects: int = Field(default=50, ge=1)  # kept of one image, best first
    vocabulary: Annotated[tuple[str, ...], Field(strict=False)] = ()  # looked for by networks that take names


class InstancesNode(Node):
    """Find objects with their masks.

    Not as in the paper, which runs a tagger, a detector and a segmenter: one network suits machines that are too small
    for three. Such a dataflow needs no tagger: without a detector, only the recorder reads tags.
    """

    config_type = InstancesConfig
    inputs = (Keyframe,)
    outputs = (Detections, Segments)
    restartable = True

    def start(self) -> None:
        """Load the network; raises ModelError, ConfigError."""
        self._model = load_for_node(InstanceSegmenter, self.config.model, "instances", self.context)

    def step(self, message: Message) -> Sequence[Message]:
        """A Keyframe gives its Detections and its Segments, best first."""
        if not isinstance(message, Keyframe):
            raise TypeError(f"instances takes Keyframe, not {type(message).__name__}")
        instances = self._model.instances(message.color, self.config.vocabulary)
        instances = instances.best(self.config.min_score, self.config.max_objects)
        boxes = instances.boxes
        return [boxes.as_message(message), pack_segments(message, boxes.names, boxes.scores, instances.masks)]


NODE = InstancesNode
