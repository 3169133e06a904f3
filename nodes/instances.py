"""Node `instances`: keyframe to boxes and masks, by one network in place of tagger, detector and segmenter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from placegraph.models_onnx import InstanceSegmenter
from placegraph.models_onnx.load import load, wrong_task
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

    Not as in the paper, which runs three networks: for machines that are too small for them.
    """

    config_type: ClassVar[type[NodeConfig]] = InstancesConfig
    inputs = (Keyframe,)
    outputs = (Detections, Segments)
    restartable: ClassVar[bool] = True

    def start(self) -> None:
        """Load the network.

        Raises:
            ModelError: its weights are absent, damaged, or not of the family's layout.
            ConfigError: it does not give boxes with masks.
        """
        model = load(self.config.model, self.context.model_dirs, self.context.threads)
        if not isinstance(model, InstanceSegmenter):
            raise wrong_task("instances", self.config.model, model, "give boxes with masks in one pass")
        self._model: InstanceSegmenter = model

    def step(self, message: Message) -> Sequence[Message]:
        """A Keyframe gives its Detections and its Segments, best first."""
        if not isinstance(message, Keyframe):
            raise TypeError(f"instances takes Keyframe, not {type(message).__name__}")
        instances = self._model.instances(message.color, self.config.vocabulary)
        kept = np.flatnonzero(instances.boxes.scores >= self.config.min_score)[: self.config.max_objects]
        names = tuple(instances.boxes.names[i] for i in kept.tolist())
        scores = np.ascontiguousarray(instances.boxes.scores[kept], np.float32)
        detections = Detections(
            frame_id=message.frame_id,
            stamp_ns=message.stamp_ns,
            names=names,
            boxes_px=np.ascontiguousarray(instances.boxes.boxes_px[kept], np.float32),
            scores=scores,
        )
        return [detections, pack_segments(message, names, scores, [instances.masks[i] for i in kept.tolist()])]


NODE = InstancesNode
