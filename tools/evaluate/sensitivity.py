"""How much each number of grounding matters: perturbed by -20 % and +20 %, which answers to house questions change.

The true programs of questions and those that the rules read run on the houses' true graphs, without a language model.
True graphs have exact boxes and one tag per object, so numbers that absorb errors of a map hardly show here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel
from rich.progress import track

from placegraph.nodes.grounding.box_arrays import Layout, layout_of
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.program import Program
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.settings import DEFAULTS, GroundingSettings
from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.grounding_variants import QuestionScene, VariantRunner, true_program

FACTORS = (0.8, 1.2)


@dataclass(frozen=True, eq=False)
class ProgramCase:
    """One program to execute; right_id: the answer to its question."""

    graph: SceneGraph
    layout: Layout
    question: Question
    program: Program
    right_id: str


@dataclass(frozen=True)
class Sensitivity:
    """One setting, and for each factor how many answers change and the share that is right."""

    name: str
    value: float
    changed: tuple[int, ...]
    right: tuple[float, ...]


def cases_of(scenes: Sequence[QuestionScene], runner: VariantRunner) -> list[ProgramCase]:
    """The true program of each question, and the rules' program where it differs."""
    cases = []
    for scene in scenes:
        layout = layout_of(scene.graph)
        for asked in scene.questions:
            programs = [true_program(asked)]
            with suppress(QueryError):  # the rules find nothing to look for in some questions
                programs.append(runner.reasoner.parse(scene.graph, asked.text))
            for program in dict.fromkeys(programs):
                cases.append(ProgramCase(scene.graph, layout, scene.question(asked), program, f"O{asked.target}"))
    return cases


def sensitivity(cases: Sequence[ProgramCase], names: NameMatcher) -> tuple[float, list[Sensitivity]]:
    """The share of right answers, and the sensitivity of each setting, in the order of the settings."""
    base = _answers(cases, names, DEFAULTS)
    rows = []
    for theme, field, value in track(list(_numbers(DEFAULTS)), "settings"):
        answers = [_answers(cases, names, _changed(theme, field, value * factor)) for factor in FACTORS]
        changed = tuple(sum(a != b for a, b in zip(base, perturbed, strict=True)) for perturbed in answers)
        rows.append(Sensitivity(f"{theme}.{field}", value, changed, tuple(_right(cases, one) for one in answers)))
    return _right(cases, base), rows


def _numbers(settings: GroundingSettings) -> Iterator[tuple[str, str, float]]:
    for theme in type(settings).model_fields:
        part: BaseModel = getattr(settings, theme)
        for field in type(part).model_fields:
            yield theme, field, getattr(part, field)


def _changed(theme: str, field: str, value: float) -> GroundingSettings:
    part: BaseModel = getattr(DEFAULTS, theme)
    return DEFAULTS.model_copy(update={theme: part.model_copy(update={field: value})})


def _answers(cases: Sequence[ProgramCase], names: NameMatcher, settings: GroundingSettings) -> list[str]:
    names = names.with_settings(settings.names)
    answers = []
    for case in cases:
        asker = np.asarray(case.question.viewpoint_world, float)
        heading = case.question.heading_rad
        executor = ProgramExecutor(case.graph, names, asker, heading, case.layout, settings)
        candidates = executor.rank(case.program).candidates
        answers.append(candidates[0].node.id if candidates else "")
    return answers


def _right(cases: Sequence[ProgramCase], answers: Sequence[str]) -> float:
    return float(np.mean([answer == case.right_id for answer, case in zip(answers, cases, strict=True)]))
