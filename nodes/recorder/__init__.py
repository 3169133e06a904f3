"""Node `recorder`: writes every recorded message exactly into a Rerun file or a live viewer, and draws it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from placegraph.nodes.recorder import draw_images, draw_map, draw_scene_graph
from placegraph.nodes.recorder.blueprint import opening_view
from placegraph.nodes.recorder.draw_health import draw_health
from placegraph.nodes.recorder.drawing import Canvas
from placegraph.runtime import messages as m
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages.topics import TOPICS
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.recording import RecordingWriter, images_of

RECORDED = tuple(topic.kind for topic in TOPICS.values() if topic.recorded)
# A kind without an entry is recorded but not drawn.
DRAWN: dict[type[m.Message], Callable[[Canvas, Any, dict[str, bytes]], None]] = {
    m.Frame: draw_images.draw_frame,
    m.Pose: draw_map.draw_pose,
    m.Keyframe: draw_images.draw_keyframe,
    m.Tags: draw_images.draw_tags,
    m.Detections: draw_images.draw_detections,
    m.Segments: draw_images.draw_segments,
    m.Map: draw_map.draw_map,
    m.Graph: draw_scene_graph.draw_graph,
    m.NamedGraph: draw_scene_graph.draw_graph,
    m.Question: draw_scene_graph.draw_question,
    m.Answer: draw_scene_graph.draw_answer,
    m.Health: draw_health,
}


class RecorderConfig(NodeConfig):
    """Settings of `recorder`."""

    file: str = "run.rrd"  # in the run's folder; "": no file
    viewer_port: int = Field(default=0, ge=0, le=65535)  # a Rerun viewer may connect to 127.0.0.1 here; 0: none
    frames: bool = False  # keep every camera frame too, about 0.5 MB each at 640x480, so that all can be run again


class RecorderNode(Node):
    """Writes and draws its inputs; it has no outputs."""

    config_type: ClassVar[type[NodeConfig]] = RecorderConfig
    inputs = RECORDED
    optional = (m.Frame, *RECORDED)  # whatever the other nodes of a dataflow publish

    def __init__(self, config: RecorderConfig, context: Context) -> None:
        super().__init__(config, context)
        if config.file and (Path(config.file).name != config.file or not config.file.endswith(".rrd")):
            raise ConfigError(
                f"[nodes.recorder] file: expected a name in the run's folder like run.rrd: {config.file!r}"
            )
        if not config.file and not config.viewer_port:
            raise ConfigError("[nodes.recorder] file is empty and viewer_port is 0: nothing would be recorded or shown")
        self.inputs = (m.Frame, *RECORDED) if config.frames else RECORDED
        if m.NamedGraph.__name__ in context.produced_kinds:  # it holds all of the Graph, and names
            self.inputs = tuple(kind for kind in self.inputs if kind is not m.Graph)
        self._writer: RecordingWriter | None = None
        self._picture: Canvas | None = None

    def start(self) -> None:
        """Open the file and the port; raises ConfigError when one of them cannot be opened."""
        if self.config.file and not self.context.out_dir:
            raise ConfigError("[nodes.recorder] file: this run has no folder to record into")
        folder = Path(self.context.out_dir)
        self._writer = RecordingWriter(
            folder / self.config.file if self.config.file else None,
            run_id=folder.name or "placegraph",
            properties={"placegraph": version("placegraph"), "frames": str(self.config.frames).lower()},
            viewer_port=self.config.viewer_port,
            blueprint=opening_view(self.config.frames),
        )
        self._picture = Canvas(self._writer.stream, self.config.frames)
        draw_map.draw_world(self._picture)

    def step(self, message: m.Message) -> Sequence[m.Message]:
        """Write and draw one message. Raises SchemaError for a message that is not what it declares."""
        if self._writer is None or self._picture is None:
            raise RuntimeError("recorder: step before start")
        if self.config.file:
            pngs = self._writer.write(message)
        else:
            message.check()
            pngs = images_of(message)
            self._writer.set_time(message)
        if draw := DRAWN.get(type(message)):
            draw(self._picture, message, pngs)
        return ()

    def stop(self) -> None:
        """Write what is pending and close; the file is readable from here on."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None


NODE = RecorderNode
