"""Node `detector`: keyframe and tags to named boxes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from placegraph.models_onnx import Detector
from placegraph.models_onnx.load import load_for_node
from placegraph.runtime.messages import Detections, Keyframe, Message, Tags
from placegraph.runtime.messages.synchronizer import FrameSynchronizer
from placegraph.runtime.node import Node, NodeConfig


class DetectorConfig(NodeConfig):
    """Settings of the detector."""

    model: str  # a name of the manifest
    min_score: float = Field(default=0.35, ge=0, le=1)  # chosen on 7-Scenes: few false positives with YOLOX-nano
    max_objects: int = Field(default=50, ge=1)  # boxes kept of one image, best first; bounds the segmenter's time
    vocabulary: Annotated[tuple[str, ...], Field(strict=False)] = ()  # always looked for, besides the tags


class DetectorNode(Node):
    """Look for the tags of a keyframe, and for the vocabulary, in its image; fixed-class networks look for their own.

    Source: paper, object layer: YOLO-World prompted with the tags.
    """

    config_type = DetectorConfig
    inputs = (Keyframe, Tags)
    outputs = (Detections,)
    restartable = True

    def start(self) -> None:
        """Load the network; raises ModelError, ConfigError."""
        self._model = load_for_node(Detector, self.config.model, "detector", self.context)
        self._synchronizer = FrameSynchronizer(Keyframe, Tags)

    def step(self, message: Message) -> Sequence[Message]:
        """When both a Keyframe and its Tags are there, give its Detections, best first."""
        match self._synchronizer.add(message):
            case (Keyframe() as keyframe, Tags() as tags):
                names = tuple(dict.fromkeys((*tags.names, *self.config.vocabulary)))
                boxes = self._model.detect(keyframe.color, names)
                return [boxes.best(self.config.min_score, self.config.max_objects).as_message(keyframe)]
            case _:
                return []


NODE = DetectorNode
