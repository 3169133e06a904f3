"""The error of a trajectory against given poses, and the rigid motion that aligns a map with its truth."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from placegraph.runtime.arrays import F64

RPE_M = 1.0  # of given path between the two poses of a pair
MAX_TIME_DIFFERENCE_NS = 20_000_000  # between poses that belong together; 0.02 s as in the tools of TUM RGB-D


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


def against_given(estimated: Mapping[int, F64], given: Mapping[int, F64] | None) -> dict[str, float] | None:
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


def trajectory_scores(estimated: Mapping[int, F64], given: Mapping[int, F64] | None) -> dict[str, float] | None:
    """ATE, also as a share of the path, and RPE of poses (4, 4) by stamp_ns; None for fewer than 3 finite pairs.

    `rpe_m` and `rpe_deg` are for each metre of path.
    """
    estimated, given = (
        {stamp: pose for stamp, pose in poses.items() if np.isfinite(pose).all()} for poses in (estimated, given or {})
    )
    scores = against_given(positions_of(estimated), given)
    if scores is None:
        return None
    stamps = sorted(estimated.keys() & given.keys())
    matrices, true = (np.array([poses[s] for s in stamps]) for poses in (estimated, given))
    rpe_m, rpe_deg = relative_pose_error(matrices, true)
    share = scores["ate_rmse_m"] / scores["path_m"] if scores["path_m"] else float("nan")
    return scores | {"ate_share": share, "rpe_m": rpe_m, "rpe_deg": rpe_deg}


def relative_pose_error(estimated: F64, given: F64, length_m: float = RPE_M) -> tuple[float, float]:
    """Rmse of the error of motions over a length of the given path: metres and degrees, each for a metre of path.

    Poses (N, 4, 4) world_from_camera by time. Each pose and the first that is `length_m` of given path later are a
    pair; NaN when the path is shorter. Source: Sturm et al. 2012, section IV.B. Not as in the paper: pairs by length of
    path and not by time, so that standing still adds nothing.
    """
    steps = np.linalg.norm(np.diff(given[:, :3, 3], axis=0), axis=1)
    walked = np.concatenate(([0.0], np.cumsum(steps)))
    ends = np.searchsorted(walked, walked + length_m - 1e-9)
    starts = np.flatnonzero(ends < len(given))
    if not len(starts):
        return float("nan"), float("nan")
    ends = ends[starts]
    motion, true_motion = (np.linalg.inv(poses[starts]) @ poses[ends] for poses in (estimated, given))
    from scipy.spatial.transform import Rotation  # here: `placegraph` starts without scipy

    error, length = np.linalg.inv(true_motion) @ motion, walked[ends] - walked[starts]
    error_m = np.linalg.norm(error[:, :3, 3], axis=1) / length
    error_deg = np.degrees(Rotation.from_matrix(error[:, :3, :3]).magnitude()) / length
    return float(np.sqrt((error_m**2).mean())), float(np.sqrt((error_deg**2).mean()))


def at_times(stamps_ns: Mapping[int, object], given: Mapping[int, F64]) -> dict[int, F64]:
    """Given poses by the nearest of the stamps, none farther than MAX_TIME_DIFFERENCE_NS, each used once."""
    from placegraph.nodes.camera.tum import associate  # here: `placegraph` starts without the data sets

    wanted, available = (np.array(sorted(stamps), np.int64) for stamps in (stamps_ns, given))
    return {int(wanted[i]): given[int(available[j])] for i, j in associate(wanted, available, MAX_TIME_DIFFERENCE_NS)}


def positions_of(poses: Mapping[int, F64]) -> dict[int, F64]:
    """Positions (3,) by stamp_ns of poses (4, 4)."""
    return {stamp: pose[:3, 3] for stamp, pose in poses.items()}


def paired(estimated: Mapping[int, F64], given: Mapping[int, F64] | None) -> tuple[F64, F64]:
    """Positions (N, 3) of the stamps at which both are known and finite, by time: estimated, given."""
    pairs = [(estimated[s], given[s][:3, 3]) for s in sorted(estimated) if given and s in given]
    pairs = [(e, g) for e, g in pairs if np.isfinite(e).all() and np.isfinite(g).all()]
    return np.array([e for e, _ in pairs]).reshape(-1, 3), np.array([g for _, g in pairs]).reshape(-1, 3)


def level_alignment(estimated: F64, given: F64) -> F64:
    """(4, 4) given_from_estimated that fits (N, 3) positions best by a rotation about z and a shift.

    Both worlds have z up, so a map that is tilted is wrong and stays tilted. Not as for the ATE: on one floor the
    positions lie in a plane, along a corridor on a line, so they do not determine a rotation about it.
    """
    a, b = estimated - estimated.mean(axis=0), given - given.mean(axis=0)
    sine = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    yaw = np.arctan2(sine, float((a[:, :2] * b[:, :2]).sum()))
    given_from_estimated = np.eye(4)
    given_from_estimated[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    given_from_estimated[:3, 3] = given.mean(axis=0) - given_from_estimated[:3, :3] @ estimated.mean(axis=0)
    return given_from_estimated
