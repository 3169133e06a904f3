"""Start the processes of a dataflow, restart those that die, stop them in order. Leaves no process behind."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from placegraph.runtime.bus.session import Bus
from placegraph.runtime.config import Dataflow
from placegraph.runtime.errors import PlacegraphError
from placegraph.runtime.messages import Message
from placegraph.runtime.messages.codec import decode
from placegraph.runtime.messages.topics import TOPICS
from placegraph.runtime.process import ProcessSpec

logger = logging.getLogger(__name__)

# all chosen by hand
START_TIMEOUT_S = 120.0  # a small computer reads models from a slow disk
DRAIN_TIMEOUT_S = 60.0  # for a node to step what is in its inbox
TERMINATE_TIMEOUT_S = 5.0  # from SIGTERM to SIGKILL
TOKEN_TIMEOUT_S = 2.0  # for Zenoh to report that an ended process is gone
LOG_TAIL_LINES = 12  # of a dead process's log in its error


class RestartBudget:
    """Delays of a node's restarts: 0.5 s doubling to 8 s, at most five within a minute."""

    FIRST_DELAY_S, MAX_DELAY_S, MAX_RESTARTS, PERIOD_S = 0.5, 8.0, 5, 60.0

    def __init__(self) -> None:
        self._times: deque[float] = deque()

    def next_delay_s(self, now_s: float) -> float | None:
        """Seconds to wait before the next start, or None when the budget is spent."""
        while self._times and now_s - self._times[0] > self.PERIOD_S:
            self._times.popleft()
        if len(self._times) >= self.MAX_RESTARTS:
            return None
        self._times.append(now_s)
        return float(min(self.FIRST_DELAY_S * 2 ** (len(self._times) - 1), self.MAX_DELAY_S))


class Launcher:
    """Runs a dataflow as OS processes around a Zenoh hub in this process. Use as a context manager."""

    def __init__(self, dataflow: Dataflow, out_dir: Path) -> None:
        self._dataflow, self._out_dir = dataflow, out_dir
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._alive: set[str] = set()
        self._changed = threading.Condition()
        self._budgets = {name: RestartBudget() for name in dataflow.nodes}
        self._restart_at: dict[str, float] = {}
        self._stopped: set[str] = set()
        self.restarts = 0
        self._bus = Bus(dataflow.config.bus, hub=True)
        self._bus.watch_alive(self._on_alive)

    def observe(self, kind: type[Message], on_message: Callable[[Message], None]) -> None:
        """Call on_message with every message of a kind, on Zenoh's thread; it must return at once."""

        def deliver(key: str, payload: bytes, attachment: bytes) -> None:
            on_message(decode(kind, payload))

        self._bus.subscribe(deliver, "topic", TOPICS[kind].key)

    def start(self, is_cancelled: Callable[[], bool] = lambda: False) -> None:
        """Start every process and, when all are ready, the source.

        Raises PlacegraphError naming a process that does not get ready, or when `is_cancelled` returns True.
        """
        (self._out_dir / "log").mkdir(parents=True, exist_ok=True)
        for name in self._dataflow.nodes:
            self._spawn(name)
        deadline = time.monotonic() + START_TIMEOUT_S
        with self._changed:
            while missing := [name for name in self._dataflow.nodes if name not in self._alive]:
                self._changed.wait(0.1)
                for name in missing:
                    self._raise_if_dead(name)
                if is_cancelled():
                    raise PlacegraphError(f"stopped while {', '.join(missing)} got ready: nothing was mapped")
                if time.monotonic() > deadline:
                    raise PlacegraphError(f"not ready after {START_TIMEOUT_S:g} s: {', '.join(missing)}")
        self._bus.put(b"start", "control")

    def poll(self) -> None:
        """Restart processes that ended, or raise PlacegraphError naming the node. Call often."""
        for name, process in self._processes.items():
            if name in self._restart_at or process.poll() is None:
                continue
            if name in self._stopped and process.returncode == 0:
                continue
            node = self._dataflow.nodes[name]
            if name in self._stopped or self._dataflow.context.lossless or not node.restartable:
                self._raise_if_dead(name)
            delay_s = self._budgets[name].next_delay_s(time.monotonic())
            if delay_s is None:
                times = f"{RestartBudget.MAX_RESTARTS} times within a minute"
                raise PlacegraphError(f"{name} failed {times}{self._log_tail(name)}")
            logger.warning("%s ended with status %d; starting it again in %.1f s", name, process.returncode, delay_s)
            self._restart_at[name] = time.monotonic() + delay_s
        for name in [name for name, at in self._restart_at.items() if time.monotonic() >= at]:
            del self._restart_at[name]
            self.restarts += 1
            self._spawn(name)
            self._bus.put(b"start", "control")

    def stop_source(self) -> None:
        """Ask the source to end, so that the last map and graph follow."""
        name = next(name for name, node in self._dataflow.nodes.items() if node is self._dataflow.source)
        self._stopped.add(name)
        self._bus.put(f"stop {name}".encode(), "control")

    def stop(self) -> None:
        """Stop in the order of the dataflow, each node once its inbox is empty; kills those that do not end."""
        for name in self._dataflow.nodes:
            self._stopped.add(name)
            process = self._processes.get(name)
            if process is None or process.poll() is not None:
                continue
            if name in self._alive:
                self._bus.put(f"stop {name}".encode(), "control")
            else:
                process.terminate()
            if not self._wait(process, DRAIN_TIMEOUT_S):
                logger.warning("%s did not finish within %g s", name, DRAIN_TIMEOUT_S)
                self._kill(process)
            # Its token goes after its last message, so all its messages are on their way before the next node stops.
            with self._changed:
                self._changed.wait_for(lambda name=name: name not in self._alive, TOKEN_TIMEOUT_S)  # type: ignore[misc]

    def kill(self) -> None:
        """End all processes at once; what is in flight is lost."""
        self._stopped.update(self._processes)
        for process in self._processes.values():
            if process.poll() is None:
                process.terminate()
        deadline = time.monotonic() + TERMINATE_TIMEOUT_S
        for process in self._processes.values():
            if not self._wait(process, max(0.0, deadline - time.monotonic())):
                self._kill(process)

    def pids(self) -> dict[str, int]:
        """Process ids by node name."""
        return {name: process.pid for name, process in self._processes.items()}

    def _spawn(self, name: str) -> None:
        config = self._dataflow.config
        spec = ProcessSpec(
            node=name,
            settings=config.nodes[name],
            context=self._dataflow.context,
            bus=config.bus,
            consumers=self._dataflow.awaited_consumers(name),
            question_timeout_s=config.run.question_timeout_s,
            log_level=config.run.log_level,
        )
        environment = os.environ | {"OMP_NUM_THREADS": str(self._dataflow.context.threads)}
        with self._log_path(name).open("ab") as log_file, _interrupts_blocked():
            process = subprocess.Popen(
                [sys.executable, "-m", "placegraph.runtime.process"],
                stdin=subprocess.PIPE,
                stdout=log_file,
                stderr=subprocess.STDOUT,
                env=environment,
            )
        if (previous := self._processes.get(name)) is not None and previous.stdin is not None:
            previous.stdin.close()
        self._processes[name] = process
        assert process.stdin is not None
        try:
            process.stdin.write(spec.model_dump_json().encode() + b"\n")
            process.stdin.flush()  # left open: the child ends when it reads the end of this pipe
        except BrokenPipeError:
            pass  # the child died at once; poll and start report that with its log

    def _on_alive(self, name: str, present: bool) -> None:
        with self._changed:
            (self._alive.add if present else self._alive.discard)(name)
            self._changed.notify_all()

    def _raise_if_dead(self, name: str) -> None:
        status = self._processes[name].poll()
        if status is not None:
            ending = f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"
            errors = [line for line in self._log_lines(name) if f" ERROR {name} " in line]
            cause = errors[-1].partition(f" ERROR {name} ")[2] if errors else ""
            raise PlacegraphError(f"{name} {ending}{': ' if cause else ''}{cause}{self._log_tail(name)}")

    def _log_path(self, name: str) -> Path:
        return self._out_dir / "log" / f"{name}.log"

    def _log_lines(self, name: str) -> list[str]:
        return self._log_path(name).read_text(errors="replace").splitlines()[-LOG_TAIL_LINES:]

    def _log_tail(self, name: str) -> str:
        lines = [*self._log_lines(name), f"(whole log: {self._log_path(name)})"]
        return "".join(f"\n    {line}" for line in lines)

    @staticmethod
    def _wait(process: subprocess.Popen[bytes], timeout_s: float) -> bool:
        try:
            process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    @staticmethod
    def _kill(process: subprocess.Popen[bytes]) -> None:
        process.kill()
        process.wait()

    def __enter__(self) -> Launcher:
        return self

    def __exit__(self, *error: object) -> None:
        try:
            self.kill()
        finally:
            for process in self._processes.values():
                if process.stdin is not None:
                    process.stdin.close()
            self._bus.close()


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    # Ctrl-C reaches every process of the terminal. A child started with this mask does not see one that comes while it
    # still imports; this process gets it on another thread or when the mask is lifted.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
