"""`placegraph evaluate grounding`: house questions with and without the parts of grounding, in one table."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from placegraph.runtime.errors import ConfigError
from placegraph.tools.evaluate.grounding_scores import QuestionResult, grounding_scores
from placegraph.tools.evaluate.grounding_variants import (
    VARIANTS,
    QuestionScene,
    VariantRunner,
    chosen_variants,
    house_scene,
    map_scene,
)
from placegraph.tools.evaluate.report import number, plain, table
from placegraph.tools.evaluate.sensitivity import cases_of, sensitivity

HEADS = ("exact id", "Acc@.1", "Acc@.25", "Acc@.5", "Acc@.75", "not in map", "errors", "ms p50", "ms p95", "calls")


def evaluate_grounding(
    maps: Annotated[list[Path] | None, typer.Argument(metavar="MAP", help="Map folders.")] = None,
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
    """Ask a house's questions, with and without parts of grounding.

    They are asked of its true graph or of a map.
    """
    scenes = _scenes(maps or [], source or [], houses, count)
    runner = VariantRunner(threads)
    if perturb:
        _print_sensitivity(scenes, runner)
        return
    scores: dict[str, dict[str, Any]] = {}
    for i, variant in enumerate(chosen_variants(variants)):
        results = [[runner.ask(variant, scene, asked) for asked in scene.questions] for scene in scenes]
        scores[variant] = variant_scores(scenes, results)
        if wrong and i == 0:
            _print_wrong(scenes, results)
        print(f"{variant}: Acc@.25 {scores[variant]['all']['acc_0.25']:.3f}", file=sys.stderr, flush=True)
    measure = "exact" if houses else "acc_0.25"
    print(json.dumps(plain(scores), sort_keys=True) if as_json else _text(scores, forms, measure))


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
        return [map_scene(*folders) for folders in zip(maps, source, strict=True)]
    first, _, last = houses.partition("-")
    if not first.isdigit() or not (last or first).isdigit() or int(last or first) < int(first):
        raise ConfigError(f"--houses {houses}: expected a seed or a range of seeds like 9000-9009")
    return [house_scene(seed, count) for seed in range(int(first), int(last or first) + 1)]


def variant_scores(scenes: Sequence[QuestionScene], results: Sequence[Sequence[QuestionResult]]) -> dict[str, Any]:
    """Scores of one variant overall and by form, over the questions of all scenes."""
    asked = [(i, question) for i, scene in enumerate(scenes) for question in scene.questions]
    boxes = {f"{i}/{node_id}": box for i, scene in enumerate(scenes) for node_id, box in scene.boxes.items()}
    flat = [
        replace(result, object_id=f"{i}/{result.object_id}" if result.object_id else "")
        for i, scene_results in enumerate(results)
        for result in scene_results
    ]
    scores = grounding_scores([question for _, question in asked], flat, boxes)
    exact = np.array([result.object_id == f"{i}/O{q.target}" for (i, q), result in zip(asked, flat, strict=True)])
    forms = np.array([question.form for _, question in asked], object)
    ms = np.array([result.ms for result in flat])
    for form, row in [("", scores["all"]), *scores["forms"].items()]:
        of_form = forms == form if form else np.ones(len(forms), bool)
        row["exact"] = float(exact[of_form].mean()) if all(scene.true_ids for scene in scenes) else float("nan")
        row["ms_p50"], row["ms_p95"] = (float(percentile) for percentile in np.percentile(ms[of_form], (50, 95)))
    return scores


def _print_wrong(scenes: Sequence[QuestionScene], results: Sequence[Sequence[QuestionResult]]) -> None:
    for scene, scene_results in zip(scenes, results, strict=True):
        for asked, result in zip(scene.questions, scene_results, strict=True):
            if result.object_id != f"O{asked.target}":
                answer = result.object_id or result.status
                print(f"{scene.name} {asked.form}: {asked.text!r} -> {answer}, O{asked.target}")


def _text(scores: dict[str, dict[str, Any]], forms: bool, measure: str) -> str:
    first = next(iter(scores.values()))
    rows = [[f"{first['all']['questions']} questions", *HEADS]]
    parts = [table(rows + [[variant, *_cells(row["all"])] for variant, row in scores.items()])]
    if forms:
        rows = [[f"{measure} by form", "questions", *scores]]
        for form, counts in first["forms"].items():
            values = (number(row["forms"][form][measure]) for row in scores.values())
            rows.append([form, str(counts["questions"]), *values])
        parts.append(table(rows))
    return "\n\n".join(parts)


def _cells(row: dict[str, Any]) -> list[str]:
    shares = [row["exact"], *(row[f"acc_{iou}"] for iou in ("0.1", "0.25", "0.5", "0.75"))]
    times = [row["ms_p50"], row["ms_p95"]]
    return [
        *map(number, shares), str(row["not_in_map"]), str(row["errors"]), *(number(ms, 0) for ms in times),
        number(row["calls"], 2),
    ]  # fmt: skip
