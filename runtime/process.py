"""One node in one OS process: receive, step, publish, report.

Started by the launcher as `python -m placegraph.runtime.process` with one JSON line (`ProcessSpec`) on standard input.
Standard input then stays open: when it ends, the launcher is gone, and this process ends too.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from pathlib import Path
from types import FrameType
from typing import Any

import cv2
import msgpack
import psutil
from pydantic import BaseModel, ConfigDict

from placegraph.runtime import log, messages
from placegraph.runtime.bus.flow_control import CreditWindow, Envelope, Inbox
from placegraph.runtime.bus.session import Bus, BusConfig
from placegraph.runtime.errors import PlacegraphError
from placegraph.runtime.health import StepStats
from placegraph.runtime.messages import Answer, Health, Message, Question
from placegraph.runtime.messages.codec import decode, encode
from placegraph.runtime.messages.topics import TOPICS
from placegraph.runtime.node import Context, Node, Source, build_node
from placegraph.runtime.query.query_server import QueryServer

logger = logging.getLogger(__name__)

POLL_S = 0.2  # how soon an abort is noticed; chosen by hand
CRASH_MESSAGES = 4  # written to the crash file: the failing one and the ones before it


class ProcessSpec(BaseModel):
    """What a process needs to run its node: the first line of its standard input."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    node: str
    settings: dict[str, Any]
    context: Context
    bus: BusConfig
    consumers: dict[str, list[str]]  # name of an output kind -> nodes whose receipts are waited for
    question_timeout_s: float
    log_level: str = "INFO"


class NodeProcess:
    """The shell around one node."""

    def __init__(self, spec: ProcessSpec, node: Node) -> None:
        self.spec, self.node = spec, node
        limits = {} if spec.context.lossless else {kind: TOPICS[kind].keep_newest for kind in node.inputs}
        self.inbox = Inbox(limits)
        self.stats = StepStats(spec.node)
        self.started, self.aborting = threading.Event(), threading.Event()
        self._ended = threading.Event()
        self.windows: dict[type[Message], CreditWindow] = {}
        self._publishers: dict[type[Message], Any] = {}
        self._sequences: dict[type[Message], int] = {}
        self._expected: dict[type[Message], int] = {}
        self._query_server = QueryServer(self._forward, spec.question_timeout_s)
        self._recent: deque[Envelope] = deque(maxlen=CRASH_MESSAGES)

    # --- wiring

    def connect(self, bus: Bus) -> None:
        """Declare publishers, subscribers and the liveliness token that marks this process as ready."""
        self._send_receipt = bus.publisher("receipt", self.spec.node)
        serves = self.node.serves
        outputs = {*self.node.outputs, Health, *((serves[0],) if serves else ())}
        for kind in sorted(outputs, key=lambda kind: kind.__name__):
            topic = TOPICS[kind]
            self._publishers[kind] = bus.publisher("topic", topic.key)
            lossless = self.spec.context.lossless or not topic.keep_newest
            if topic.credit and lossless and (consumers := self.spec.consumers.get(kind.__name__)):
                self.windows[kind] = CreditWindow(topic.credit, consumers)
        bus.subscribe(self._on_control, "control")
        bus.subscribe(self._on_receipt, "receipt", "*")
        bus.watch_alive(self._on_alive)
        for kind in self.node.inputs:
            if serves and kind is serves[0]:
                bus.serve(self._query_server.receive, "ask")
            else:
                bus.subscribe(self._subscriber(kind), "topic", TOPICS[kind].key)
        bus.declare_alive(self.spec.node)

    def _subscriber(self, kind: type[Message]) -> Any:
        return lambda key, payload, attachment: self.inbox.put(Envelope(kind, int.from_bytes(attachment), payload))

    def _on_control(self, key: str, payload: bytes, attachment: bytes) -> None:
        if payload == b"start":
            self.started.set()
        elif payload == f"stop {self.spec.node}".encode():
            self.stop()

    def _on_receipt(self, key: str, payload: bytes, attachment: bytes) -> None:
        kind, sequence = msgpack.unpackb(payload)
        window = self.windows.get(getattr(messages, kind))
        if window is not None:
            window.confirm(key.rsplit("/", 1)[-1], sequence)

    def _on_alive(self, name: str, present: bool) -> None:
        for window in self.windows.values():
            window.set_present(name, present)

    def _forward(self, number: int, question: Question) -> None:
        self.inbox.put(Envelope(Question, number, encode(question)))

    def stop(self) -> None:
        """Step what is in the inbox, then end; a source ends as if its data had ended."""
        if isinstance(self.node, Source):
            self.node.ending = True
        for window in self.windows.values():
            window.ignore_absent()
        self.started.set()
        self.inbox.close()

    def abort(self) -> None:
        """End after the current step; what is in the inbox is lost."""
        self.aborting.set()
        self.stop()

    # --- stepping

    def run(self) -> None:
        """Step until stopped; an exception of `step` passes through after the crash file is written."""
        if isinstance(self.node, Source):
            self._run_source(self.node)
        while not self.inbox.drained and not self.aborting.is_set():
            envelope = self.inbox.get(POLL_S)
            if envelope is not None:
                self._handle(envelope)

    def _run_source(self, source: Source) -> None:
        self.started.wait()
        began = time.monotonic()
        for message in source.messages():
            self.stats.add_step(time.monotonic() - began)
            if not self._publish(message):
                return
            began = time.monotonic()

    def _handle(self, envelope: Envelope) -> None:
        self._recent.append(envelope)
        is_question = self.node.serves is not None and envelope.kind is self.node.serves[0]
        if is_question and not self._query_server.is_waiting(envelope.sequence):
            return
        if not is_question:
            self._check_order(envelope)
        message = decode(envelope.kind, envelope.payload)
        if is_question:
            self._publish(message)
        began = time.monotonic()
        try:
            outputs = self.node.step(message)
        except Exception:
            self._write_crash(traceback.format_exc())
            raise
        self.stats.add_step(time.monotonic() - began)
        for output in outputs:
            self._publish(output)
            if is_question and isinstance(output, Answer):
                self._query_server.answer(envelope.sequence, output.json)
        if not is_question:
            self._send_receipt(msgpack.packb([envelope.kind.__name__, envelope.sequence]), b"")

    def _check_order(self, envelope: Envelope) -> None:
        """Check that sequence numbers have no gap; a gap in a replay would give another graph."""
        lossless, kind = self.spec.context.lossless, envelope.kind
        if kind is Health:  # every process publishes it, each with numbers of its own
            return
        expected = self._expected.get(kind, 1 if lossless else envelope.sequence)
        self._expected[kind] = envelope.sequence + 1
        lost = envelope.sequence - expected
        if lost and lossless:
            raise PlacegraphError(
                f"{lost} {kind.__name__} lost before number {envelope.sequence}: a replay must not lose any"
            )
        if lost > 0 and not TOPICS[kind].keep_newest:
            logger.warning("%d %s lost before number %d", lost, kind.__name__, envelope.sequence)

    def _publish(self, message: Message) -> bool:
        """Send as soon as the consumers have credit; False when aborted before."""
        kind = type(message)
        window = self.windows.get(kind)
        sequence: int | None
        if window is None:
            sequence = self._sequences[kind] = self._sequences.get(kind, 0) + 1
        else:
            while (sequence := window.reserve(POLL_S)) is None:
                if self.aborting.is_set():
                    return False
        self._publishers[kind](encode(message), sequence.to_bytes(8))
        return True

    def _write_crash(self, trace: str) -> None:
        if not self.spec.context.out_dir:
            return
        path = Path(self.spec.context.out_dir) / "crash" / f"{self.spec.node}.rec"
        envelopes = [[envelope.kind.__name__, envelope.payload] for envelope in self._recent]
        record = [self.spec.model_dump_json(), trace, envelopes]
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(msgpack.packb(record))
        except OSError as error:  # not raised: the exception of the step must pass through
            logger.error("no whole crash file: %s", error)

    def report_health(self) -> None:
        """Publish Health once a second and at the end; runs in its own thread."""
        memory, last = psutil.Process(), time.monotonic()
        while not self._ended.wait(1.0):
            now = time.monotonic()
            self._publish_health(now - last, memory.memory_info().rss / 1e6)
            last = now
        self._publish_health(time.monotonic() - last, memory.memory_info().rss / 1e6)

    def end(self) -> None:
        """Let `report_health` publish its last report and return; questions that wait get an error reply."""
        self._query_server.close(f"the {self.spec.node} node ended")
        self._ended.set()

    def _publish_health(self, elapsed_s: float, memory_mb: float) -> None:
        drops = self.inbox.drops
        new_drops = sum(drops.values()) - self.stats.drops
        if new_drops:
            counts = ", ".join(f"{count} {kind.__name__}" for kind, count in drops.items())
            logger.warning("dropped for newer ones so far: %s", counts)
        self.stats.drops += new_drops
        self._publish(self.stats.report(elapsed_s, len(self.inbox), memory_mb))


def _die_with_launcher() -> None:
    while os.read(0, 4096):  # not sys.stdin: its lock, held here, would abort the interpreter's shutdown
        pass
    os._exit(3)  # the launcher is gone and cannot stop this process in order any more


def main() -> int:
    """Run one node until stopped; exit status 0 in order, 1 after an error (logged)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the launcher stops it in order
    spec = ProcessSpec.model_validate_json(sys.stdin.buffer.readline())
    log.configure(spec.node, spec.log_level)
    threading.Thread(target=_die_with_launcher, daemon=True).start()
    node: Node | None = None
    status = 1
    try:
        cv2.setNumThreads(spec.context.threads)
        node = build_node(spec.node, spec.settings, spec.context)
        node.start()
        process = NodeProcess(spec, node)

        def on_terminate(number: int, frame: FrameType | None) -> None:
            process.abort()

        signal.signal(signal.SIGTERM, on_terminate)
        with Bus(spec.bus) as bus:
            process.connect(bus)
            logger.info("ready")
            reporter = threading.Thread(target=process.report_health, daemon=True)
            reporter.start()
            try:
                process.run()
            finally:
                process.end()
                reporter.join()
        logger.info("stopped after %d steps", process.stats.steps)
        status = 0
    except PlacegraphError as error:
        logger.error("%s: %s", type(error).__name__, error)
    except Exception:
        logger.exception("step failed")
    try:
        if node is not None:
            node.stop()
    except PlacegraphError as error:  # a recording that could not be finished
        logger.error("%s: %s", type(error).__name__, error)
        status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
