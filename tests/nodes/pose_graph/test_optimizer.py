import numpy as np
import pytest

from placegraph.nodes.pose_graph.optimizer import Edge, UpMeasurement, optimize
from placegraph.runtime.vision.geometry import inverse
from placegraph.runtime.vision.registration import exponential


def ring(count: int, drift: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Edge]]:
    """True poses on a circle, poses by drifting steps, and those steps as edges."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    true = np.array([exponential(np.array([np.cos(a), np.sin(a), 0.1 * a, 0, 0, a])) for a in angle])
    poses, edges = [true[0]], []
    for i in range(count - 1):
        step = inverse(true[i]) @ true[i + 1] @ exponential(drift)
        edges.append(Edge(i, i + 1, step, 0.01, 0.01, False))
        poses.append(poses[-1] @ step)
    return true, np.array(poses), edges


def worst_m(poses: np.ndarray, true: np.ndarray) -> float:
    return float(np.linalg.norm(poses[:, :3, 3] - true[:, :3, 3], axis=1).max())


DRIFT = np.array([0.01, 0.004, 0.002, 0.0, 0.002, 0.01])


def test_nothing_to_do() -> None:
    assert len(optimize(np.zeros((0, 4, 4)), [], [])) == 0
    assert np.array_equal(optimize(np.eye(4)[None], [], []), np.eye(4)[None])


def test_without_loops_the_poses_stay() -> None:
    _, poses, edges = ring(12, DRIFT)
    assert np.allclose(optimize(poses, edges, []), poses, atol=1e-9)


def test_a_loop_spreads_the_drift() -> None:
    true, poses, edges = ring(30, DRIFT)
    loop = Edge(0, 29, inverse(true[0]) @ true[29], 0.01, 0.01, True)
    found = optimize(poses, [*edges, loop], [], iterations=30)
    assert worst_m(found, true) < 0.4 * worst_m(poses, true)
    assert worst_m(found[29:], true[29:]) < 0.02  # where the loop is closed
    assert np.array_equal(found[0], true[0])


def test_one_wrong_loop_among_right_ones_is_outvoted() -> None:
    true, poses, edges = ring(30, DRIFT)
    right = [Edge(i, i + 15, inverse(true[i]) @ true[i + 15], 0.01, 0.01, True) for i in range(15)]
    wrong = Edge(3, 20, exponential(np.array([2.0, 1, 0, 0, 0, 1])), 0.01, 0.01, True)
    found = optimize(poses, [*edges, *right, wrong], [], iterations=30)
    assert worst_m(found, true) < 0.15


@pytest.mark.parametrize("count", [2, 25])
def test_levels_take_the_tilt_away(count: int) -> None:
    true, poses, edges = ring(count, np.array([0, 0, 0, 0.01, -0.01, 0.0]))
    levels = [UpMeasurement(i, true[i][2, :3], 0.01) for i in range(count)]
    found = optimize(poses, edges, levels, iterations=20)
    assert np.abs(found[:, 2, :3] - true[:, 2, :3]).max() < max(
        0.3 * np.abs(poses[:, 2, :3] - true[:, 2, :3]).max(), 0.006
    )
