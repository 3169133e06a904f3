"""One map against its truth, from files to numbers: a data set's folder, or a truth file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.nodes.camera import detect
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.evaluate.aligned_map import read_aligned
from placegraph.tools.evaluate.ground_truth import Known
from placegraph.tools.evaluate.house import house_scores, known_of
from placegraph.tools.evaluate.progress import progress_scores
from placegraph.tools.evaluate.scores import map_scores
from placegraph.tools.evaluate.trajectory import at_times, level_alignment, paired, read_poses, trajectory_scores
from placegraph.tools.evaluate.truth_file import read_truth_file, write_truth_file
from placegraph.tools.map_folder import TRAJECTORY
from placegraph.tools.simulator.ground_truth import TRUTH, read_truth


def source_scores(folder: Path, source: Path, questions: bool = False) -> dict[str, Any]:
    """A map against its data set: the trajectory, and where there is a truth/ everything else.

    Raises SourceError when the data set gives fewer than three poses at the times of the map's, or is damaged;
    SchemaError for a damaged map.
    """
    given = detect(str(source))(source, {}).given_poses()
    found = trajectory_scores(read_poses(folder / TRAJECTORY), given)
    if found is None:
        raise SourceError(f"{source}: fewer than 3 given poses at the times of {folder / TRAJECTORY}")
    found["poses_given"] = len(given or {})
    return found | house_scores(folder, source, given, questions) if has_truth(source) else found


def file_scores(folder: Path, against: Path) -> dict[str, Any]:
    """A map against a truth file. Raises SourceError and SchemaError as `source_scores` does."""
    known = read_truth_file(against)
    if known.trajectory is None:
        return map_scores(read_aligned(folder, np.eye(4)), known)
    estimated = read_poses(folder / TRAJECTORY)
    given = at_times(estimated, known.trajectory)
    found = trajectory_scores(estimated, given)
    if found is None:
        raise SourceError(f"{against}: trajectory: fewer than 3 poses at the times of {folder / TRAJECTORY}")
    positions = {stamp: pose[:3, 3] for stamp, pose in estimated.items()}
    laid = read_aligned(folder, level_alignment(*paired(positions, given)))
    return found | map_scores(laid, known)


def quarter_scores(folder: Path, source: Path) -> dict[str, dict[str, Any]]:
    """A map after each quarter of the walk through a house. Raises ConfigError when SOURCE is no house."""
    return progress_scores(folder, source, _house_poses(source, "--progress"))


def write_house_truth(source: Path, file: Path) -> None:
    """Write a house's truth, and what the whole walk saw of it, as a truth file. Raises ConfigError when it is none."""
    given = _house_poses(source, "--write-truth")
    truth = read_truth(source)
    positions = np.array([pose[:3, 3] for pose in given.values()])
    known: Known = known_of(truth, truth.seen, positions, given)
    write_truth_file(known, file)


def has_truth(source: Path) -> bool:
    """Whether a data set is a house with its truth."""
    return (source / TRUTH).is_dir()


def _house_poses(source: Path, option: str) -> Mapping[int, F64]:
    if not has_truth(source):
        raise ConfigError(f"{source}: no {TRUTH}/ here; {option} needs a house with its truth")
    given = detect(str(source))(source, {}).given_poses()
    if not given:
        raise SourceError(f"{source}: no poses are given")
    return given
