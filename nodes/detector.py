"""Node `detector`: keyframe and tags to named boxes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from placegraph.models_onnx import Detector
from placegraph.models_onnx.load import load, wrong_task
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

    config_type: ClassVar[type[NodeConfig]] = DetectorConfig
    inputs = (Keyframe, Tags)
    outputs = (Detections,)
    restartable: ClassVar[bool] = True

    def start(self) -> None:
        """Load the network.

        Raises:
            ModelError: its weights are absent, damaged, or not of the family's layout.
            ConfigError: it does not detect objects.
        """
        model = load(self.config.model, self.context.model_dirs, self.context.threads)
        if not isinstance(model, Detector):
            raise wrong_task("detector", self.config.model, model, "find boxes")
        self._model: Detector = model
        self._synchronizer = FrameSynchronizer(Keyframe, Tags)

    def step(self, message: Message) -> Sequence[Message]:
        """When both a Keyframe and its Tags are there, give its Detections, best first."""
        match self._synchronizer.add(message):
            case (Keyframe() as keyframe, Tags() as tags):
                return [self._detect(keyframe, tags)]
            case _:
                return []

    def _detect(self, keyframe: Keyframe, tags: Tags) -> Detections:
        names = tuple(dict.fromkeys((*tags.names, *self.config.vocabulary)))
        boxes = self._model.detect(keyframe.color, names)
        kept = np.flatnonzero(boxes.scores >= self.config.min_score)[: self.config.max_objects]
        return Detections(
            frame_id=keyframe.frame_id,
            stamp_ns=keyframe.stamp_ns,
            names=tuple(boxes.names[i] for i in kept.tolist()),
            boxes_px=np.ascontiguousarray(boxes.boxes_px[kept], np.float32),
            scores=np.ascontiguousarray(boxes.scores[kept], np.float32),
        )


NODE = DetectorNode
