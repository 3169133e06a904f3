"""How the values of a graph stand in its canonical JSON: pydantic types for arrays, lengths and tags."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import PlainSerializer, PlainValidator, WithJsonSchema

from placegraph.runtime.arrays import F64

MM = 3  # decimals of lengths in metres


def rounded(values: Any, digits: int) -> Any:
    """A number or nested lists of numbers, rounded; -0.0 becomes 0.0, so that equal graphs print alike."""
    return (np.round(np.asarray(values, float), digits) + 0.0).tolist()


def _to_mm(values: Any) -> Any:
    return rounded(values, MM)


def _array(rows: int | None, columns: int) -> tuple[PlainValidator, PlainSerializer, WithJsonSchema]:
    """A (rows, columns) array of float64 in memory, lists of numbers in JSON; rows None: any number."""

    def read(value: Any) -> F64:
        try:
            return np.array(value, float).reshape(-1 if rows is None else rows, columns)
        except (TypeError, ValueError):
            raise ValueError(f"expected {rows or 'a list of'} rows of {columns} numbers") from None

    row = {"type": "array", "items": {"type": "number"}, "minItems": columns, "maxItems": columns}
    count = {} if rows is None else {"minItems": rows, "maxItems": rows}
    return (
        PlainValidator(read),
        PlainSerializer(_to_mm),
        WithJsonSchema({"type": "array", "items": row} | count),
    )


class Tag(NamedTuple):
    """One name of a node and the weight of the evidence for it (summed votes for objects, probability for places)."""

    name: str
    weight: Annotated[float, PlainSerializer(lambda weight: rounded(weight, 4))]


def _read_lengths(value: Any) -> tuple[tuple[str, float], ...]:
    try:
        return tuple((str(end), float(length)) for end, length in sorted(value.items()))
    except (AttributeError, TypeError, ValueError):
        raise ValueError("expected metres by id") from None


def _write_lengths(lengths: tuple[tuple[str, float], ...]) -> dict[str, float]:
    return dict(zip([end for end, _ in lengths], _to_mm([length for _, length in lengths]), strict=True))


_LENGTHS_SCHEMA = {"type": "object", "additionalProperties": {"type": "number"}}

Box = Annotated[F64, *_array(2, 3)]  # min and max; or the two ends of a connection
Outline = Annotated[F64, *_array(None, 2)]
Metres = Annotated[float, PlainSerializer(_to_mm)]
Radians = Metres  # to 3 decimals as well
Numbers = Annotated[tuple[float, ...], PlainSerializer(_to_mm)]
Position = Annotated[tuple[float, float, float], PlainSerializer(_to_mm)]
LengthsById = Annotated[
    tuple[tuple[str, float], ...],
    PlainValidator(_read_lengths),
    PlainSerializer(_write_lengths),
    WithJsonSchema(_LENGTHS_SCHEMA),
]
