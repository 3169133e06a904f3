"""Read and write recordings: Rerun .rrd files with every message bit for bit, beside the pictures for the viewer.

Each kind has an entity `/messages/<Kind>` with one row a message: arrays flattened in their own dtype (a shape beside
those of several axes), images as PNG, the rest as Arrow values, and the checksum of the declaration they were written
by. The timeline `sequence` is the order of writing; `frame` and `capture_time` come from the message.
"""

from __future__ import annotations

import heapq
import socket
import threading
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk, LazyChunkStream, RrdReader
from rerun.error_utils import RerunWarning

from placegraph.runtime.arrays import U8
from placegraph.runtime.errors import ConfigError, SchemaError, SourceError
from placegraph.runtime.messages import ArraySpec, Message, all_kinds

APPLICATION = "placegraph"
MESSAGES = "/messages"
SEQUENCE, FRAME, CAPTURE_TIME = "sequence", "frame", "capture_time"
CHECKSUM = "declaration_checksum"
PROPERTIES = "placegraph"

# Not Rerun's default of 0.2 s: five small chunks a second for each entity, 2.2 kB of headers each. Under load its timer
# left chunks pending for seconds, so the writer also flushes by volume, which bounds the loss of a killed process.
FLUSH_S = 1.0
CHUNK_BYTES = 1 << 20
FLUSH_BYTES = 2 << 20
FLUSH_TIMEOUT_S = 5.0  # without a timeout a flush was seen to hang when the disk filled up
# Ten 640x480 7-Scenes pairs, one thread: colour 15 ms, 369 kB (default strategy 17 ms, 417 kB; LZ4 1.3 ms, 772 kB),
# depth 6.4 ms, 96 kB (LZ4 0.8 ms, 167 kB). Keyframes are few and disks small, so size wins.
PNG = (cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE)

M = TypeVar("M", bound=Message)


class RecordingWriter:
    """Writes messages into one Rerun stream: a file, a server for viewers on this machine, or both.

    `path` None: no file; `viewer_port` 0: no server, else viewers may connect on 127.0.0.1. `properties` describe the
    run. `blueprint` is the viewer's layout. Raises ConfigError when the file or the port is not available.
    """

    def __init__(
        self,
        path: Path | None,
        run_id: str,
        properties: dict[str, str],
        *,
        viewer_port: int = 0,
        blueprint: Any = None,
    ) -> None:
        batcher = rr.ChunkBatcherConfig(flush_tick=FLUSH_S, flush_num_bytes=CHUNK_BYTES)
        self.stream = rr.RecordingStream(APPLICATION, recording_id=run_id, batcher_config=batcher)
        sinks: list[Any] = []
        if path is not None:
            _require_writable(path)
            sinks.append(rr.FileSink(str(path)))
        if viewer_port:
            _require_free(viewer_port)  # Rerun only prints when it cannot listen
            sinks.append(rr.GrpcServerSink("127.0.0.1", viewer_port, server_memory_limit="512MB"))
        if not sinks:
            raise ConfigError("a recording needs a file, a viewer port, or both")
        try:
            self.stream.set_sinks(*sinks, default_blueprint=blueprint)
        except (RuntimeError, ValueError, OSError) as error:
            raise ConfigError(f"cannot record to {path or 'no file'}, viewer port {viewer_port}: {error}") from None
        if properties:
            self.stream.send_property(PROPERTIES, rr.AnyValues(**{k: pa.array([v]) for k, v in properties.items()}))
        self._sequence = 0
        self._unflushed = 0  # bytes
        self._path, self._failed = path, False
        self._newest = (0, 0)  # frame id and capture time

    def set_time(self, message: Message) -> None:
        """Log what follows at the message's frame and capture time, or at the newest ones if it has no frame."""
        if message.frame_id >= 0:
            self._newest = max(self._newest, (message.frame_id, message.stamp_ns))
        frame_id, stamp_ns = (message.frame_id, message.stamp_ns) if message.frame_id >= 0 else self._newest
        self.stream.set_time(FRAME, sequence=frame_id)
        self.stream.set_time(CAPTURE_TIME, timestamp=np.datetime64(stamp_ns, "ns"))

    def write(self, message: Message) -> dict[str, bytes]:
        """Store every field bit for bit; returns the PNG of each image field, for the viewer's pictures.

        Raises SchemaError for a field against its declaration or an empty image, ConfigError when the disk is full.
        """
        message.check()
        kind, pngs = type(message), images_of(message)
        columns: dict[str, pa.Array] = {CHECKSUM: pa.array([kind.checksum()])}
        for name, spec in kind.array_specs().items():
            value = getattr(message, name)
            if name in pngs:
                columns[name] = pa.array(np.frombuffer(pngs[name], np.uint8))
                continue
            columns[name] = pa.array(np.ascontiguousarray(value).reshape(-1))
            if len(spec.shape) > 1:
                columns[f"{name}.shape"] = pa.array(value.shape, pa.int64())
        for name, hint in kind.scalar_types().items():
            value = getattr(message, name)
            columns[name] = pa.array(value if isinstance(value, tuple) else [value], _ARROW[hint])
        self.set_time(message)
        self.stream.set_time(SEQUENCE, sequence=self._sequence)
        self._sequence += 1
        self._unflushed += sum(column.nbytes for column in columns.values())
        if self._unflushed > FLUSH_BYTES:
            self._unflushed = 0
            self._flush()
        entity = rr.DynamicArchetype(kind.__name__, components=columns)
        self.stream.log(f"{MESSAGES}/{kind.__name__}", entity, strict=True)
        self.stream.reset_time()  # pictures carry no sequence number: the viewer would show a row for each
        self.set_time(message)
        return pngs

    def close(self) -> None:
        """Write what is pending and the footer, release file and port; raises ConfigError unless `write` did before."""
        try:
            if not self._failed:
                self._flush()
        finally:
            if self._failed:
                rr.unregister_shutdown()  # Rerun may wait for ever for a dead writer, and the process with it
                threading.Thread(target=self.stream.disconnect, daemon=True).start()
            else:
                self.stream.disconnect()

    def _flush(self) -> None:
        try:
            self.stream.flush(timeout_sec=FLUSH_TIMEOUT_S)
        except RuntimeError as error:
            self._failed = True
            where = self._path or "the viewer's server"
            raise ConfigError(f"{where}: cannot write the recording any further (is the disk full?): {error}") from None


_ARROW = {int: pa.int64(), float: pa.float64(), bool: pa.bool_(), str: pa.string(), tuple[str, ...]: pa.string()}


def images_of(message: Message) -> dict[str, bytes]:
    """The PNG of each image field: uint8 (H, W, 3) sRGB or uint16 (H, W). Raises SchemaError for an empty image."""
    return {
        name: _to_png(getattr(message, name), f"{type(message).__name__}.{name}")
        for name, spec in type(message).array_specs().items()
        if _is_image(spec)
    }


def read(path: Path, kinds: Sequence[type[Message]]) -> Iterator[Message]:
    """The recorded messages of some kinds in the order they were written, decoded one by one; arrays are read-only.

    Memory holds one chunk (about 1 MB) for each kind, however long the recording. Raises SourceError without such a
    file, SchemaError (also while iterating) when it is damaged, foreign, or written by another version.
    """
    reader = _open(path)
    rows = [_rows(path, reader, kind) for kind in sorted(set(kinds), key=lambda kind: kind.__name__)]
    return (message for _, message in heapq.merge(*rows, key=lambda row: row[0]))


def kinds_in(path: Path) -> dict[str, int]:
    """How many messages of each kind a recording holds, by name; raises as `read` does."""
    counts: dict[str, int] = {}
    for chunk in _chunks(path, _open(path).stream().filter(content=f"{MESSAGES}/**", has_timeline=SEQUENCE)):
        name = chunk.entity_path.rpartition("/")[2]
        counts[name] = counts.get(name, 0) + chunk.num_rows
    unknown = sorted(set(counts) - {kind.__name__ for kind in all_kinds()})
    if unknown:
        raise SchemaError(f"{path}: holds the kind {unknown[0]}, which this version of placegraph does not know")
    return dict(sorted(counts.items()))


def properties(path: Path) -> dict[str, str]:
    """The run's properties, as given to the writer; raises as `read` does."""
    texts: dict[str, str] = {}
    for chunk in _chunks(path, _open(path).stream().filter(content=f"/__properties/{PROPERTIES}")):
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name != "rerun.controls.RowId":
                texts[name] = str(batch.column(name)[0].values[0].as_py())
    return dict(sorted(texts.items()))


def _require_writable(path: Path) -> None:
    try:
        path.write_bytes(b"")
    except OSError as error:
        raise ConfigError(f"cannot write the recording {path}: {error.strerror}") from None


def _require_free(port: int) -> None:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            raise ConfigError(f"viewer port {port} on 127.0.0.1: {error.strerror}") from None


def _is_image(spec: ArraySpec) -> bool:
    return (spec.dtype, spec.shape) in (("uint8", ("H", "W", 3)), ("uint16", ("H", "W")))


def _to_png(image: NDArray[Any], where: str) -> bytes:
    if image.size == 0:
        raise SchemaError(f"{where}: an empty image cannot be recorded, its shape is {image.shape}")
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR) if image.ndim == 3 else image
    return bytes(cv2.imencode(".png", bgr, PNG)[1].data)


def _from_png(data: U8, where: str) -> NDArray[Any]:
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    if image is None:
        raise SchemaError(f"{where}: damaged image")
    image = cv2.cvtColor(image, cv2.COLOR_BGR2RGB) if image.ndim == 3 else image
    image.setflags(write=False)
    return np.asarray(image)


def _open(path: Path) -> RrdReader:
    if not path.is_file():
        raise SourceError(f"{path}: no such recording")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RerunWarning)  # a killed writer left no footer; its chunks are there
            reader = RrdReader(str(path))
            stores = reader.recordings()
    except (RuntimeError, ValueError) as error:
        raise _damaged(path, error) from None
    if len(stores) != 1:
        raise SchemaError(f"{path}: expected one recording in the file, found {len(stores)}")
    if stores[0].application_id != APPLICATION:
        raise SchemaError(f"{path}: written by {stores[0].application_id!r}, not a recording of placegraph")
    return reader


def _damaged(path: Path, error: Exception) -> SchemaError:
    return SchemaError(
        f"{path}: not a readable recording: {error}. If the file was cut (a full disk, a copy in progress), "
        f"`rerun rrd filter {path.name} -o recovered.rrd` saves all that is whole"
    )


def _chunks(path: Path, stream: LazyChunkStream) -> Iterator[Chunk]:
    try:
        yield from stream
    except (RuntimeError, ValueError) as error:
        raise _damaged(path, error) from None


def _rows(path: Path, reader: RrdReader, kind: type[M]) -> Iterator[tuple[int, M]]:
    previous = -1
    stream = reader.stream().filter(content=f"{MESSAGES}/{kind.__name__}", has_timeline=SEQUENCE)
    for chunk in _chunks(path, stream):
        batch = chunk.to_record_batch()
        columns = {name: batch.column(name) for name in batch.schema.names}
        for i, sequence in enumerate(columns[SEQUENCE].to_pylist()):
            where = f"{path}: {kind.__name__} number {sequence}"
            if sequence <= previous:
                raise SchemaError(f"{where} comes after number {previous}: the file was rewritten in another order")
            previous = sequence
            yield sequence, _message(kind, columns, i, where)


def _message(kind: type[M], columns: dict[str, pa.Array], row: int, where: str) -> M:
    def values(name: str) -> pa.Array:
        column = columns.get(f"{kind.__name__}:{name}")
        if column is None or not column[row].is_valid:
            raise SchemaError(f"{where}: the field {name} is missing")
        return column[row].values

    checksum = values(CHECKSUM)[0].as_py()
    if checksum != kind.checksum():
        raise SchemaError(
            f"{where}: recorded as declaration {checksum}, this version of placegraph knows {kind.checksum()}; "
            "recordings are remade, not migrated"
        )
    fields: dict[str, Any] = {}
    for name, spec in kind.array_specs().items():
        flat = values(name).to_numpy(zero_copy_only=True)
        if _is_image(spec):
            fields[name] = _from_png(flat, f"{where}: {name}")
        else:
            fields[name] = flat.reshape(values(f"{name}.shape").to_pylist()) if len(spec.shape) > 1 else flat
    for name, hint in kind.scalar_types().items():
        items = values(name).to_pylist()
        fields[name] = tuple(items) if hint == tuple[str, ...] else items[0]
    message = kind(**fields)
    message.check()
    return message
