"""`placegraph evaluate-grounding`: house questions with and without the parts of grounding, in one table."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from placegraph.runtime.errors import ConfigError
from placegraph.tools.evaluate.ablations import (
    VARIANTS,
    QuestionScene,
    VariantRunner,
    chosen_variants,
    house_scene,
    map_scene,
)
from placegraph.tools.evaluate.grounding import GroundingResult, grounding_scores
from placegraph.tools.evaluate.report import number, plain, table
from placegraph.tools.evaluate.sensitivity import cases_of, sensitivity

HEADS = ("exact id", "Acc@.1", "Acc@.25", "Acc@.5", "Acc@.75", "not in map", "errors", "ms p50", "ms p95", "calls")


def evaluate_grounding(
    maps: Annotated[list[Path] | None, typer.Argument(metavar="[MAP]...", help="Map folders.")] = None,
    source: Annotated[
        list[Path] | None, typer.Option(help="The house of each map, in the same order; its questions are asked.")
    ] = None,
    houses: Annotated[str, typer.Option(help="Instead: true graphs of houses, seeds A-B.")] = "",
    count: Annotated[int, typer.Option(min=1, help="With --houses: questions about each.")] = 32,
    variants: Annotated[
        str, typer.Option(help=f"With and without what, of: {', '.join(VARIANTS)}.")
    ] = "program,oracle,no relations,flat,rules",
    forms: Annotated[bool, typer.Option("--forms", help="Also by form of question.")] = False,
    perturb: Annotated[
        bool, typer.Option("--sensitivity", help="Instead: perturb each number of grounding by 20 %, without a model.")
    ] = False,
    wrong: Annotated[bool, typer.Option("--wrong", help="Print what the first variant answers wrong.")] = False,
    threads: Annotated[int, typer.Option(min=1, help="Threads of the language model.")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Ask questions of houses whose one right answer is known, of their true graphs or of maps of them."""
    scenes = _scenes(maps or [], source or [], houses, count)
    runner = VariantRunner(threads)
    if perturb:
        _print_sensitivity(scenes, runner)
        return
    scores: dict[str, dict[str, Any]] = {}
    for i, variant in enumerate(chosen_variants(variants)):
        replies = [[runner.ask(variant, scene, asked) for asked in scene.questions] for scene in scenes]
        scores[variant] = variant_scores(scenes, replies)
        if wrong and i == 0:
            _print_wrong(scenes, replies)
        print(f"{variant}: Acc@.25 {scores[variant]['all']['acc_0.25']:.3f}", file=sys.stderr, flush=True)
    print(
        json.dumps(plain(scores), sort_keys=True)
        if as_json
        else _text(scores, forms, "exact" if houses else "acc_0.25")
    )


def _print_sensitivity(scenes: Sequence[QuestionScene], runner: VariantRunner) -> None:
    if not all(scene.true_ids for scene in scenes):
        raise ConfigError("--sensitivity needs true graphs: --houses A-B")
    cases = cases_of(scenes, runner)
    right, rows = sensitivity(cases, runner.names)
    heads = [f"{len(cases)} programs, {right:.4f} right", "value", "changed -20 %", "+20 %", "right -20 %", "+20 %"]
    rows.sort(key=lambda row: -sum(row.changed))
    body = [[r.name, f"{r.value:g}", *map(str, r.changed), *(f"{share:.4f}" for share in r.right)] for r in rows]
    print(table([heads, *body]))


def _scenes(maps: list[Path], source: list[Path], houses: str, count: int) -> list[QuestionScene]:
    if bool(maps) == bool(houses):
        raise ConfigError("either MAP... with --source, or --houses must say of what is asked")
    if len(maps) != len(source):
        raise ConfigError(f"{len(maps)} maps and {len(source)} --source: one for each map, in the same order")
    if maps:
        return [map_scene(*one) for one in zip(maps, source, strict=True)]
    first, _, last = houses.partition("-")
    if not first.isdigit() or not (last or first).isdigit() or int(last or first) < int(first):
        raise ConfigError(f"--houses {houses}: expected a seed or a range of seeds like 9000-9009")
    return [house_scene(seed, count) for seed in range(int(first), int(last or first) + 1)]


def variant_scores(scenes: Sequence[QuestionScene], replies: Sequence[Sequence[GroundingResult]]) -> dict[str, Any]:
    """Scores of one variant in all and by form: of all scenes' questions together."""
    asked = [(i, question) for i, scene in enumerate(scenes) for question in scene.questions]
    boxes = {f"{i}/{node_id}": box for i, scene in enumerate(scenes) for node_id, box in scene.boxes.items()}
    flat = [
        GroundingResult(one.status, f"{i}/{one.object_id}" if one.object_id else "", one.calls, one.ms)
        for i, scene in enumerate(replies)
        for one in scene
    ]
    scores = grounding_scores([question for _, question in asked], flat, boxes)
    exact = np.array([reply.object_id == f"{i}/O{one.target}" for (i, one), reply in zip(asked, flat, strict=True)])
    names = np.array([one.form for _, one in asked], object)
    ms = np.array([reply.ms for reply in flat])
    rows = [("", scores["all"]), *scores["forms"].items()]
    for form, row in rows:
        in_form = names == form if form else np.ones(len(names), bool)
        row["exact"] = float(exact[in_form].mean()) if all(scene.true_ids for scene in scenes) else float("nan")
        row["ms_p50"], row["ms_p95"] = (float(np.percentile(ms[in_form], share)) for share in (50, 95))
    return scores


def _print_wrong(scenes: Sequence[QuestionScene], replies: Sequence[Sequence[GroundingResult]]) -> None:
    for scene, results in zip(scenes, replies, strict=True):
        for asked, reply in zip(scene.questions, results, strict=True):
            if reply.object_id != f"O{asked.target}":
                print(
                    f"{scene.name} {asked.form}: {asked.text!r} -> {reply.object_id or reply.status}, O{asked.target}"
                )


def _text(scores: dict[str, dict[str, Any]], forms: bool, measure: str) -> str:
    questions = next(iter(scores.values()))["all"]["questions"]
    rows = [[f"{questions} questions", *HEADS], *([name, *_cells(one["all"])] for name, one in scores.items())]
    parts = [table(rows)]
    if forms:
        names = list(next(iter(scores.values()))["forms"])
        counts = next(iter(scores.values()))["forms"]
        heads = [f"{measure} by form", "questions", *scores]
        body = [
            [form, str(counts[form]["questions"]), *(number(one["forms"][form][measure]) for one in scores.values())]
            for form in names
        ]
        parts.append(table([heads, *body]))
    return "\n\n".join(parts)


def _cells(row: dict[str, Any]) -> list[str]:
    shares = [row["exact"], *(row[f"acc_{iou}"] for iou in ("0.1", "0.25", "0.5", "0.75"))]
    times = [row["ms_p50"], row["ms_p95"]]
    return [
        *map(number, shares), str(row["not_in_map"]), str(row["errors"]), *(number(ms, 0) for ms in times),
        number(row["calls"], 2),
    ]  # fmt: skip
