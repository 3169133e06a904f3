"""Points in PLY files: reads the vertices of any writer, ASCII or binary; writes binary.

Source: Turk, "The PLY Polygon File Format", 1994, and the newer type names (`float32` for `float`).
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}
TYPE_NAMES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}  # that are written
BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
END = re.compile(rb"^end_header[ \t]*\r?(\n|$)", re.MULTILINE)


@dataclass(eq=False)
class _Element:
    name: str
    count: int
    fields: list[tuple[str, str]] = field(default_factory=list)
    lists: list[str] = field(default_factory=list)  # names of properties of varying length


def read_vertices(path: Path) -> NDArray[Any]:
    """The vertices as a structured array (N,) with a field for each property.

    Other elements, such as faces, are skipped. Raises SchemaError where the file does not match its header.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SchemaError(f"{path}: cannot read: {error.strerror}") from None
    end = END.search(data) if data.startswith(b"ply") else None
    if end is None:
        raise SchemaError(f"{path}: not a PLY file: no `ply` at its start, or no end_header")
    order, elements = _read_header(path, data[: end.start()].decode("ascii", "replace").splitlines())
    before: list[_Element] = []
    for element in elements:
        if element.name == "vertex":
            return _read_body(path, data[end.end() :], order, before, element)
        before.append(element)
    raise SchemaError(
        f"{path}: holds no vertices, only: {', '.join(element.name for element in elements) or 'nothing'}"
    )


def points_of(rows: NDArray[Any], path: Path) -> F64:
    """Positions (N, 3) of read vertices, in the file's unit. Raises SchemaError without x, y, z, or not finite."""
    names = rows.dtype.names or ()
    if not {"x", "y", "z"} <= set(names):
        raise SchemaError(f"{path}: its vertices have no x, y and z, only: {', '.join(names)}")
    xyz = np.stack([rows[axis].astype(np.float64) for axis in "xyz"], axis=1)
    bad = np.flatnonzero(~np.isfinite(xyz).all(axis=1))
    if bad.size:
        raise SchemaError(f"{path}: vertex {bad[0]} is not finite ({bad.size} of {len(xyz)} are not)")
    return xyz


def write_points(
    path: Path, xyz: NDArray[Any], columns: Mapping[str, NDArray[Any]], comments: Sequence[str] = ()
) -> None:
    """Write binary PLY of points (N, 3) and further properties (N,), uint8, int32, float32 or float64, in order."""
    named = {axis: np.asarray(xyz[:, i], np.float32) for i, axis in enumerate("xyz")} | dict(columns)
    rows = np.zeros(len(xyz), [(name, f"<{values.dtype.str[1:]}") for name, values in named.items()])
    for name, values in named.items():
        rows[name] = values
    header = ["ply", "format binary_little_endian 1.0", *(f"comment {' '.join(text.split())}" for text in comments)]
    header.append(f"element vertex {len(xyz)}")
    header += [f"property {TYPE_NAMES[values.dtype.str[1:]]} {name}" for name, values in named.items()]
    path.write_bytes("\n".join([*header, "end_header", ""]).encode() + rows.tobytes())


def _read_header(path: Path, lines: list[str]) -> tuple[str, list[_Element]]:
    """Numpy's byte order, "=" for ASCII; and the elements of the body, in order."""
    order, elements = "", list[_Element]()
    for number, line in enumerate(lines, 1):
        match line.split():
            case ["format", name, _] if name in BYTE_ORDERS:
                order = BYTE_ORDERS[name]
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count)))
            case ["property", "list", count_type, type_name, name] if {
                count_type,
                type_name,
            } <= TYPES.keys() and elements:
                elements[-1].lists.append(name)
            case ["property", type_name, name] if type_name in TYPES and elements:
                elements[-1].fields.append((name, TYPES[type_name]))
            case [] | ["ply"] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise SchemaError(f"{path}:{number}: not a line of a PLY header: {line.strip()!r}")
    if not order:
        raise SchemaError(f"{path}: its header names no format (one of {', '.join(BYTE_ORDERS)})")
    return order, elements


def _read_body(path: Path, body: bytes, order: str, before: list[_Element], vertex: _Element) -> NDArray[Any]:
    names = [name for name, _ in vertex.fields]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated or vertex.lists or not names:
        wrong = (
            f"property {repeated} twice"
            if repeated
            else f"the list {vertex.lists[0]}"
            if vertex.lists
            else "no property"
        )
        raise SchemaError(f"{path}: its vertices have {wrong}")
    if order == "=":
        return _read_ascii(path, body, sum(element.count for element in before), vertex)
    lists = next((element for element in before if element.lists), None)
    if lists:
        raise SchemaError(f"{path}: {lists.name}, of varying length, stands before the vertices; write vertices first")
    start = sum(element.count * np.dtype(list(element.fields)).itemsize for element in before)
    row = np.dtype([(name, order + kind) for name, kind in vertex.fields])
    if len(body) < start + vertex.count * row.itemsize:
        complete = max(0, len(body) - start) // row.itemsize
        raise SchemaError(f"{path}: cut short: {vertex.count} vertices are announced, {complete} are there")
    return np.frombuffer(body, row, vertex.count, start)


def _read_ascii(path: Path, body: bytes, skip: int, vertex: _Element) -> NDArray[Any]:
    lines = [line for line in body.splitlines() if line.strip()][skip : skip + vertex.count]
    if len(lines) < vertex.count:
        raise SchemaError(f"{path}: cut short: {vertex.count} vertices are announced, {len(lines)} are there")
    rows = np.zeros(vertex.count, vertex.fields)
    if not lines:
        return rows
    try:
        values = np.loadtxt(io.BytesIO(b"\n".join(lines)), ndmin=2, comments=None)
    except ValueError as error:
        raise SchemaError(f"{path}: its vertices are not numbers in equal rows: {error}") from None
    if values.shape[1] != len(vertex.fields):
        raise SchemaError(f"{path}: {len(vertex.fields)} numbers a vertex are announced, {values.shape[1]} are there")
    for (name, kind), column in zip(vertex.fields, values.T, strict=True):
        if kind[0] != "f":
            limits = np.iinfo(kind)
            wrong = ~((column >= limits.min) & (column <= limits.max))  # also true for NaN
            if wrong.any():
                raise SchemaError(
                    f"{path}: {name} of vertex {np.argmax(wrong)} is {column[wrong][0]:g}, out of its type"
                )
        rows[name] = column
    return rows
