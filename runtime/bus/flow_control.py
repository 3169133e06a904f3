"""Flow control of one process: an inbox that may drop old messages, and a credit window that makes a producer wait.

Messages are lost in one place only: in the inbox of a live run, and only of kinds with a limit. For all others the
producer waits: it may be a fixed number of messages (the window) ahead of its slowest consumer, and each consumer sends
a receipt for every message that it has stepped. The dataflow has no cycle, so this waiting always ends.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from placegraph.runtime.messages import Message


@dataclass(frozen=True)
class Envelope:
    """One message as it came off the bus: still packed, so that a dropped one costs no decoding."""

    kind: type[Message]
    sequence: int
    payload: bytes


class Inbox:
    """Envelopes in order of arrival, of a kind with a limit only the newest; filled by Zenoh's thread."""

    def __init__(self, limits: dict[type[Message], int]) -> None:
        """`limits`: how many envelopes of a kind are kept; a kind without an entry is never dropped."""
        self._limits = limits
        self._envelopes: dict[type[Message], deque[tuple[int, Envelope]]] = {}
        self._arrivals = 0
        self._drops: dict[type[Message], int] = {}
        self._changed = threading.Condition()
        self._closing = False

    def put(self, envelope: Envelope) -> None:
        """Add an envelope; drops the oldest of its kind when the kind's limit is exceeded."""
        with self._changed:
            queue = self._envelopes.setdefault(envelope.kind, deque())
            queue.append((self._arrivals, envelope))
            self._arrivals += 1
            limit = self._limits.get(envelope.kind, 0)
            if limit and len(queue) > limit:
                queue.popleft()
                self._drops[envelope.kind] = self._drops.get(envelope.kind, 0) + 1
            self._changed.notify()

    def get(self, timeout_s: float) -> Envelope | None:
        """The envelope that arrived first, or None after `timeout_s` or when the inbox is closing and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._closing or any(self._envelopes.values()), timeout_s)
            heads = [queue for queue in self._envelopes.values() if queue]
            return min(heads, key=lambda queue: queue[0][0]).popleft()[1] if heads else None

    def close(self) -> None:
        """Expect no more envelopes: `get` returns what is left and then None at once."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()

    @property
    def drained(self) -> bool:
        """Whether the inbox is closed and empty."""
        with self._changed:
            return self._closing and not any(self._envelopes.values())

    def __len__(self) -> int:
        with self._changed:
            return sum(map(len, self._envelopes.values()))

    @property
    def drops(self) -> dict[type[Message], int]:
        """How many envelopes of each kind were dropped for newer ones."""
        with self._changed:
            return dict(self._drops)


class CreditWindow:
    """Counts what a producer sent of one kind and what each consumer has confirmed."""

    def __init__(self, size: int, consumers: Iterable[str]) -> None:
        self._size = size
        self._confirmed = dict.fromkeys(consumers, 0)
        self._absent: set[str] = set()
        self._wait_for_absent = True
        self._sent = 0
        self._changed = threading.Condition()

    def reserve(self, timeout_s: float) -> int | None:
        """The next sequence number (from 1) once every consumer is less than `size` behind; None after `timeout_s`."""
        with self._changed:
            if not self._changed.wait_for(self._is_open, timeout_s):
                return None
            self._sent += 1
            return self._sent

    def _is_open(self) -> bool:
        ignored = set() if self._wait_for_absent else self._absent
        lags = [self._sent - count for consumer, count in self._confirmed.items() if consumer not in ignored]
        return not lags or max(lags) < self._size

    def confirm(self, consumer: str, sequence: int) -> None:
        """Record that a consumer has stepped everything up to `sequence`; unknown consumers are ignored."""
        with self._changed:
            if consumer in self._confirmed:
                self._confirmed[consumer] = max(self._confirmed[consumer], sequence)
                self._changed.notify_all()

    def set_present(self, consumer: str, present: bool) -> None:
        """Note that a consumer died, or is back: then what it missed counts as confirmed.

        The producer waits for a dead consumer until it is started again. If the producer went on, nodes that join its
        messages with the dead node's output would buffer without bound.
        """
        with self._changed:
            if present and consumer in self._absent:
                self._confirmed[consumer] = self._sent
                self._absent.discard(consumer)
            elif not present and consumer in self._confirmed:
                self._absent.add(consumer)
            self._changed.notify_all()

    def ignore_absent(self) -> None:
        """Stop waiting for dead consumers: the run ends, and they are not started again."""
        with self._changed:
            self._wait_for_absent = False
            self._changed.notify_all()
