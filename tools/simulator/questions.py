"""Questions about a house, each with exactly one right object, computed from the true boxes alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.simulator.house_model import House
from placegraph.tools.simulator.question_generation.asker_positions import asker_positions
from placegraph.tools.simulator.question_generation.attribute_questions import attribute_questions, location_questions
from placegraph.tools.simulator.question_generation.box_relations import relations
from placegraph.tools.simulator.question_generation.item_table import ItemTable, item_table
from placegraph.tools.simulator.question_generation.question_phrasing import phrase_question, usable_scope_phrases
from placegraph.tools.simulator.question_generation.question_spec import QuestionSpec
from placegraph.tools.simulator.question_generation.relation_questions import (
    between_questions,
    chain_questions,
    relation_questions,
    two_relation_questions,
)
from placegraph.tools.simulator.question_generation.search_scopes import search_scopes
from placegraph.tools.simulator.question_generation.viewpoint_questions import ordinal_questions, viewpoint_questions

SALT = 8_009  # a random stream of its own
MAX_PER_TARGET = 3
SMALL_TARGET_M = 0.15  # smaller targets are used only when others run out
FIELDS = ("text", "target", "box", "form", "anchors", "room", "floor", "viewpoint", "program")


@dataclass(frozen=True, eq=False)
class HouseQuestion:
    """A question and its answer: the target's id and box (2, 3) min and max in metres, world frame."""

    text: str
    target: int
    box: F64
    form: str
    anchors: tuple[int, ...]  # ids of the anchors
    room: int  # of the target
    floor: int
    viewpoint: F64 | None = None  # (3,) eyes of the asker, when the answer depends on them
    program: str = ""  # its meaning in nodes/grounding/program_syntax.py; "" in older files


def generate_questions(house: House, seed: int, count: int = 60) -> list[HouseQuestion]:
    """Up to `count` questions about a furnished house, spread over forms, rooms and targets.

    Raises ConfigError when the count is negative or the house's items are not numbered from 0.
    """
    if count < 0:
        raise ConfigError(f"count: {count} questions cannot be asked; give 0 or more")
    if not house.items:
        return []
    random = np.random.default_rng([seed, SALT])
    table = item_table(house)
    asked: list[HouseQuestion] = []
    texts: list[str] = []
    for spec in _choose_varied(table, questions_by_form(table, random), count, random):
        text, anchors, program = phrase_question(spec, random)
        target = spec.target.id
        box = np.stack((table.low[target], table.high[target]))
        if text not in texts:
            texts.append(text)
            room, floor = int(table.room[target]), int(table.floor[target])
            asked.append(HouseQuestion(text, target, box, spec.form, anchors, room, floor, spec.eye, program))
    return asked


def questions_by_form(table: ItemTable, random: np.random.Generator) -> dict[str, list[QuestionSpec]]:
    """All questions about a house that have one right answer, by form, in random order."""
    places = search_scopes(table)
    positions = asker_positions(table.house, random)
    answers = relations(table)
    specs = [*attribute_questions(table, places), *location_questions(table, places)]
    for scope in places:
        specs += relation_questions(table, scope, answers)
        specs += between_questions(table, scope)
        specs += two_relation_questions(table, scope, answers, random)
        specs += chain_questions(table, scope, answers)
        specs += viewpoint_questions(table, scope, positions)
        specs += ordinal_questions(table, scope, positions)
    forms: dict[str, list[QuestionSpec]] = {}
    specs = [spec for spec in specs if usable_scope_phrases(spec)]
    for k in random.permutation(len(specs)).tolist():
        forms.setdefault(specs[k].form, []).append(specs[k])
    return {form: forms[form] for form in sorted(forms)}


def _choose_varied(
    table: ItemTable, forms: dict[str, list[QuestionSpec]], count: int, random: np.random.Generator
) -> list[QuestionSpec]:
    """Questions from all forms in turn, each time the one whose target, room and class were used least."""
    targets: Counter[int] = Counter()
    rooms: Counter[int] = Counter()
    classes: Counter[str] = Counter()
    chosen: list[QuestionSpec] = []
    small = table.size.max(axis=1) < SMALL_TARGET_M

    def weight(spec: QuestionSpec) -> tuple[float, ...]:
        target = spec.target.id
        worn = 2.0 * targets[target] + 0.5 * classes[table.names[target]] + 0.25 * rooms[int(table.room[target])]
        return (worn + 1.5 * (not spec.is_ambiguous) + 2.0 * float(small[target]),)

    while len(chosen) < count and any(forms.values()):
        for form in random.permutation(sorted(forms)).tolist():
            left = [spec for spec in forms[form] if targets[spec.target.id] < MAX_PER_TARGET]
            forms[form] = left
            if not left or len(chosen) == count:
                continue
            best = min(range(len(left)), key=lambda k: weight(left[k]))
            spec = left.pop(best)
            chosen.append(spec)
            targets[spec.target.id] += 1
            rooms[int(table.room[spec.target.id])] += 1
            classes[table.names[spec.target.id]] += 1
    return chosen


def to_json(asked: Sequence[HouseQuestion]) -> list[dict[str, Any]]:
    """Questions as plain values for a JSON file, lengths rounded to 1 mm."""
    return [
        {
            "text": question.text,
            "target": question.target,
            "box": np.round(question.box, 3).tolist(),
            "form": question.form,
            "anchors": list(question.anchors),
            "room": question.room,
            "floor": question.floor,
            "viewpoint": None if question.viewpoint is None else np.round(question.viewpoint, 3).tolist(),
            "program": question.program,
        }
        for question in asked
    ]


def from_json(values: Sequence[dict[str, Any]]) -> list[HouseQuestion]:
    """The questions of to_json's values; raises SourceError naming the first one that is damaged."""
    return [_read(value, k) for k, value in enumerate(values)]


def _read(value: dict[str, Any], place: int) -> HouseQuestion:
    if isinstance(value, dict) and "program" not in value:
        value = value | {"program": ""}  # older files have none
    if not isinstance(value, dict) or sorted(value) != sorted(FIELDS):
        raise SourceError(f"question {place}: expected the fields {', '.join(FIELDS)}")
    try:
        box = np.array(value["box"], np.float64).reshape(2, 3)
        eye = None if value["viewpoint"] is None else np.array(value["viewpoint"], np.float64).reshape(3)
        ids = [int(value[name]) for name in ("target", "room", "floor")]
        anchors = tuple(int(anchor) for anchor in value["anchors"])
    except (TypeError, ValueError):
        raise SourceError(f"question {place}: a number, the box or the viewpoint is damaged") from None
    text, form, program = (str(value[name]) for name in ("text", "form", "program"))
    return HouseQuestion(text, ids[0], box, form, anchors, ids[1], ids[2], eye, program)
