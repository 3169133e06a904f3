import numpy as np

from placegraph.runtime.vision.clustering import dbscan, main_clusters


def line(start, count):
    return np.stack((start + 0.02 * np.arange(count), np.zeros(count), np.zeros(count)), axis=1)


def test_no_points():
    assert dbscan(np.zeros((0, 3)), 0.1, 3).tolist() == []
    assert main_clusters(np.zeros((0, 3)), 0.1, 3, 1.0).tolist() == []


def test_one_point_is_noise_unless_one_is_enough():
    assert dbscan(np.zeros((1, 3)), 0.1, 2).tolist() == [-1]
    assert dbscan(np.zeros((1, 3)), 0.1, 1).tolist() == [0]


def test_two_lines_and_a_stray_point():
    points = np.concatenate((line(0, 10), line(1, 20), [[5.0, 5, 5]]))
    assert dbscan(points, 0.05, 3).tolist() == [0] * 10 + [1] * 20 + [-1]
    assert main_clusters(points, 0.05, 3, 1.0).tolist() == list(range(10, 30))


def test_clusters_are_numbered_by_their_first_point():
    points = np.concatenate((line(1, 5), line(0, 5)))
    assert dbscan(points, 0.05, 2).tolist() == [0] * 5 + [1] * 5


def test_a_border_point_does_not_bridge_two_clusters():
    left, right = 0.02 * np.arange(-4, 1), 0.2 + 0.02 * np.arange(5)
    points = np.r_[left, right, 0.101][:, None]  # within reach of one point of each: no core point
    assert dbscan(points, 0.105, 5).tolist() == [0] * 5 + [1] * 5 + [1]


def test_order_of_points_does_not_change_the_partition():
    rng = np.random.default_rng(3)
    points = rng.uniform(0, 1, (300, 2))
    order = rng.permutation(300)
    a, b = dbscan(points, 0.05, 4)[order], dbscan(points[order], 0.05, 4)
    assert ((a[:, None] == a) == (b[:, None] == b)).all()
    assert ((a < 0) == (b < 0)).all()
