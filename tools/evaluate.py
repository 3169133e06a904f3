"""Measure a map against given poses: absolute trajectory error after a rigid alignment (Sturm 2012)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from placegraph.runtime.errors import SourceError

F64 = NDArray[np.float64]


def absolute_trajectory_error(estimated: F64, given: F64) -> tuple[float, float]:
    """Rmse and maximum of the distances in metres between (N, 3) positions after the best rigid alignment.

    Raises ValueError for fewer than 3 pairs. Source: Sturm et al. 2012, alignment by Horn/Umeyama without scale.
    """
    if len(estimated) < 3:
        raise ValueError(f"at least 3 pairs are needed, got {len(estimated)}")
    a, b = estimated - estimated.mean(axis=0), given - given.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))])
    distances = np.linalg.norm(a @ (vt.T @ flip @ u.T).T - b, axis=1)
    return float(np.sqrt((distances**2).mean())), float(distances.max())


def against_given(estimated: dict[int, F64], given: dict[int, F64] | None) -> dict[str, float] | None:
    """ATE of positions by stamp_ns against given poses (4, 4) by the same stamps; None when there are too few pairs."""
    pairs = [(estimated[s], given[s][:3, 3]) for s in sorted(estimated) if given and s in given]
    pairs = [(e, g) for e, g in pairs if np.isfinite(g).all()]
    if len(pairs) < 3:
        return None
    positions = np.array([e for e, _ in pairs]), np.array([g for _, g in pairs])
    rmse, worst = absolute_trajectory_error(*positions)
    path = float(np.linalg.norm(np.diff(positions[1], axis=0), axis=1).sum())
    return {"ate_rmse_m": round(rmse, 4), "ate_max_m": round(worst, 4), "poses": len(pairs), "path_m": round(path, 2)}


def evaluate(
    map_folder: Annotated[Path, typer.Argument(metavar="MAP", help="A map folder that `placegraph run` wrote.")],
    source: Annotated[Path, typer.Option(help="The data set with the given poses.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare a map's trajectory with the poses that its data set gives: ATE rmse in metres."""
    from placegraph.nodes.camera import detect
    from placegraph.tools.map_folder import TRAJECTORY, read_trajectory

    given = detect(str(source))(source, {}).given_poses()
    found = against_given(read_trajectory(map_folder / TRAJECTORY), given)
    if found is None:
        raise SourceError(f"{source}: fewer than 3 given poses at the times of {map_folder / TRAJECTORY}")
    if as_json:
        print(json.dumps(found, sort_keys=True))
    else:
        print("ATE rmse {ate_rmse_m} m, max {ate_max_m} m, over {poses} poses and {path_m} m of path".format(**found))
