"""Pack messages into bytes and back: msgpack with arrays as raw buffers, checked against their declaration."""

from __future__ import annotations

from typing import Any, TypeVar

import msgpack
import numpy as np

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Message

M = TypeVar("M", bound=Message)


def encode(message: Message) -> bytes:
    """Check a message and pack it; raises SchemaError naming the field that does not match its declaration."""
    message.check()
    arrays = [
        [list(value.shape), np.ascontiguousarray(value).data.cast("B") if value.size else b""]
        for value in (getattr(message, name) for name in message.array_specs())
    ]
    scalars = [_plain(getattr(message, name)) for name in message.scalar_types()]
    return bytes(msgpack.packb([type(message).__name__, message.checksum(), scalars, arrays]))


def decode(kind: type[M], payload: bytes) -> M:
    """Unpack and check; arrays are read-only views. Raises SchemaError, also for bytes of another version."""
    try:
        name, checksum, scalars, arrays = msgpack.unpackb(payload)
    except (ValueError, TypeError, msgpack.UnpackException) as error:
        raise SchemaError(f"{kind.__name__}: the payload is not a message: {error or type(error).__name__}") from None
    if name != kind.__name__:
        raise SchemaError(f"expected a {kind.__name__}, the payload is a {name}")
    if checksum != kind.checksum():
        raise SchemaError(
            f"{name}: the payload was declared as {checksum}, this process knows {kind.checksum()}: "
            "producer and consumer run different versions of placegraph"
        )
    fields: dict[str, Any] = {}
    try:
        for (field, spec), (shape, data) in zip(kind.array_specs().items(), arrays, strict=True):
            fields[field] = np.frombuffer(data, spec.dtype).reshape(shape)
        for (field, hint), value in zip(kind.scalar_types().items(), scalars, strict=True):
            fields[field] = tuple(value) if hint == tuple[str, ...] else value
    except (ValueError, TypeError) as error:
        raise SchemaError(f"{name}: damaged payload: {error}") from None
    message = kind(**fields)
    message.check()
    return message


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
