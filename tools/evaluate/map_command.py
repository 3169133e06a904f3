"""`placegraph evaluate map`: the error of maps against the ground truth of their data sets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from placegraph.runtime.errors import ConfigError


def evaluate_map(
    maps: Annotated[list[Path], typer.Argument(metavar="MAP", help="Map folders that `placegraph run` wrote.")],
    source: Annotated[
        list[Path] | None, typer.Option(help="The data set with the given poses; with a truth/, all else is scored.")
    ] = None,
    against: Annotated[list[Path] | None, typer.Option(help="A truth file (JSON) instead of a data set.")] = None,
    progress: Annotated[bool, typer.Option("--progress", help="Score the map after each quarter of the walk.")] = False,
    questions: Annotated[bool, typer.Option("--questions", help="Ask the map the house's questions, too.")] = False,
    per_class: Annotated[bool, typer.Option("--per-class", help="Print the objects by class.")] = False,
    write_truth: Annotated[Path | None, typer.Option(help="Write the house's truth as a truth file.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare maps with their ground truth, layer by layer.

    Scored are the trajectory and whichever of floors, rooms, locations and objects the truth has.

    Several maps, each with its own --source or --against in the same order, give a table with the means. A map is
    rotated about z and shifted so that the trajectories fit best; it is not levelled.
    """
    from placegraph.tools.evaluate.map_evaluation import file_scores, quarter_scores, source_scores, write_house_truth
    from placegraph.tools.evaluate.report import map_text, plain

    truths = _truths(maps, source or [], against or [])
    _check_options(maps, source or [], progress, questions, per_class, write_truth)
    if write_truth is not None:
        write_house_truth(truths[0], write_truth)
    if progress:
        by_map = [quarter_scores(*pair) for pair in zip(maps, truths, strict=True)]
        quarters = {quarter: [scores[quarter] for scores in by_map] for quarter in by_map[0]}
        _print_table({quarter: dict(zip(maps, rows, strict=True)) for quarter, rows in quarters.items()}, as_json)
        return
    score = file_scores if against else lambda folder, path: source_scores(folder, path, questions)
    scores = [score(*pair) for pair in zip(maps, truths, strict=True)]
    if len(scores) > 1:
        _print_table({"": dict(zip(maps, scores, strict=True))}, as_json)
    else:
        print(json.dumps(plain(scores[0]), sort_keys=True) if as_json else map_text(scores[0], per_class))


def _truths(maps: list[Path], source: list[Path], against: list[Path]) -> list[Path]:
    if bool(source) == bool(against):
        raise ConfigError("either --source or --against must say what the map is compared with")
    option, truths = ("--source", source) if source else ("--against", against)
    if len(truths) != len(maps):
        raise ConfigError(f"{len(maps)} maps and {len(truths)} {option}: one for each map is needed, in the same order")
    if len(set(maps)) != len(maps):
        raise ConfigError("a map is named twice")
    return truths


def _check_options(
    maps: list[Path], source: list[Path], progress: bool, questions: bool, per_class: bool, write_truth: Path | None
) -> None:
    """Raises ConfigError for options that need one map, or a house, and do not have it."""
    from placegraph.tools.evaluate.map_evaluation import has_truth

    options = {"--questions": questions, "--write-truth": write_truth is not None, "--per-class": per_class}
    for option, used in options.items():
        if used and (len(maps) > 1 or progress):
            raise ConfigError(f"{option} goes with one map and without --progress")
    for option, used in {**options, "--progress": progress, "--per-class": False}.items():
        if used and not source:
            raise ConfigError(f"{option} needs a house with its truth as --source")
    if source and (questions or per_class) and not has_truth(source[0]):
        raise ConfigError(f"{source[0]}: no truth/ here; --questions and --per-class need a house with its truth")


def _print_table(groups: dict[str, dict[Path, dict[str, Any]]], as_json: bool) -> None:
    """Scores by map in groups, one for each part of the walk, with the means of each group."""
    from placegraph.tools.evaluate.report import maps_text, means, plain

    averages = {group: means(list(rows.values())) for group, rows in groups.items()}
    if as_json:
        values = {
            group: {"maps": {str(folder): row for folder, row in rows.items()}, "mean": averages[group]}
            for group, rows in groups.items()
        }
        print(json.dumps(plain(values.get("", values)), sort_keys=True))
        return
    several = any(len(rows) > 1 for rows in groups.values())
    table = {f"{folder} {group}".strip(): row for group, rows in groups.items() for folder, row in rows.items()}
    print(maps_text(table, {f"mean {group}".strip(): mean for group, mean in averages.items()} if several else {}))
