"""Remember the results of pure functions from one build to the next, so that only what changed is computed again."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import blake2b
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")


class Memo(Generic[T]):
    """Results by the digest of their inputs. What a build did not ask for is forgotten after it."""

    def __init__(self) -> None:
        self._previous: dict[bytes, T] = {}
        self._current: dict[bytes, T] = {}

    def get(self, digest: bytes, compute: Callable[[], T]) -> T:
        """The result for an equal digest in this build or the last one, else what `compute` returns."""
        if digest not in self._current:
            self._current[digest] = self._previous[digest] if digest in self._previous else compute()
        return self._current[digest]

    def end_build(self) -> None:
        """Keep what this build asked for, and nothing else."""
        self._previous, self._current = self._current, {}


def digest(*values: NDArray[Any] | float | bytes) -> bytes:
    """16 bytes that differ where arrays differ in dtype, shape or content, or numbers in value."""
    hasher = blake2b(digest_size=16)
    for value in values:
        if isinstance(value, bytes):
            hasher.update(b"b%d:" % len(value) + value)
        else:
            array = np.ascontiguousarray(value)
            hasher.update(f"{array.dtype.str}{array.shape}:".encode())
            hasher.update(cast(Any, array.reshape(-1).view(np.uint8)))
    return hasher.digest()
