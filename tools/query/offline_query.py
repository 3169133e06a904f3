"""Questions about maps and object lists in files, answered by one grounding node in this process."""

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
from placegraph.runtime.messages import Answer, Graph, NamedGraph, Question
from placegraph.runtime.node import Context, Node, build_node
from placegraph.runtime.query.reply import reply_json
from placegraph.runtime.scene_graph.object_list import SourceId
from placegraph.runtime.scene_graph.object_list_import import import_graph
from placegraph.tools.map_files.map_folder import RUN, find_graph, read_config

MAX_OPEN_FILES = 4  # whose graphs are kept in memory: lines about one file mostly follow each other
NODE_ID = re.compile(r"\b[FRO](?:0|[1-9][0-9]*)\b")


@dataclass(frozen=True)
class _OpenFile:
    graph: NamedGraph
    ids: dict[str, SourceId]
    settings: dict[str, Any]
    context: Context


class OfflineQuery:
    """Answers questions about files, each with its own run's settings; a context manager that frees the model."""

    def __init__(self, settings: dict[str, Any] | None = None) -> None:
        """settings: of the grounding node; they replace those of the files' runs."""
        self._settings = settings or {}
        self._open = lru_cache(MAX_OPEN_FILES)(self._read)
        self._node: Node | None = None
        self._built_for: tuple[dict[str, Any], Context] | None = None
        self._current: _OpenFile | None = None

    def __enter__(self) -> OfflineQuery:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stop()

    def check(self, path: Path) -> None:
        """Read a file before it is asked; raises SchemaError when it can not be."""
        self._open(path)

    def ask(self, path: Path, question: Question) -> dict[str, Any]:
        """The fields of the reply, with the file's own ids. path: a map folder, a graph file or an object list.

        Raises SchemaError for a file that is none of these, ModelError where the language model is missing.
        """
        file = self._open(path)
        node = self._node_with(file)
        began_s = time.monotonic()
        answers = [message for message in node.step(question) if isinstance(message, Answer)]
        ms = (time.monotonic() - began_s) * 1e3
        if not answers:
            raise QueryError("the grounding node gave no answer")
        return with_own_ids(json.loads(reply_json(answers[0].json, ms)), file.ids)

    def _read(self, path: Path) -> _OpenFile:
        scene = import_graph(find_graph(path))
        settings: dict[str, Any] = {}
        naming: dict[str, Any] = {}
        context = Context()
        if path.is_dir() and (path / RUN).exists():  # answer with the settings of the map's own run
            config = read_config(path)
            settings, naming = config.nodes.get("grounding", {}), config.nodes.get("naming", {})
            context = Context(model_dirs=tuple(config.run.model_dirs), threads=config.run.threads)
        graph = Graph(frame_id=-1, stamp_ns=0, revision=0, final=True, json=scene.graph.to_json())
        # places keep the names that the file gives them
        (named_graph,) = build_node("naming", naming | {"method": "none"}, context).step(graph)
        assert isinstance(named_graph, NamedGraph)
        return _OpenFile(named_graph, scene.ids, settings | self._settings, context)

    def _node_with(self, file: _OpenFile) -> Node:
        """The node with the file's settings and graph."""
        if self._node is None or self._built_for != (file.settings, file.context):
            self._stop()
            self._node = build_node("grounding", file.settings, file.context)
            self._node.start()
            self._built_for = file.settings, file.context
        if self._current is not file:
            self._node.step(file.graph)
            self._current = file
        return self._node

    def _stop(self) -> None:
        node, self._node, self._current = self._node, None, None
        if node is not None:
            node.stop()


def with_own_ids(reply: dict[str, Any], ids: dict[str, SourceId]) -> dict[str, Any]:
    """The same reply with the ids of the file's author in place of the graph's, in its sentences too."""

    def own(node_id: str | None) -> SourceId | None:
        return None if node_id is None else ids.get(node_id, node_id)

    def rewritten(sentences: list[str]) -> list[str]:
        return [NODE_ID.sub(lambda match: str(own(match[0])), sentence) for sentence in sentences]

    if not ids:
        return reply
    return reply | {
        "object_id": own(reply["object_id"]),
        "path": [step | {"id": own(step["id"])} for step in reply["path"]],
        "route": [own(node_id) for node_id in reply["route"]],
        "evidence": rewritten(reply["evidence"]),
        "candidates": [
            thing | {"id": own(thing["id"]), "evidence": rewritten(thing["evidence"])} for thing in reply["candidates"]
        ],
    }
