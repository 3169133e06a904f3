import numpy as np
import pytest

from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.house_model import (
    Floor,
    FurnitureLocation,
    House,
    Item,
    Material,
    Part,
    PlacedItem,
    Room,
)
from placegraph.tools.training.room_scans import (
    PHANTOM,
    RoomScan,
    add_mapping_errors,
    join,
    read_scans,
    scan_rooms,
    write_scans,
)  # fmt: skip


def box(size, name="box"):
    x, y, z = size
    corners = np.array([[i, j, k] for i in (-x / 2, x / 2) for j in (-y / 2, y / 2) for k in (0, z)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
    return Item(name, (Part(corners, faces, Material((9, 9, 9))),))


def house(*relation):
    polygon = np.array([[0, 0], [5, 0], [5, 4], [0, 4]], float)
    room = Room(0, 0, "office", polygon)
    group = FurnitureLocation(7, "work area", 0, (0, 1), np.array([[1, 1], [2, 1], [2, 2]], float))
    return House(5, (Floor(0, 0.0, 2.5, polygon, (room,), ()),), (), (), relation, (group,))


def things():
    return (
        PlacedItem(0, box((1, 0.6, 0.7)), 2.5, 2, 0, 0, 0, location=7),
        PlacedItem(1, box((0.4, 0.4, 0.4)), 2.5, 2, 0.1, 0, 0, location=7),  # inside the first: nobody sees it
        PlacedItem(2, box((0.4, 0.4, 0.9)), 4.5, 3.5, 0, 0.3, 0),
    )


def scan(*objects):
    return RoomScan(0, 0.0, 2.5, np.array([0, 0, 5, 4.0]), objects, (0,) * len(objects), (np.eye(3, 2) + 1,))


def points(x, count=400, seed=0):
    return (np.random.default_rng(seed).random((count, 3)) * 0.5 + (x, 0, 0)).astype(np.float32)


def test_a_walk_sees_outsides_and_little_of_what_is_hidden():
    (room,) = scan_rooms(house(*things()))
    assert room.location == (0, 0, -1)
    outer, hidden, _ = room.objects
    assert outer[:, 2].max() == pytest.approx(0.7, abs=0.05)
    assert not ((np.abs(outer[:, :2] - (2.5, 2)) < (0.4, 0.2)).all(axis=1) & (outer[:, 2] < 0.5)).any()
    position, _ = (scan_rooms(house(*things()[1:]))[0].objects[k] for k in (0, 1))
    assert len(hidden) < 0.5 * len(position)  # between the points drawn on the outer one there are gaps


def test_scans_are_those_of_the_seed_and_the_variant():
    a, b = (scan_rooms(house(*things()))[0] for _ in range(2))
    other = scan_rooms(house(*things()), 1)[0]
    assert all(np.array_equal(x, y) for x, y in zip(a.objects, b.objects, strict=True))
    assert not np.array_equal(a.objects[0], other.objects[0])


def test_an_empty_room_has_no_objects():
    (room,) = scan_rooms(house())
    assert room.objects == () and len(room.outlines) == 1


def test_missing_objects_are_missing():
    random = np.random.default_rng(0)
    assert [
        w for w in add_mapping_errors(scan(*(points(i) for i in range(9))), random, 1.0).location if w != PHANTOM
    ] == []
    counts = [
        len([w for w in add_mapping_errors(scan(points(0), points(9)), random, 0.5).location if w == 0])
        for _ in range(60)
    ]
    assert 30 < sum(counts) < 95


def test_a_map_without_objects_can_be_degraded():
    assert add_mapping_errors(scan(), np.random.default_rng(3)).outlines[0].shape == (3, 2)


def test_joined_rooms_keep_their_locations_apart():
    both = join(scan(points(0)), scan(points(5), points(6)))
    assert both.location == (0, 1, 1) and len(both.outlines) == 2 and len(both.objects) == 3


def test_stored_scans_come_back_to_the_step(tmp_path):
    rooms = [*scan_rooms(house(*things())), scan()]
    write_scans(rooms, tmp_path / "5_0.npz")
    back = read_scans(tmp_path / "5_0.npz")
    assert [one.location for one in back] == [one.location for one in rooms]
    np.testing.assert_allclose(back[0].objects[1], rooms[0].objects[1], atol=0.0011)
    np.testing.assert_array_equal(back[1].outlines[0], rooms[1].outlines[0])
    assert back[0].high_m == 2.5


def test_a_damaged_file_is_named(tmp_path):
    (tmp_path / "5_0.npz").write_bytes(b"no archive")
    with pytest.raises(SourceError, match="no stored scans"):
        read_scans(tmp_path / "5_0.npz")
