"""What a message is: a frozen dataclass whose declaration is its contract.

Each array field states dtype, shape, unit and frame. `check`, called by the codec on both sides, verifies dtypes and
shapes; a letter that appears twice in one message stands for the same size.
Ragged data is packed as values and offsets: item i is `values[offsets[i]:offsets[i + 1]]`.
"""

from __future__ import annotations

import dataclasses
import hashlib
import typing
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from placegraph.runtime.errors import SchemaError


@dataclass(frozen=True)
class ArraySpec:
    """Dtype, shape, unit and frame of one array field."""

    dtype: str
    shape: tuple[str | int, ...]
    unit: str
    frame: str

    def declaration(self) -> str:
        """The declaration as text, from which the message's checksum is made."""
        return f"{self.dtype}{list(self.shape)}{self.unit}@{self.frame}"


def array(dtype: str, shape: tuple[str | int, ...], *, unit: str, frame: str = "") -> Any:
    """Declare an array field: `shape` holds fixed sizes and letters ("N", or "N+1" for offsets)."""
    return dataclasses.field(metadata={"array": ArraySpec(dtype, shape, unit, frame)})


@dataclass(frozen=True, kw_only=True, eq=False)
class Message:
    """Base of all messages: the frame it belongs to (-1: none) and the capture time of that frame."""

    frame_id: int
    stamp_ns: int

    @classmethod
    @cache
    def array_specs(cls) -> dict[str, ArraySpec]:
        """Array fields by name, in declaration order."""
        return {f.name: f.metadata["array"] for f in dataclasses.fields(cls) if "array" in f.metadata}

    @classmethod
    @cache
    def scalar_types(cls) -> dict[str, Any]:
        """Non-array fields by name with their types, in declaration order."""
        hints = typing.get_type_hints(cls)
        return {f.name: hints[f.name] for f in dataclasses.fields(cls) if "array" not in f.metadata}

    @classmethod
    @cache
    def checksum(cls) -> str:
        """Eight hex digits of the declaration; a consumer refuses a message with another checksum."""
        parts = [cls.__name__]
        parts += [f"{name}:{spec.declaration()}" for name, spec in cls.array_specs().items()]
        parts += [f"{name}:{hint}" for name, hint in cls.scalar_types().items()]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:8]

    def check(self) -> None:
        """Raise SchemaError unless every field is what the declaration says."""
        sizes: dict[str, tuple[int, str]] = {}
        for name, spec in self.array_specs().items():
            value = getattr(self, name)
            where = f"{type(self).__name__}.{name}"
            if not isinstance(value, np.ndarray):
                raise SchemaError(f"{where}: expected an array, got {type(value).__name__}")
            if value.dtype != np.dtype(spec.dtype):
                raise SchemaError(f"{where}: expected dtype {spec.dtype}, got {value.dtype}")
            if value.ndim != len(spec.shape):
                raise SchemaError(f"{where}: expected shape {spec.shape}, got {value.shape}")
            for size, expected in zip(value.shape, spec.shape, strict=True):
                if isinstance(expected, int):
                    if size != expected:
                        raise SchemaError(f"{where}: expected shape {spec.shape}, got {value.shape}")
                elif expected.endswith("+1"):
                    self._check_size(sizes, expected[:-2], size - 1, where)
                else:
                    self._check_size(sizes, expected, size, where)
        for name, hint in self.scalar_types().items():
            self._check_scalar(name, hint)

    @staticmethod
    def _check_size(sizes: dict[str, tuple[int, str]], letter: str, size: int, where: str) -> None:
        first_size, first_field = sizes.setdefault(letter, (size, where))
        if first_size != size:
            raise SchemaError(f"{where}: size {letter} is {size} but {first_size} in {first_field}")

    def _check_scalar(self, name: str, hint: Any) -> None:
        value, where = getattr(self, name), f"{type(self).__name__}.{name}"
        if hint == tuple[str, ...]:
            if not isinstance(value, tuple) or not all(isinstance(item, str) for item in value):
                raise SchemaError(f"{where}: expected a tuple of strings")
        elif type(value) is not hint:
            raise SchemaError(f"{where}: expected {hint.__name__}, got {type(value).__name__}")
