import numpy as np
import pytest

from placegraph.nodes.pose import PoseConfig, PoseNode
from placegraph.nodes.pose.given_poses import GivenPoses
from placegraph.nodes.pose.kiss_icp import KissIcpOdometry
from placegraph.nodes.pose.rgbd_odometry import RgbdOdometry
from placegraph.runtime.messages import End, Frame, Pose
from placegraph.runtime.node import Context

INTRINSICS = np.array([100.0, 100.0, 80.0, 60.0])
UP = np.array([0.0, -1.0, 0.0])


def room_depth(x: float) -> np.ndarray:
    """Depth (120, 160) in metres of a 2 m wide corridor with a box, from a level camera x metres off its middle."""
    v, u = np.mgrid[0:120, 0:160]
    rays = np.stack(((u - 80) / 100, (v - 60) / 100, np.ones(u.shape)), -1)
    with np.errstate(divide="ignore"):
        planes = [(1.0 - x) / rays[..., 0], (-1.0 - x) / rays[..., 0], 1.2 / rays[..., 1], -1.2 / rays[..., 1]]
    depth = np.minimum.reduce([np.where(p > 0, p, np.inf) for p in planes] + [np.full(u.shape, 4.0)])
    near = (rays[..., 0] * 2.5 + x > 0.2) & (rays[..., 0] * 2.5 + x < 0.9) & (rays[..., 1] * 2.5 > -0.2)
    return np.where(near & (depth > 2.5), 2.5, depth)


def frame(i: int, depth_m: np.ndarray, given: np.ndarray | None = None, up: np.ndarray = UP) -> Frame:
    return Frame(
        frame_id=i,
        stamp_ns=i,
        color=np.zeros((*depth_m.shape, 3), np.uint8),
        depth=np.round(depth_m * 1000).astype(np.uint16),
        depth_unit_m=0.001,
        intrinsics=INTRINSICS,
        given_world_from_camera=np.full((4, 4), np.nan) if given is None else given,
        up_camera=up,
    )


def node(**settings: object) -> PoseNode:
    shape = {"method": "kiss_icp", "stride": 1, "gravity_frames": 1, "kiss_icp": {"voxel_m": 0.05}}
    return PoseNode(PoseConfig(**(shape | settings)), Context())


def only(given: object) -> Pose:
    (pose,) = given  # type: ignore[misc]
    return pose


def test_empty_depth_first_is_not_trusted_and_nothing_crashes() -> None:
    pose = only(node().step(frame(0, np.zeros((120, 160)))))
    assert not pose.trusted and "0 points" in pose.reason and np.isfinite(pose.world_from_camera).all()


def test_follows_a_sideways_motion_in_a_world_with_z_up() -> None:
    odometry = node()
    poses = [only(odometry.step(frame(i, room_depth(0.02 * i)))) for i in range(15)]
    assert all(pose.trusted for pose in poses)
    moved = poses[-1].world_from_camera[:3, 3] - poses[0].world_from_camera[:3, 3]
    assert np.linalg.norm(moved - [0.28, 0, 0]) < 0.03
    assert np.allclose(poses[0].world_from_camera[:3, :3] @ UP, [0, 0, 1])


def test_a_covered_lens_is_noticed_and_the_track_goes_on() -> None:
    odometry = node()
    for i in range(8):
        only(odometry.step(frame(i, room_depth(0.02 * i))))
    lost = only(odometry.step(frame(8, np.zeros((120, 160)))))
    assert not lost.trusted
    again = only(odometry.step(frame(9, room_depth(0.18))))
    assert again.trusted and abs(again.world_from_camera[0, 3] - 0.18) < 0.03


def test_a_jump_to_another_place_is_not_trusted() -> None:
    odometry = node()
    for i in range(8):
        only(odometry.step(frame(i, room_depth(0.0))))
    elsewhere = 0.4 + 0.3 * np.random.default_rng(0).random((120, 160))
    pose = only(odometry.step(frame(8, elsewhere)))
    assert not pose.trusted and pose.reason


def test_poses_wait_until_up_is_known_and_end_releases_them() -> None:
    odometry = node(gravity_frames=3)
    unknown = np.full(3, np.nan)
    assert odometry.step(frame(0, room_depth(0), up=unknown)) == []
    assert odometry.step(frame(1, room_depth(0), up=unknown)) == []
    assert [p.frame_id for p in odometry.step(frame(2, room_depth(0), up=unknown))] == [0, 1, 2]
    assert [p.frame_id for p in odometry.step(frame(3, room_depth(0), up=unknown))] == [3]
    short = node(gravity_frames=3)
    short.step(frame(0, room_depth(0)))
    assert [p.frame_id for p in short.step(End(frame_id=0, stamp_ns=0, frames=1))] == [0]
    assert node().step(End(frame_id=-1, stamp_ns=0, frames=0)) == []


def test_given_poses_pass_through_and_missing_ones_are_not_trusted() -> None:
    given = np.eye(4)
    given[:3, 3] = [1, 2, 3]
    source = node(method="given")
    pose = only(source.step(frame(0, room_depth(0), given)))
    assert pose.trusted and np.allclose(pose.world_from_camera[:3, :3] @ UP, [0, 0, 1])
    missing = only(source.step(frame(1, room_depth(0))))
    assert not missing.trusted and "no pose" in missing.reason


@pytest.mark.parametrize(
    ("method", "built"), [("rgbd", RgbdOdometry), ("kiss_icp", KissIcpOdometry), ("given", GivenPoses)]
)
def test_only_the_chosen_odometry_is_built(method: str, built: type) -> None:
    values = vars(node(method=method)).values()
    assert [type(value) for value in values if hasattr(value, "estimate")] == [built]


def test_same_frames_same_poses_bit_for_bit() -> None:
    def track() -> list[bytes]:
        odometry = node()
        return [only(odometry.step(frame(i, room_depth(0.03 * i)))).world_from_camera.tobytes() for i in range(6)]

    assert track() == track()


@pytest.mark.parametrize("settings", [{"kiss_icp": {"voxel_m": 0.0}}, {"stride": 0}, {"method": "gps"}])
def test_bad_settings(settings: dict) -> None:
    with pytest.raises(ValueError, match="Input should be"):
        PoseConfig(**settings)


def test_dark_frames_at_first_do_not_decide_which_way_is_up() -> None:
    pitched = np.array([0.0, -np.cos(0.4), -np.sin(0.4)])
    odometry = node(gravity_frames=3)
    for i in range(3):
        given = odometry.step(frame(i, np.zeros((120, 160)), up=pitched))
    assert [pose.trusted for pose in given] == [False] * 3  # type: ignore[attr-defined]
    later = [pose for i in range(3, 7) for pose in odometry.step(frame(i, room_depth(0), up=pitched))]
    assert [pose.frame_id for pose in later] == [3, 4, 5, 6]
    assert np.allclose(later[0].world_from_camera[:3, :3] @ pitched, [0, 0, 1])  # type: ignore[attr-defined]
