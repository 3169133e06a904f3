"""Flow control of one process: an inbox that knows what may be dropped, and a window that makes a giver wait.

Frames are lost in one place, at the door of a live run; everything else waits. A giver of a topic may be `window`
messages ahead of its slowest taker; a taker sends a receipt when it has stepped a message. Edges declared as feedback
are not waited for, and without them the dataflow has no cycle, so waiting always ends.
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
    """Parcels in order of arrival; a kind with a limit keeps its newest. The bus fills it, the shell empties it."""

    def __init__(self, newest: dict[type[Message], int]) -> None:
        self._newest = newest
        self._envelopes: dict[type[Message], deque[tuple[int, Envelope]]] = {}
        self._arrivals = 0
        self._drops: dict[type[Message], int] = {}
        self._changed = threading.Condition()
        self._closing = False

    def put(self, envelope: Envelope) -> None:
        """Take a parcel; drops the oldest of its kind when the kind's limit is exceeded."""
        with self._changed:
            queue = self._envelopes.setdefault(envelope.kind, deque())
            queue.append((self._arrivals, envelope))
            self._arrivals += 1
            limit = self._newest.get(envelope.kind, 0)
            if limit and len(queue) > limit:
                queue.popleft()
                self._drops[envelope.kind] = self._drops.get(envelope.kind, 0) + 1
            self._changed.notify()

    def get(self, timeout_s: float) -> Envelope | None:
        """The parcel that arrived first, or None after `timeout_s` or when the inbox is closing and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._closing or any(self._envelopes.values()), timeout_s)
            heads = [queue for queue in self._envelopes.values() if queue]
            return min(heads, key=lambda queue: queue[0][0]).popleft()[1] if heads else None

    def close(self) -> None:
        """No more parcels are expected: `get` gives what is left and then None at once."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()

    @property
    def drained(self) -> bool:
        """Closed, and nothing left."""
        with self._changed:
            return self._closing and not any(self._envelopes.values())

    def __len__(self) -> int:
        with self._changed:
            return sum(map(len, self._envelopes.values()))

    @property
    def drops(self) -> dict[type[Message], int]:
        """How many of each kind gave way to newer ones."""
        with self._changed:
            return dict(self._drops)


class CreditWindow:
    """Counts what a giver sent of one kind and what each taker has confirmed."""

    def __init__(self, size: int, consumers: Iterable[str]) -> None:
        self._size = size
        self._confirmed = dict.fromkeys(consumers, 0)
        self._gone: set[str] = set()
        self._sent = 0
        self._changed = threading.Condition()

    def reserve(self, timeout_s: float) -> int | None:
        """The next sequence number (from 1) once every taker is less than `size` behind; None after `timeout_s`."""
        with self._changed:
            if not self._changed.wait_for(self._is_open, timeout_s):
                return None
            self._sent += 1
            return self._sent

    def _is_open(self) -> bool:
        behind = [self._sent - done for consumer, done in self._confirmed.items() if consumer not in self._gone]
        return not behind or max(behind) < self._size

    def confirm(self, consumer: str, sequence: int) -> None:
        """A taker has stepped everything up to `sequence`; receipts of strangers are ignored."""
        with self._changed:
            if consumer in self._confirmed:
                self._confirmed[consumer] = max(self._confirmed[consumer], sequence)
                self._changed.notify_all()

    def set_present(self, consumer: str, present: bool) -> None:
        """A taker that died is not waited for until it is back; what it missed counts as done."""
        with self._changed:
            if consumer not in self._confirmed:
                return
            if present and consumer in self._gone:
                self._gone.discard(consumer)
                self._confirmed[consumer] = self._sent
            elif not present:
                self._gone.add(consumer)
            self._changed.notify_all()

    def unconfirmed(self) -> list[str]:
        """Takers that have not confirmed everything sent."""
        with self._changed:
            return sorted(t for t, done in self._confirmed.items() if done < self._sent and t not in self._gone)
