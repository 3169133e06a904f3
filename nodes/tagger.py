"""Node `tagger`: keyframe to tags, the names of what the whole image shows."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from placegraph.models_onnx import Tagger
from placegraph.models_onnx.load import load_for_node
from placegraph.runtime.messages import Keyframe, Message, Tags
from placegraph.runtime.node import Node, NodeConfig


class TaggerConfig(NodeConfig):
    """Settings of the tagger."""

    model: str  # a name of the manifest
    min_score: float = Field(default=0.0, ge=0, le=1)  # paper: the network's own thresholds decide
    max_tags: int = Field(default=30, ge=1)  # tags kept of one image; bounds what the detector is asked for


class TaggerNode(Node):
    """Tag each keyframe.

    Source: paper, object layer: RAM++.
    """

    config_type = TaggerConfig
    inputs = (Keyframe,)
    outputs = (Tags,)
    restartable = True

    def start(self) -> None:
        """Load the network; raises ModelError, ConfigError."""
        self._model = load_for_node(Tagger, self.config.model, "tagger", self.context)

    def step(self, message: Message) -> Sequence[Message]:
        """A Keyframe gives its Tags, best first."""
        if not isinstance(message, Keyframe):
            raise TypeError(f"tagger takes Keyframe, not {type(message).__name__}")
        tags = self._model.tag(message.color).best(self.config.min_score, self.config.max_tags)
        return [Tags(frame_id=message.frame_id, stamp_ns=message.stamp_ns, names=tags.names, scores=tags.scores)]


NODE = TaggerNode
