"""PLY of any writer is read, ours is read by others, and what is not what its header says is named. (contract)"""

from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.tools.map_files.ply import points_of, read_vertices, write_points

XYZ = np.array([[0.5, -1.25, 3.0], [4.0, 5.5, -6.0]])
# x y z in another order and type, with other properties between them, an element before and one after
PROPERTIES = "property uchar red\nproperty double z\nproperty float x\nproperty short id\nproperty float32 y\n"
ROW = [("red", "u1"), ("z", "f8"), ("x", "f4"), ("id", "i2"), ("y", "f4")]


def header(
    form: str, *, before: str = "element camera 1\nproperty float f\n", count: int = 2, newline: str = "\n"
) -> str:
    text = f"ply\nformat {form} 1.0\ncomment a b\nobj_info c\n{before}element vertex {count}\n{PROPERTIES}"
    text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    return text.replace("\n", newline)


def rows(order: str) -> np.ndarray:
    found = np.zeros(2, [(name, order + kind) for name, kind in ROW])
    found["red"], found["id"] = (200, 7), (-3, 300)
    for i, axis in enumerate("xyz"):
        found[axis] = XYZ[:, i]
    return found


def read_xyz(path: Path) -> np.ndarray:
    return points_of(read_vertices(path), path)


@pytest.mark.parametrize(("form", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_binary_of_any_order(tmp_path: Path, form: str, order: str, newline: str) -> None:
    path = tmp_path / "a.ply"
    body = (
        np.array([1.5], f"{order}f4").tobytes() + rows(order).tobytes() + b"\x03" + np.arange(3, dtype="i4").tobytes()
    )
    path.write_bytes(header(form, newline=newline).encode() + body)
    assert read_xyz(path).tolist() == XYZ.tolist()
    assert read_vertices(path)["id"].tolist() == [-3, 300] and read_vertices(path)["red"].tolist() == [200, 7]


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_ascii_of_any_order(tmp_path: Path, newline: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(
        f"{header('ascii')}1.5\n200 3 .5 -3 -1.25\n\n7 -6.0 4e0 300 5.5\n3 0 1 0\n".replace("\n", newline).encode()
    )
    assert read_xyz(path).tolist() == XYZ.tolist()
    assert read_vertices(path).dtype.names == tuple(name for name, _ in ROW)
    assert read_vertices(path)["id"].tolist() == [-3, 300]


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_no_vertices_are_no_points(tmp_path: Path, form: str) -> None:
    (tmp_path / "a.ply").write_text(header(form, before="", count=0))
    assert read_xyz(tmp_path / "a.ply").shape == (0, 3)


def test_what_we_write_is_what_we_and_others_read(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    colors = np.array([[1, 2, 3], [250, 251, 252]], np.uint8)
    write_points(path, XYZ, dict(zip(("red", "green", "blue"), colors.T, strict=True)), ["two\nlines"])
    assert b"\ncomment two lines\n" in path.read_bytes()
    assert read_xyz(path).tolist() == XYZ.tolist()
    trimesh = pytest.importorskip("trimesh", reason="extra `export`")
    there = trimesh.load(path)
    np.testing.assert_array_equal(there.vertices, XYZ)
    np.testing.assert_array_equal(there.colors[:, :3], colors)


def test_what_other_libraries_write_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    cv2.savePointCloud(str(path), XYZ.astype(np.float32).reshape(-1, 1, 3))  # ASCII
    np.testing.assert_allclose(read_xyz(path), XYZ)
    trimesh = pytest.importorskip("trimesh", reason="extra `export`")
    for encoding in ("ascii", "binary"):
        box = trimesh.creation.box((1, 2, 3))
        path.write_bytes(box.export(file_type="ply", encoding=encoding))
        np.testing.assert_allclose(np.sort(read_xyz(path), axis=0), np.sort(box.vertices, axis=0))


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_a_point_that_is_not_finite_is_named(tmp_path: Path, form: str) -> None:
    path, values = tmp_path / "a.ply", rows("<")
    values["y"][1] = np.nan
    body = values.tobytes() if form != "ascii" else b"200 3 .5 -3 -1.25\n7 -6.0 4 300 nan\n"
    path.write_bytes(header(form, before="").encode() + body)
    with pytest.raises(SchemaError, match=r"a\.ply: vertex 1 is not finite \(1 of 2 are not\)"):
        read_xyz(path)


LINES = "200 3 .5 -3 -1.25\n7 -6.0 4 300 5.5\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "not a PLY file"),
        ("solid cube", "not a PLY file"),
        ("ply\nformat ascii 1.0\nelement vertex 1\n", "not a PLY file"),
        ("ply\nelement vertex 0\nproperty float x\nend_header\n", "names no format"),
        ("ply\nformat ascii 1.0\nelement face 1\nend_header\n", "no vertices, only: face"),
        ("ply\nformat ascii 1.0\nend_header\n", "no vertices, only: nothing"),
        ("ply\nformat middle_endian 1.0\nend_header\n", ":2: not a line of a PLY header: 'format middle_endian"),
        ("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", ":3: not a line"),
        ("ply\nformat ascii 1.0\nproperty float x\nend_header\n", ":3: not a line"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\nend_header\n", ":4: not a line"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nend_header\n", "its vertices have no property"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int i\nend_header\n", "have the list i"),
        (header("ascii", before="").replace("short id", "float x") + LINES, "its vertices have property x twice"),
        (header("ascii", before="").replace("float x", "float u") + LINES, "no x, y and z, only: red, z, u, id, y"),
        (header("ascii", before="") + LINES.splitlines()[0], "cut short: 2 vertices are announced, 1 are there"),
        (header("ascii", before="") + LINES.replace(".5 ", ""), "not numbers in equal rows"),
        (header("ascii", before="") + "1 2 3 4\n5 6 7 8\n", "5 numbers a vertex are announced, 4 are there"),
        (header("ascii", before="") + LINES.replace("200", "two"), "not numbers in equal rows"),
        (header("ascii", before="") + LINES.replace("200", "256"), "red of vertex 0 is 256, out of its type"),
        (header("ascii", before="") + LINES.replace("300", "nan"), "id of vertex 1 is nan, out of its type"),
        (header("binary_big_endian", before="") + LINES, "cut short: 2 vertices are announced, 1 are there"),
        (
            header("binary_little_endian", before="element face 1\nproperty list uchar int i\n") + LINES * 9,
            "face, of varying length, stands before the vertices",
        ),
    ],
)  # fmt: skip
def test_damage_is_named(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "a.ply"
    path.write_text(text)
    with pytest.raises(SchemaError, match=rf"a\.ply.*{reason}"):
        read_xyz(path)


def test_an_absent_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SchemaError, match=r"none\.ply: cannot read: No such file"):
        read_vertices(tmp_path / "none.ply")
