import numpy as np

from placegraph.nodes.pose.kiss_icp import KissIcpConfig, KissIcpOdometry
from placegraph.nodes.pose.odometry import DepthPointsConfig


def corner(count: int, seed: int) -> np.ndarray:
    """Points on three walls that meet in a corner: they hold a pose in every direction."""
    random = np.random.default_rng(seed)
    flat = random.uniform(0, 2, (3, count, 2))
    walls = [np.insert(flat[axis], axis, 2.0, axis=1) for axis in range(3)]
    return (np.concatenate(walls) - 0.5).astype(np.float32)


def test_after_a_lost_track_a_place_that_fits_halfway_is_not_trusted() -> None:
    config = KissIcpConfig(min_quality=0.25, min_quality_after_loss=0.7)
    half = np.concatenate((corner(300, 9), np.random.default_rng(1).uniform(2.2, 3.2, (900, 3)))).astype(np.float32)

    followed = KissIcpOdometry(config, DepthPointsConfig(), 1)
    lost = KissIcpOdometry(config, DepthPointsConfig(), 1)
    for odometry in (followed, lost):
        for i in range(12):
            assert odometry.register(corner(400, i), i).trusted
    assert not lost.register(np.zeros((0, 3), np.float32), 12).trusted
    on_track, after_loss = followed.register(half, 13), lost.register(half, 13)
    assert 0.25 < on_track.quality < 0.7 and on_track.trusted
    assert not after_loss.trusted and "on the map" in after_loss.reason
    assert lost.register(corner(400, 50), 14).trusted
