"""What a message is: a frozen dataclass whose declaration is its contract.

Each array field states dtype, shape, unit and frame. `check` (called by the codec on
both sides) verifies dtypes and shapes; a letter that appears twice in one message must stand for the same size.
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
    """What one array field must be."""

    dtype: str
    shape: tuple[str | int, ...]
    unit: str
    frame: str

    def declaration(self) -> str:
        """Stable text that enters the message's checksum."""
        return f"{self.dtype}{list(self.shape)}{self.unit}@{self.frame}"


def array(dtype: str, shape: tuple[str | int, ...], *, unit: str, frame: str = "") -> Any:
    """Declare an array field: `shape` holds fixed sizes and letters, `unit` and `frame` enter its checksum."""
    return dataclasses.field(metadata={"array": ArraySpec(dtype, shape, unit, frame)})


@dataclass(frozen=True, kw_only=True, eq=False)
class Message:
    """Base of all messages: the frame it belongs to (-1: none) and that frame's capture time."""

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
        """Eight hex digits of the declaration: equal on both sides of the bus or the message is refused."""
        parts = [cls.__name__]
        parts += [f"{name}:{spec.declaration()}" for name, spec in cls.array_specs().items()]
        parts += [f"{name}:{kind}" for name, kind in cls.scalar_types().items()]
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
            for size, want in zip(value.shape, spec.shape, strict=True):
                if isinstance(want, int):
                    if size != want:
                        raise SchemaError(f"{where}: expected shape {spec.shape}, got {value.shape}")
                elif want.endswith("+1"):
                    self._same_size(sizes, want[:-2], size - 1, where)
                else:
                    self._same_size(sizes, want, size, where)
        for name, kind in self.scalar_types().items():
            self._check_scalar(name, kind, sizes)

    @staticmethod
    def _same_size(sizes: dict[str, tuple[int, str]], letter: str, size: int, where: str) -> None:
        known, first = sizes.setdefault(letter, (size, where))
        if known != size:
            raise SchemaError(f"{where}: size {letter} is {size} but {known} in {first}")

    def _check_scalar(self, name: str, kind: Any, sizes: dict[str, tuple[int, str]]) -> None:
        value, where = getattr(self, name), f"{type(self).__name__}.{name}"
        if kind == tuple[str, ...]:
            if not isinstance(value, tuple) or not all(isinstance(item, str) for item in value):
                raise SchemaError(f"{where}: expected a tuple of strings")
        elif type(value) is not kind:
            raise SchemaError(f"{where}: expected {kind.__name__}, got {type(value).__name__}")
