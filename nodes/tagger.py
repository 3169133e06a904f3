"""Node `tagger`: keyframe to tags, the names of what the whole image shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from placegraph.models_onnx import Tagger
from placegraph.models_onnx.load import load, wrong_task
from placegraph.runtime.messages import Keyframe, Message, Tags
from placegraph.runtime.node import Node, NodeConfig


class TaggerConfig(NodeConfig):
    """Settings of the tagger."""

    model: str  # a name of the manifest
    min_score: float = Field(default=0.0, ge=0, le=1)  # paper: the network's own thresholds decide
    max_objects: int = Field(default=30, ge=1)  # tags kept of one image; bounds what the detector is asked for


class TaggerNode(Node):
    """Tag each keyframe.

    Source: paper, object layer: RAM++.
    """

    config_type: ClassVar[type[NodeConfig]] = TaggerConfig
    inputs = (Keyframe,)
    outputs = (Tags,)
    restartable: ClassVar[bool] = True

    def start(self) -> None:
        """Load the network.

        Raises:
            ModelError: its weights are absent, damaged, or not of the family's layout.
            ConfigError: it does not tag images.
        """
        model = load(self.config.model, self.context.model_dirs, self.context.threads)
        if not isinstance(model, Tagger):
            raise wrong_task("tagger", self.config.model, model, "tag images")
        self._model: Tagger = model

    def step(self, message: Message) -> Sequence[Message]:
        """A Keyframe gives its Tags, best first."""
        if not isinstance(message, Keyframe):
            raise TypeError(f"tagger takes Keyframe, not {type(message).__name__}")
        tags = self._model.tag(message.color)
        kept = np.flatnonzero(tags.scores >= self.config.min_score)[: self.config.max_objects]
        return [
            Tags(
                frame_id=message.frame_id,
                stamp_ns=message.stamp_ns,
                names=tuple(tags.names[i] for i in kept.tolist()),
                scores=np.ascontiguousarray(tags.scores[kept], np.float32),
            )
        ]


NODE = TaggerNode
