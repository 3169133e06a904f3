"""The error of a trajectory against given poses, and the motion that lays a map onto its truth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    positions = paired(estimated, given)
    if len(positions[0]) < 3:
        return None
    rmse, worst = absolute_trajectory_error(*positions)
    path = float(np.linalg.norm(np.diff(positions[1], axis=0), axis=1).sum())
    return {
        "ate_rmse_m": round(rmse, 4),
        "ate_max_m": round(worst, 4),
        "poses": len(positions[0]),
        "path_m": round(path, 2),
    }


def paired(estimated: dict[int, F64], given: dict[int, F64] | None) -> tuple[F64, F64]:
    """Positions (N, 3) of the stamps at which both are known and finite, by time: estimated, given."""
    pairs = [(estimated[s], given[s][:3, 3]) for s in sorted(estimated) if given and s in given]
    pairs = [(e, g) for e, g in pairs if np.isfinite(g).all()]
    return np.array([e for e, _ in pairs]).reshape(-1, 3), np.array([g for _, g in pairs]).reshape(-1, 3)


def level_alignment(estimated: F64, given: F64) -> F64:
    """(4, 4) given_from_estimated that fits (N, 3) positions best by a turn about z and a shift.

    Both worlds have z up, so a map that leans is wrong and stays so. Departs from the alignment of the ATE: on one
    floor the positions lie in a plane and along a corridor on a line, which says nothing of a tilt about it.
    """
    a, b = estimated - estimated.mean(axis=0), given - given.mean(axis=0)
    sine = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    yaw = np.arctan2(sine, float((a[:, :2] * b[:, :2]).sum()))
    found = np.eye(4)
    found[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    found[:3, 3] = given.mean(axis=0) - found[:3, :3] @ estimated.mean(axis=0)
    return found
