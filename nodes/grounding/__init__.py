"""Grounding: the named scene graph and a question to the answer.

Source: paper, "Deductive Hierarchical Reasoning Algorithm".
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.llm_parser import default_adapter_path
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.reasoner import Reasoner
from placegraph.nodes.grounding.reply_builder import failed_reply
from placegraph.nodes.grounding.settings import GroundingSettings
from placegraph.runtime.errors import ModelError, QueryError
from placegraph.runtime.language.language_model import N_CTX, LanguageModel
from placegraph.runtime.messages import Answer, Message, NamedGraph, Question
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.scene_graph import SceneGraph


class GroundingConfig(NodeConfig):
    """Settings of the grounding node."""

    model_path: str = ""  # a GGUF file; empty: the packaged SmolLM2-135M-Instruct, with its adapter
    adapter_path: str = ""  # of a model of one's own, trained by `placegraph train reader`; empty: it reads by examples
    n_ctx: int = N_CTX  # tokens
    seed: int = 0
    use_model: bool = True  # False: no question is put to the language model; what it would decide stays open
    settings: GroundingSettings = GroundingSettings()  # the numbers of relations, names and scores


class GroundingNode(Node):
    """Keeps the newest graph and answers each question with exactly one Answer."""

    config_type = GroundingConfig
    inputs = (NamedGraph, Question)
    outputs = (Answer,)
    serves = (Question, Answer)

    def __init__(self, config: GroundingConfig, context: Context) -> None:
        super().__init__(config, context)
        path = Path(config.model_path) if config.model_path else None
        adapter = Path(config.adapter_path) if config.adapter_path else None if path else default_adapter_path()
        self._model = LanguageModel(
            path, adapter_path=adapter, threads=context.threads, n_ctx=config.n_ctx, seed=config.seed
        )
        self._names = NameMatcher(TextEncoder().encode, config.settings.names)
        self._graph: SceneGraph | None = None
        self._revision = -1
        self._reasoner: Reasoner | None = None  # of the newest graph

    def start(self) -> None:
        """Load the language model, if it will be used. Raises ModelError."""
        if self.config.use_model:
            self._model.load()

    def stop(self) -> None:
        """Release the language model."""
        self._model.close()

    def step(self, message: Message) -> Sequence[Message]:
        """A graph is kept, a Question gives an Answer. Raises SchemaError for a broken graph."""
        if isinstance(message, NamedGraph):
            self._graph = SceneGraph.from_json(message.json, f"NamedGraph of revision {message.revision}")
            self._revision = message.revision
            self._reasoner = Reasoner(
                self._names,
                self._model,
                message.place_types,
                use_model=self.config.use_model,
                settings=self.config.settings,
            )
            return []
        assert isinstance(message, Question)
        return [self._answer(message)]

    def _answer(self, question: Question) -> Answer:
        try:
            if self._graph is None or self._reasoner is None:
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


NODE = GroundingNode
