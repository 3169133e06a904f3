"""Grounding: scene graph and question to answer; also names rooms and locations.

Source: paper, "Deductive Hierarchical Reasoning Algorithm", "Room Layer" and "Location Layer" (their text tags).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.llm_parser import default_adapter_path
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.place_naming import LOCATION_TYPES, ROOM_TYPES, Namer
from placegraph.nodes.grounding.reasoner import Reasoner
from placegraph.nodes.grounding.reply_builder import failed_reply
from placegraph.nodes.grounding.settings import GroundingSettings
from placegraph.runtime.errors import ConfigError, ModelError, QueryError
from placegraph.runtime.language.grammar_options import SAFE
from placegraph.runtime.language.language_model import N_CTX, LanguageModel
from placegraph.runtime.messages import Answer, Graph, Message, PlaceNames, Question
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.scene_graph import SceneGraph


class GroundingConfig(NodeConfig):
    """Settings of the grounding node."""

    model_path: str = ""  # a GGUF file; empty: the packaged SmolLM2-135M-Instruct, with its adapter
    adapter_path: str = ""  # of a model of one's own, trained by `placegraph train reader`; empty: it reads by examples
    n_ctx: int = N_CTX  # tokens
    seed: int = 0
    name_places: bool = True  # False: rooms and locations stay without names
    use_model: bool = True  # False: no question is put to the language model; what it would decide stays open
    settings: GroundingSettings = GroundingSettings()  # the numbers of relations, names and scores
    room_types: list[str] = Field(list(ROOM_TYPES))  # lists: what an array in TOML is
    location_types: list[str] = Field(list(LOCATION_TYPES))


class Grounding(Node):
    """Keeps the newest graph, names its places, and answers each question with exactly one Answer."""

    config_type = GroundingConfig
    inputs = (Graph, Question)
    outputs = (PlaceNames, Answer)
    serves = (Question, Answer)

    def __init__(self, config: GroundingConfig, context: Context) -> None:
        super().__init__(config, context)
        for setting, types in (("room_types", config.room_types), ("location_types", config.location_types)):
            wrong = [name for name in types if not SAFE.fullmatch(name)]
            if wrong or not types:
                raise ConfigError(f"[nodes.grounding] {setting}: names of letters and digits expected, found {wrong}")
        path = Path(config.model_path) if config.model_path else None
        adapter = Path(config.adapter_path) if config.adapter_path else None if path else default_adapter_path()
        self._model = LanguageModel(
            path, adapter_path=adapter, threads=context.threads, n_ctx=config.n_ctx, seed=config.seed
        )
        encode = TextEncoder().encode
        self._namer = Namer(self._model, encode, config.room_types, config.location_types)
        place_types = (*config.room_types, *config.location_types)
        names = NameMatcher(encode, config.settings.names)
        self._reasoner = Reasoner(names, self._model, place_types, use_model=config.use_model, settings=config.settings)
        self._graph: SceneGraph | None = None
        self._revision = -1

    def start(self) -> None:
        """Load the language model, if it will be used. Raises ModelError."""
        if self.config.name_places or self.config.use_model:
            self._model.load()

    def stop(self) -> None:
        """Release the language model."""
        self._model.close()

    def step(self, message: Message) -> Sequence[Message]:
        """A Graph without names gives PlaceNames; a Question gives an Answer. Raises SchemaError for a broken graph."""
        if isinstance(message, Graph):
            return self._take_graph(message)
        assert isinstance(message, Question)
        return [self._answer(message)]

    def _take_graph(self, message: Graph) -> list[PlaceNames]:
        self._graph = SceneGraph.from_json(message.json, f"Graph of revision {message.revision}")
        self._revision = message.revision
        if message.named:
            return []
        found = self._namer.name_places(self._graph) if self.config.name_places else []
        names = PlaceNames(
            frame_id=message.frame_id,
            stamp_ns=message.stamp_ns,
            revision=message.revision,
            final=message.final,
            ids=tuple(name.node_id for name in found),
            names=tuple(name.name for name in found),
            weights=np.array([name.weight for name in found], np.float32),
        )
        return [names]

    def _answer(self, question: Question) -> Answer:
        try:
            if self._graph is None:
                raise QueryError("no scene graph has arrived yet")
            reply = self._reasoner.answer(self._graph, self._revision, question)
        except (QueryError, ModelError) as error:  # a question always gets a reply
            reply = failed_reply(question, self._revision, str(error))
        return Answer(
            frame_id=question.frame_id,
            stamp_ns=question.stamp_ns,
            question_id=question.question_id,
            json=reply.to_answer_json(),
        )


NODE = Grounding
