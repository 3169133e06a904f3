"""Measure a map against what is known of its source: poses, and of a procedural house everything."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.evaluate.trajectory import absolute_trajectory_error, against_given

__all__ = ["absolute_trajectory_error", "against_given", "evaluate"]


def evaluate(
    map_folder: Annotated[Path, typer.Argument(metavar="MAP", help="A map folder that `placegraph run` wrote.")],
    source: Annotated[Path, typer.Option(help="The data set with the given poses; with a truth/, all else is scored.")],
    questions: Annotated[bool, typer.Option("--questions", help="Ask the map the house's questions, too.")] = False,
    per_class: Annotated[bool, typer.Option("--per-class", help="Print the objects by class.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare a map with its data set: ATE rmse in metres, and with a house's truth its floors, rooms and objects.

    For the truth the map is turned about z and shifted as fits the trajectories best; it is not levelled anew.
    """
    from placegraph.nodes.camera import detect
    from placegraph.tools.house.truth import TRUTH
    from placegraph.tools.map_folder import TRAJECTORY, read_trajectory

    given = detect(str(source))(source, {}).given_poses()
    found = against_given(read_trajectory(map_folder / TRAJECTORY), given)
    if found is None:
        raise SourceError(f"{source}: fewer than 3 given poses at the times of {map_folder / TRAJECTORY}")
    if not (source / TRUTH).is_dir():
        if questions or per_class:
            raise ConfigError(f"{source}: no {TRUTH}/ here; --questions and --per-class need a house with its truth")
        print(json.dumps(found, sort_keys=True) if as_json else _ate(found))
        return
    from placegraph.tools.evaluate.house import house_scores
    from placegraph.tools.evaluate.report import house_text, plain

    scores = house_scores(map_folder, source, given, questions)
    if as_json:
        print(json.dumps(found | plain(scores), sort_keys=True))
    else:
        print(f"{_ate(found)}\n{house_text(scores, per_class)}")


def _ate(found: dict[str, float]) -> str:
    return "ATE rmse {ate_rmse_m} m, max {ate_max_m} m, over {poses} poses and {path_m} m of path".format(**found)
