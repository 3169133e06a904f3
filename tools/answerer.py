"""Puts questions to maps and object lists in files: one grounding node, which is shown the graph of each question."""

from __future__ import annotations

import json
import re
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Any

from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Answer, Graph, Question
from placegraph.runtime.node import Context, Node, build_node
from placegraph.runtime.query.reply import reply_json
from placegraph.runtime.scene_graph.object_list import OwnId
from placegraph.runtime.scene_graph.object_list_import import load_scene
from placegraph.tools.map_folder import RUN, find_graph, read_config

KEPT = 4  # files whose graphs are kept: lines about one scene mostly follow each other
NODE_ID = re.compile(r"\b[FRO](?:0|[1-9][0-9]*)\b")


@dataclass(frozen=True)
class _Opened:
    graph: Graph
    ids: dict[str, OwnId]
    settings: dict[str, Any]
    context: Context


class Answerer:
    """Answers questions about files, each as its own run would have; a context manager, whose end frees the model."""

    def __init__(self, settings: dict[str, Any] | None = None) -> None:
        """settings: of the grounding node, over those of the files' runs."""
        self._settings = settings or {}
        self._open = lru_cache(KEPT)(self._read)
        self._node: Node | None = None
        self._built_for: tuple[dict[str, Any], Context] | None = None
        self._shown: _Opened | None = None

    def __enter__(self) -> Answerer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stop()

    def check(self, path: Path) -> None:
        """Read a file that will be asked; raises SchemaError when it is none that can be."""
        self._open(path)

    def ask(self, path: Path, question: Question) -> dict[str, Any]:
        """The fields of the reply, with the file's own ids. path: a map folder, a graph file or an object list.

        Raises SchemaError for a file that is none of these, ModelError where the language model is missing.
        """
        opened = self._open(path)
        node = self._show(opened)
        began_s = time.monotonic()
        answers = [message for message in node.step(question) if isinstance(message, Answer)]
        ms = (time.monotonic() - began_s) * 1e3
        if not answers:
            raise QueryError("the grounding node gave no answer")
        return in_own_ids(json.loads(reply_json(answers[0].json, ms)), opened.ids)

    def _read(self, path: Path) -> _Opened:
        scene = load_scene(find_graph(path))
        settings: dict[str, Any] = {}
        context = Context()
        if path.is_dir() and (path / RUN).exists():  # ask the map the way its run would have answered
            config = read_config(path)
            settings = config.nodes.get("grounding", {})
            context = Context(model_dirs=tuple(config.run.model_dirs), threads=config.run.threads)
        graph = Graph(frame_id=-1, stamp_ns=0, revision=0, final=True, named=True, json=scene.graph.to_json())
        return _Opened(graph, scene.ids, settings | self._settings, context)

    def _show(self, opened: _Opened) -> Node:
        """The node for a file's settings, which has seen its graph."""
        if self._node is None or self._built_for != (opened.settings, opened.context):
            self._stop()
            self._node = build_node("grounding", opened.settings, opened.context)
            self._node.start()
            self._built_for = opened.settings, opened.context
        if self._shown is not opened:
            self._node.step(opened.graph)
            self._shown = opened
        return self._node

    def _stop(self) -> None:
        node, self._node, self._shown = self._node, None, None
        if node is not None:
            node.stop()


def in_own_ids(reply: dict[str, Any], ids: dict[str, OwnId]) -> dict[str, Any]:
    """The same reply with the ids by which a file's maker knows things, in its sentences too."""

    def own(node_id: str | None) -> OwnId | None:
        return None if node_id is None else ids.get(node_id, node_id)

    def said(sentences: list[str]) -> list[str]:
        return [NODE_ID.sub(lambda found: str(own(found[0])), sentence) for sentence in sentences]

    if not ids:
        return reply
    return reply | {
        "object_id": own(reply["object_id"]),
        "path": [step | {"id": own(step["id"])} for step in reply["path"]],
        "route": [own(node_id) for node_id in reply["route"]],
        "evidence": said(reply["evidence"]),
        "candidates": [one | {"id": own(one["id"]), "evidence": said(one["evidence"])} for one in reply["candidates"]],
    }
