"""Pose graph optimisation: poses, measured motions between them and measured tilts; sparse least squares.

Source: Gauss-Newton over SE(3) as in g2o (Kuemmerle 2011), robust weights as Cauchy's; sparse solves by scipy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from placegraph.runtime.arrays import F64, I64, Bool

CONVERGED_STEP = 1e-4  # metres, rad: a smaller step ends the iteration


@dataclass(frozen=True, eq=False)
class Edge:
    """A measured motion (4, 4) first_from_second between poses `first` and `second`, sigmas in metres and rad."""

    first: int
    second: int
    first_from_second: F64
    sigma_m: float
    sigma_rad: float
    robust: bool  # may be wrong: its weight falls as its error grows


@dataclass(frozen=True, eq=False)
class UpMeasurement:
    """Which way is up (3,), unit, in the camera frame of pose number `pose`."""

    pose: int
    up_camera: F64
    sigma_rad: float


def optimize(
    poses: F64, edges: Sequence[Edge], ups: Sequence[UpMeasurement], fixed: int = 1, iterations: int = 10
) -> F64:
    """Poses (K, 4, 4) world_from_camera that fit all measurements best; the first `fixed` (at least one) stay.

    An edge's `first` is less than its `second`. Each step solves the normal equations; parameters are a shift and a
    turn (6,) in each camera's own frame.
    """
    poses, fixed = poses.copy(), max(1, fixed)
    edges = [edge for edge in edges if edge.second >= fixed]
    ups = [up for up in ups if up.pose >= fixed]
    if not edges:
        return poses
    first, second = np.array([(edge.first, edge.second) for edge in edges]).T
    measured = np.array([edge.first_from_second for edge in edges])
    scale = np.array([[edge.sigma_m] * 3 + [edge.sigma_rad] * 3 for edge in edges])
    robust = np.array([edge.robust for edge in edges])
    for _ in range(iterations):
        blocks = [_edge_block(poses, first, second, measured, scale, robust), *_up_blocks(poses, ups)]
        step = _solve(blocks, len(poses), fixed)
        poses[:, :3, 3] += np.einsum("kij,kj->ki", poses[:, :3, :3], step[:, :3])
        poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(step[:, 3:]).as_matrix()
        if np.abs(step).max() < CONVERGED_STEP:
            break
    return poses


Block = tuple[list[tuple[I64, F64]], F64]  # (pose numbers (E,), jacobians (E, R, 6)) of each pose, residuals (E, R)


def _edge_block(poses: F64, first: I64, second: I64, measured: F64, scale: F64, robust: Bool) -> Block:
    a, b = poses[first], poses[second]
    turn_a = np.swapaxes(a[:, :3, :3], 1, 2)
    expected_turn = turn_a @ b[:, :3, :3]
    expected_shift = np.einsum("eij,ej->ei", turn_a, b[:, :3, 3] - a[:, :3, 3])
    measured_back = np.swapaxes(measured[:, :3, :3], 1, 2)
    error_turn = Rotation.from_matrix(measured_back @ expected_turn).as_rotvec()
    residual = np.concatenate((expected_shift - measured[:, :3, 3], error_turn), axis=1) / scale
    by_first, by_second = np.zeros((2, len(first), 6, 6))
    by_first[:, :3, :3] = -np.eye(3)
    by_first[:, :3, 3:] = _skew(expected_shift)
    by_first[:, 3:, 3:] = -np.swapaxes(expected_turn, 1, 2)
    by_second[:, :3, :3] = expected_turn
    by_second[:, 3:, 3:] = np.eye(3)
    weight = np.where(robust, 1 / np.sqrt(1 + (residual**2).sum(axis=1) / 9), 1.0)[:, None]
    by_first, by_second = (by / scale[:, :, None] * weight[:, :, None] for by in (by_first, by_second))
    return [(first, by_first), (second, by_second)], residual * weight


def _up_blocks(poses: F64, ups: Sequence[UpMeasurement]) -> list[Block]:
    if not ups:
        return []
    numbers = np.array([up.pose for up in ups])
    up_camera, sigma = np.array([up.up_camera for up in ups]), np.array([up.sigma_rad for up in ups])
    turn = poses[numbers][:, :3, :3]
    residual = np.einsum("lij,lj->li", turn, up_camera)[:, :2] / sigma[:, None]
    jacobian = np.zeros((len(numbers), 2, 6))
    jacobian[:, :, 3:] = -(turn @ _skew(up_camera))[:, :2] / sigma[:, None, None]
    weight = 1 / np.sqrt(1 + (residual**2).sum(axis=1) / 9)[:, None]
    return [([(numbers, jacobian * weight[..., None])], residual * weight)]


def _solve(blocks: Sequence[Block], count: int, fixed: int) -> F64:
    """The Gauss-Newton step (count, 6) of all poses, zero for the first `fixed`."""
    rows, columns, values, residuals, offset = [], [], [], [], 0
    for jacobians, residual in blocks:
        edges, size = residual.shape
        row = offset + np.arange(edges * size).reshape(edges, size)
        for numbers, jacobian in jacobians:
            column = 6 * numbers[:, None] + np.arange(6)
            rows.append(np.broadcast_to(row[:, :, None], jacobian.shape).ravel())
            columns.append(np.broadcast_to(column[:, None, :], jacobian.shape).ravel())
            values.append(jacobian.ravel())
        residuals.append(residual.ravel())
        offset += edges * size
    shape = (offset, 6 * count)
    j = coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape).tocsc()
    j = j[:, 6 * fixed :]
    normal = (j.T @ j).tocsc()
    normal.setdiag(normal.diagonal() + 1e-9)
    step = spsolve(normal, -(j.T @ np.concatenate(residuals)))
    return np.concatenate((np.zeros(6 * fixed), np.atleast_1d(step))).reshape(-1, 6)


def _skew(v: F64) -> F64:
    """Cross-product matrices (N, 3, 3) of vectors (N, 3)."""
    upper = np.zeros((len(v), 3, 3))
    upper[:, 0, 1], upper[:, 0, 2], upper[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return upper - np.swapaxes(upper, 1, 2)
