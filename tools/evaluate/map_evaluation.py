"""A map folder against its ground truth, from files to numbers: a data set, or a truth file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.nodes.camera import detect_source
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.evaluate.aligned_map import align_folder
from placegraph.tools.evaluate.house_truth import house_ground_truth, house_scores
from placegraph.tools.evaluate.layer_scores import map_scores
from placegraph.tools.evaluate.trajectory_error import (
    at_times,
    level_alignment,
    paired,
    positions_of,
    trajectory_scores,
)
from placegraph.tools.evaluate.truth_file import read_truth_file, write_truth_file
from placegraph.tools.evaluate.walk_quarters import walk_quarter_scores
from placegraph.tools.map_files.map_folder import TRAJECTORY, read_graph
from placegraph.tools.map_files.trajectory_file import read_trajectory
from placegraph.tools.simulator.ground_truth import TRUTH, read_truth


def source_scores(folder: Path, source: Path, questions: bool = False) -> dict[str, Any]:
    """A map against its data set: the trajectory, and all layers where the data set has a truth/.

    Raises SourceError when the data set gives fewer than three poses at the times of the map's, or is damaged;
    SchemaError for a damaged map.
    """
    given = detect_source(str(source))(source, {}).given_poses()
    scores = trajectory_scores(read_trajectory(folder / TRAJECTORY), given)
    if scores is None:
        raise SourceError(f"{source}: fewer than 3 given poses at the times of {folder / TRAJECTORY}")
    scores["poses_given"] = len(given or {})
    return scores | house_scores(folder, source, given, questions) if has_truth(source) else scores


def file_scores(folder: Path, truth_file: Path) -> dict[str, Any]:
    """A map against a truth file. Raises SourceError and SchemaError as `source_scores` does."""
    ground_truth = read_truth_file(truth_file)
    if ground_truth.trajectory is None:
        return map_scores(align_folder(folder, read_graph(folder), np.eye(4)), ground_truth)
    estimated = read_trajectory(folder / TRAJECTORY)
    given = at_times(estimated, ground_truth.trajectory)
    scores = trajectory_scores(estimated, given)
    if scores is None:
        raise SourceError(f"{truth_file}: trajectory: fewer than 3 poses at the times of {folder / TRAJECTORY}")
    true_from_map = level_alignment(*paired(positions_of(estimated), given))
    return scores | map_scores(align_folder(folder, read_graph(folder), true_from_map), ground_truth)


def quarter_scores(folder: Path, source: Path) -> dict[str, dict[str, Any]]:
    """A map after each quarter of the walk through a house. Raises ConfigError when `source` is not a house."""
    return walk_quarter_scores(folder, source, _house_poses(source, "--progress"))


def write_house_truth(source: Path, file: Path) -> None:
    """Write a house's truth, with what the whole walk saw, as a truth file. Raises ConfigError when it is no house."""
    given = _house_poses(source, "--write-truth")
    truth = read_truth(source)
    positions = np.array([pose[:3, 3] for pose in given.values()])
    write_truth_file(house_ground_truth(truth, truth.seen, positions, given), file)


def has_truth(source: Path) -> bool:
    """Whether a data set is a house with its truth."""
    return (source / TRUTH).is_dir()


def _house_poses(source: Path, option: str) -> Mapping[int, F64]:
    if not has_truth(source):
        raise ConfigError(f"{source}: no {TRUTH}/ here; {option} needs a house with its truth")
    given = detect_source(str(source))(source, {}).given_poses()
    if not given:
        raise SourceError(f"{source}: no poses are given")
    return given
