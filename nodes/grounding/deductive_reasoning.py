"""Mode "deductive": the paper's flow. A chat model selects in each layer, then chooses from a small graph with edges.

Floors, rooms, locations and objects are offered in turn; in each layer the model keeps what may be or hold the target
and what may be or hold the anchors. Edges between targets and anchors are computed, and the last call picks the object.
Source: paper, "Deductive Hierarchical Reasoning Algorithm". Not as in the paper: a place is offered with its contents,
because room names are weak evidence; a grammar allows only existing ids; long lists are ranked by name and cut.
At most 17 calls: four layers with up to four calls each, and the last one; 2 to 5 when each layer fits one call.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from placegraph.nodes.grounding.attributes import BASIC_COLORS, color_fit
from placegraph.nodes.grounding.edge_descriptions import edges
from placegraph.nodes.grounding.llm_selection import NONE, Dialogue, Entry, Selection
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.ranking import Candidate, Ranking
from placegraph.nodes.grounding.rule_parser import check_text
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.language.prompts import safe_name
from placegraph.runtime.language.word_forms import tokens
from placegraph.runtime.query.reply import LayerSelection
from placegraph.runtime.scene_graph import GraphNode, id_key

# Chosen by hand, so that a layer fits one call of a small model.
MAX_LISTED = 48  # entries of a layer that are shown; of more the best by name
MAX_CONTENTS = 8  # names of what a place holds
MAX_TAGS = 3  # names of one object
MAX_TARGETS, MAX_ANCHORS = 12, 8  # of the small graph
MAX_EDGES = 3  # nearest anchors that a target is compared with
OTHERS = 0.5  # score of a target that was not chosen; the model gives no numbers


@dataclass(frozen=True)
class _LevelNodes:
    """Nodes of one layer that may be or hold the target, and those that may be or hold the anchors."""

    targets: Sequence[GraphNode]
    anchors: Sequence[GraphNode]

    @property
    def both(self) -> list[GraphNode]:
        return sorted({node.id: node for node in (*self.targets, *self.anchors)}.values(), key=lambda n: id_key(n.id))

    @property
    def ids(self) -> list[str]:
        return [node.id for node in self.both]


def deduce(model: LanguageModel, executor: ProgramExecutor, question: str) -> tuple[LayerSelection, Ranking]:
    """The selection of each layer, and the ranking with the chosen object first; empty when the model finds none.

    executor: made for the graph and the asker. Raises QueryError when the text is no question, or when a single entry
    does not fit the context.
    """
    check_text(question)
    return _DeductiveSearch(model, executor, question).run()


class _DeductiveSearch:
    """The calls of one question."""

    def __init__(self, model: LanguageModel, executor: ProgramExecutor, question: str) -> None:
        self._executor, self._graph, self._names = executor, executor.graph, executor.names
        self._dialogue = Dialogue(model, question)
        self._question_phrases = _question_phrases(question)
        self._notes: list[str] = ["read level by level (deductive mode)"]

    def run(self) -> tuple[LayerSelection, Ranking]:
        all_floors = self._graph.layer("floor")
        floors = self._narrow("floor", _LevelNodes(all_floors, all_floors))
        rooms = self._narrow("room", _LevelNodes(self._below(floors.targets), self._below(floors.anchors)))
        places = self._narrow("location", _LevelNodes(self._parts(rooms.targets), self._parts(rooms.anchors)))
        things = self._narrow("object", _LevelNodes(self._things(places.targets), self._things(places.anchors)))
        targets = list(things.targets)[:MAX_TARGETS]
        anchors = list(things.anchors)[:MAX_ANCHORS]  # may be targets as well: "the chair beside the other chair"
        if len(targets) < len(things.targets):
            self._notes.append(f"of {len(things.targets)} targets the first {len(targets)} were compared")
        levels = LayerSelection(
            floors=floors.ids,
            rooms=rooms.ids,
            locations=[node_id for node_id in places.ids if node_id.startswith("L")],
            targets=[node.id for node in targets],
            anchors=[node.id for node in anchors],
        )
        return levels, self._ground(targets, anchors)

    def _below(self, floors: Sequence[GraphNode]) -> list[GraphNode]:
        return [room for floor in floors for room in self._graph.children(floor.id)]

    def _parts(self, rooms: Sequence[GraphNode]) -> list[GraphNode]:
        """The locations of rooms, and each room that has objects outside of its locations."""
        children = {room.id: self._graph.children(room.id) for room in rooms}
        loose = [room for room in rooms if any(node.layer == "object" for node in children[room.id])]
        return [*loose, *(node for room in rooms for node in children[room.id] if node.layer == "location")]

    def _things(self, places: Sequence[GraphNode]) -> list[GraphNode]:
        return [node for place in places for node in self._graph.children(place.id) if node.layer == "object"]

    def _narrow(self, layer: str, within: _LevelNodes) -> _LevelNodes:
        """Let the model select in one layer; everything is kept when there is nothing to choose from."""
        nodes = within.both
        nothing_to_choose = len(nodes) < 2 if layer != "object" else not nodes
        if nothing_to_choose or (layer == "location" and not any(node.layer == layer for node in nodes)):
            return within
        ranked = self._ranked(nodes) if len(nodes) > MAX_LISTED else nodes
        possible = {node.id for node in within.targets}
        step = "deduce_objects" if layer == "object" else "deduce_places"
        entries = [Entry(node.id, self._described(node)) for node in ranked[:MAX_LISTED]]
        selection = self._dialogue.select(step, entries, [entry.id for entry in entries if entry.id in possible])
        self._notes += _selection_notes(layer, len(nodes), selection)
        if not selection.targets and layer != "object":
            self._notes.append(f"no {layer} was kept for the target: all were searched")
            return within
        by_id = self._graph.nodes
        anchors = [by_id[node_id] for node_id in selection.anchors]
        # when no place is selected for the anchors, they are looked for where the target may be
        return _LevelNodes(
            [by_id[node_id] for node_id in selection.targets], anchors or ([] if layer == "object" else within.targets)
        )

    def _ranked(self, nodes: Sequence[GraphNode]) -> list[GraphNode]:
        """The nodes by how well words of the question name them or their contents; equal ones by id."""
        similarity: dict[str, float] = {}

        def fit(node: GraphNode) -> float:
            names = {tag.name for tag in node.tags} | (
                {content.name for content in self._contents(node)} - {node.layer}
            )
            for name in names - similarity.keys():
                similarity[name] = max(
                    (self._names.similarity(phrase, name) for phrase in self._question_phrases), default=0.0
                )
            return max((similarity[name] for name in names), default=0.0)

        return sorted(nodes, key=lambda node: (-fit(node), id_key(node.id)))

    def _contents(self, node: GraphNode) -> list[GraphNode]:
        """What describes a place: a floor's rooms, a room's or location's objects."""
        if node.layer == "object":
            return []
        if node.layer == "floor":
            return self._graph.children(node.id)
        below = self._graph.children(node.id)
        return [node for child in below for node in ([child] if child.layer == "object" else self._things([child]))]

    def _described(self, node: GraphNode) -> str:
        if node.layer == "object":
            return self._object(node)
        counted = Counter(
            name for item in self._contents(node) if (name := safe_name(item.tags[0].name if item.tags else ""))
        )
        holds = ", ".join(name for name, _ in counted.most_common(MAX_CONTENTS))
        inside = f" in {self._name(self._graph.nodes[node.parent])} {node.parent}" if node.layer == "location" else ""
        return f"{self._name(node)}{inside} ({holds or 'nothing named'})"

    def _object(self, node: GraphNode) -> str:
        names = [name for tag in node.tags[:MAX_TAGS] if (name := safe_name(tag.name))] or [node.layer]
        color = (
            max(BASIC_COLORS, key=lambda name: color_fit(node, name, self._executor.settings.appearance))
            if len(node.color) == 3
            else ""
        )
        other_names = f" or {' or '.join(names[1:])}" if names[1:] else ""
        place = self._name(self._graph.nodes[node.parent])
        return ", ".join(part for part in (names[0] + other_names, color, f"in {place}") if part)

    def _name(self, node: GraphNode) -> str:
        return safe_name(node.name, node.layer)

    def _ground(self, targets: Sequence[GraphNode], anchors: Sequence[GraphNode]) -> Ranking:
        """The last call, on the small graph of targets and their edges."""
        ranking = Ranking(notes=self._notes, sure=False)
        if not targets:
            ranking.notes.append("the language model found nothing in the map that can be meant")
            return ranking
        shown, edges_of = self._small_graph(targets, anchors)
        chosen, reason = self._dialogue.choose("deduce_ground", shown)
        listed = ", ".join(entry.id for entry in shown)
        if len(shown) < len(targets):
            ranking.notes.append(f"of {len(targets)} targets the first {len(shown)} fit the last call")
        if anchors:
            seen_from = self._executor.viewpoint(targets[0]).source
            ranking.notes.append(f"left, right, front and behind are meant from the {seen_from}")
        ranking.notes.append(f"the language model chose {chosen} among {listed}: {reason}")
        if chosen != NONE:
            ordered = sorted(targets, key=lambda node: node.id != chosen)
            ranking.candidates = [
                Candidate(
                    node,
                    1.0 if node.id == chosen else OTHERS,
                    [f"{node.name} {node.id} is {edge}" for edge in edges_of[node.id]],
                )
                for node in ordered
            ]
        return ranking

    def _small_graph(
        self, targets: Sequence[GraphNode], anchors: Sequence[GraphNode]
    ) -> tuple[list[Entry], dict[str, list[str]]]:
        """The targets with as many edges as fit one call, if need be fewer targets; and all edges by target id."""
        edges_of = {node.id: edges(self._executor, node, anchors, MAX_EDGES) for node in targets}
        for edge_count in range(MAX_EDGES, -1, -1):
            entries = [Entry(node.id, self._with_edges(node, edges_of[node.id][:edge_count])) for node in targets]
            if self._dialogue.fits("deduce_ground", entries):
                return entries, edges_of
        while len(entries) > 1 and not self._dialogue.fits("deduce_ground", entries):
            entries.pop()
        return entries, edges_of

    def _with_edges(self, node: GraphNode, edge_texts: Sequence[str]) -> str:
        size = " x ".join(f"{side:.1f}" for side in np.ptp(node.box, axis=0))
        return "; ".join([f"{self._object(node)}, {size} m", *edge_texts])


def _question_phrases(question: str) -> list[str]:
    """The words of a question and the pairs of neighbouring words, without punctuation."""
    words = [word for word in tokens(question) if word[0].isalnum()]
    return list(dict.fromkeys([*words, *(f"{a} {b}" for a, b in pairwise(words))]))


def _selection_notes(layer: str, count: int, selection: Selection) -> list[str]:
    """Notes on what the model selected in a layer and why, and on what it was not shown."""
    kept = ", ".join(selection.targets) or "none"
    anchors = f", and {', '.join(selection.anchors)} to tell it by" if selection.anchors else ""
    notes = [f"{layer}s: the language model kept {kept} for the target{anchors}: {'; '.join(selection.reasons)}"]
    if selection.shown < count:
        notes.append(
            f"of {count} {layer}s those {selection.shown} named most like the question were shown, "
            f"in {selection.calls} calls"
        )
    return notes
