"""Which of the ranked candidates is meant, by the language model on the textualised small graph.

Source: paper, "Object Grounding"; METHOD section 10, step 4. Departs: geometry in code ranks them first.
"""

from __future__ import annotations

from collections.abc import Sequence

from placegraph.nodes.grounding.llm import LanguageModel, prompt
from placegraph.nodes.grounding.program import enum_rule
from placegraph.nodes.grounding.ranking import Candidate, Ranking
from placegraph.nodes.grounding.textualise import small_graph
from placegraph.nodes.grounding.words import tokens
from placegraph.runtime.errors import QueryError
from placegraph.runtime.scene_graph import SceneGraph

MOST_SHOWN = 8  # departs: candidates shown to the model; longer lists do not fit it and it does not read them
ID_TOKENS = 12  # departs: a space, a letter and a number; an id of ten digits still fits


def settle(model: LanguageModel | None, graph: SceneGraph, ranking: Ranking, text: str) -> bool:
    """Put the one that the model chooses of the tied candidates first; returns whether the evidence alone decided.

    model: None when there is nothing that it could read to tell the tied ones apart: the lowest id stands first.
    Raises QueryError.
    """
    tied = ranking.tied() if ranking.candidates else []
    if len(tied) < 2:
        return ranking.sure
    ranking.notes.append(f"{len(tied)} candidates fit equally: {_ids(tied)}")
    if model is not None and len(tied) <= MOST_SHOWN:
        asked = prompt("tie", objects=small_graph(graph, tied), question=" ".join(tokens(text)))
        reply = model.complete(asked, f"root ::= {enum_rule(list(map(_id, tied)))}", ID_TOKENS).text
        chosen = _put_first(ranking, tied, reply)
        ranking.notes.append(f"the language model chose {_id(chosen)}")
    return False


def _put_first(ranking: Ranking, offered: Sequence[Candidate], reply: str) -> Candidate:
    chosen = next((candidate for candidate in offered if _id(candidate) == reply), None)
    if chosen is None:
        raise QueryError(f"the language model chose {reply!r}, which was not offered")
    ranking.candidates.remove(chosen)
    ranking.candidates.insert(0, chosen)
    return chosen


def _id(candidate: Candidate) -> str:
    return candidate.node.id


def _ids(candidates: Sequence[Candidate]) -> str:
    return ", ".join(map(_id, candidates))
