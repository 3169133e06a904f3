import numpy as np
import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Pose
from placegraph.tools.map_files.trajectory_file import read_trajectory, write_trajectory


def pose(frame_id, trusted=True, stamp_ns=None):
    matrix = np.eye(4)
    matrix[:3, 3] = (frame_id, -0.5, 1e-7)
    return Pose(
        frame_id=frame_id, stamp_ns=frame_id * 10**8 if stamp_ns is None else stamp_ns, world_from_camera=matrix,
        trusted=trusted, quality=1.0, residual_m=0.0, innovation_m=0.0, reason="" if trusted else "lost",
    )  # fmt: skip


def test_a_trajectory_holds_trusted_poses_by_time(tmp_path) -> None:
    path = tmp_path / "trajectory.txt"
    write_trajectory(path, [pose(2), pose(0), pose(1, trusted=False), pose(3, stamp_ns=1341841278_842_900_123)])
    assert (
        path.read_text().splitlines()[1]
        == "0.000000000 0.000000 -0.500000 0.000000 0.000000 0.000000 0.000000 1.000000"
    )
    found = read_trajectory(path)
    assert list(found) == [0, 2 * 10**8, 1341841278_842_900_123]  # a time since 1970 to the nanosecond
    assert found[2 * 10**8][:3, 3].tolist() == [2.0, -0.5, 0.0]


def test_a_trajectory_of_nothing(tmp_path) -> None:
    write_trajectory(tmp_path / "t.txt", [])
    assert (tmp_path / "t.txt").read_text() == "# seconds tx ty tz qx qy qz qw\n"
    assert read_trajectory(tmp_path / "t.txt") == {}


def test_short_and_long_fractions_of_a_second(tmp_path) -> None:
    (tmp_path / "t.txt").write_text("\n1 0 0 0 0 0 0 1\n1.5 0 0 0 0 0 0 1\n1.0000000019 0 0 0 0 0 0 1\n")
    assert list(read_trajectory(tmp_path / "t.txt")) == [10**9, 15 * 10**8, 10**9 + 1]


@pytest.mark.parametrize("line", ["1.0", "1.0 1 2 3", "x 0 0 0 0 0 0 1", "1.0 nan 0 0 0 0 0 1", "1.0 a 0 0 0 0 0 1"])
def test_a_broken_line_is_named(tmp_path, line) -> None:
    (tmp_path / "t.txt").write_text(f"# fine\n0.0 0 0 0 0 0 0 1\n{line}\n")
    with pytest.raises(SchemaError, match=r"t\.txt:3: "):
        read_trajectory(tmp_path / "t.txt")


def test_a_trajectory_that_cannot_be_read(tmp_path) -> None:
    with pytest.raises(SchemaError, match=r"t\.txt: cannot read: No such file or directory"):
        read_trajectory(tmp_path / "t.txt")
    (tmp_path / "t.txt").write_bytes(b"\xff\xfe")
    with pytest.raises(SchemaError, match=r"t\.txt: cannot read: 'utf-8'"):
        read_trajectory(tmp_path / "t.txt")


def test_poses_of_a_file_are_checked(tmp_path) -> None:
    file = tmp_path / "trajectory.txt"
    file.write_text("# none\n")
    assert read_trajectory(file) == {}
    file.write_text("# one\n1.5 1 2 3 0 0 1 0\n")
    assert read_trajectory(file)[1_500_000_000][:3] == pytest.approx(
        np.array([[-1, 0, 0, 1], [0, -1, 0, 2], [0, 0, 1, 3.0]])
    )
    file.write_text("1.5 1 2 3 0 0 1 0\n1.5 1 2 3 0 0 1 0\n")
    with pytest.raises(SchemaError, match="a time appears twice"):
        read_trajectory(file)
    file.write_text("1.5 1 2 3 0 0 0 0\n")
    with pytest.raises(SchemaError, match="the quaternion is 0 0 0 0"):
        read_trajectory(file)
