"""Naming: each Graph to a NamedGraph, whose rooms and locations are named by what they contain.

Source: paper, "Room Layer" and "Location Layer" (their text tags).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import Field

from placegraph.nodes.naming.evidence_naming import EvidenceNaming
from placegraph.nodes.naming.place_contents import place_contents
from placegraph.nodes.naming.place_types import LOCATION_TYPES, ROOM_TYPES
from placegraph.nodes.naming.prompt_naming import PromptNaming
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.language.grammar_options import SAFE_OPTION
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.messages import Graph, Message, NamedGraph
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.scene_graph import SceneGraph

# tokens; 26 are the most that an object of the evidence table's method needs, a list of 60 objects needs 400
N_CTX = 512


class NamingConfig(NodeConfig):
    """Settings of the naming node."""

    # "evidence": by the table of evidence weights. "language_model": by a prompt with the list of objects, as in the
    # paper. "none": places keep the names that they have, in a mapped graph none.
    method: Literal["evidence", "language_model", "none"] = "evidence"
    room_types: list[str] = Field(list(ROOM_TYPES))  # lists: what an array in TOML is
    location_types: list[str] = Field(list(LOCATION_TYPES))
    free_names: bool = False  # of "language_model": it may give other names than these types
    model_path: str = ""  # a GGUF file; empty: the packaged SmolLM2-135M-Instruct
    n_ctx: int = Field(N_CTX, ge=64)  # tokens


class NamingNode(Node):
    """Names the rooms and locations of each graph."""

    config_type = NamingConfig
    inputs = (Graph,)
    outputs = (NamedGraph,)
    restartable = True  # it only caches; a graph that a crash loses is followed by the next, which is complete
    config: NamingConfig

    def __init__(self, config: NamingConfig, context: Context) -> None:
        super().__init__(config, context)
        for setting, types in (("room_types", config.room_types), ("location_types", config.location_types)):
            unsafe = [name for name in types if not SAFE_OPTION.fullmatch(name)]
            if unsafe or not types:
                raise ConfigError(f"[nodes.naming] {setting}: names of letters and digits expected, found {unsafe}")
        path = Path(config.model_path) if config.model_path else None
        self._model = LanguageModel(path, threads=context.threads, n_ctx=config.n_ctx)
        place_types = {"room": config.room_types, "location": config.location_types}
        self._method: EvidenceNaming | PromptNaming
        if config.method == "language_model":
            self._method = PromptNaming(self._model, place_types, free_names=config.free_names)
        else:
            self._method = EvidenceNaming(self._model, place_types)

    def start(self) -> None:
        """Raise ModelError if the language model may be needed and is absent; it is loaded when first asked."""
        if self.config.method != "none":
            self._model.check_files()

    def stop(self) -> None:
        """Release the language model."""
        self._model.close()

    def step(self, message: Message) -> Sequence[Message]:
        """The graph with names. Raises SchemaError for a broken graph, ModelError where the model cannot be loaded."""
        assert isinstance(message, Graph)
        named_json = message.json
        if self.config.method != "none":
            graph = SceneGraph.from_json(message.json, f"Graph of revision {message.revision}")
            named_json = self._named(graph).to_json()
        named_graph = NamedGraph(
            frame_id=message.frame_id,
            stamp_ns=message.stamp_ns,
            revision=message.revision,
            final=message.final,
            place_types=(*self.config.room_types, *self.config.location_types),
            json=named_json,
        )
        return [named_graph]

    def _named(self, graph: SceneGraph) -> SceneGraph:
        for layer in ("location", "room"):  # a room may be named by its locations' names, too
            places = {place.id: self._method.names(layer, place_contents(graph, place)) for place in graph.layer(layer)}
            graph = graph.with_nodes(
                dataclasses.replace(node, tags=places[node.id]) if places.get(node.id) else node
                for node in graph.nodes.values()
            )
        return graph


NODE = NamingNode
