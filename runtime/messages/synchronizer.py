"""Match messages of several kinds by frame id, so that a node's output cannot depend on how its inputs interleave."""

from __future__ import annotations

from placegraph.runtime.messages import Message


class FrameSynchronizer:
    """Collect one message of each kind per frame id and give complete sets.

    When a set is complete, older incomplete ones are forgotten: each kind arrives in frame order, so what they miss
    was lost (live only).
    """

    def __init__(self, *kinds: type[Message]) -> None:
        self._kinds = kinds
        self._waiting: dict[int, dict[type[Message], Message]] = {}

    def add(self, message: Message) -> tuple[Message, ...] | None:
        """Take a message; returns the set in the order of the kinds when it completes one, else None."""
        found = self._waiting.setdefault(message.frame_id, {})
        found[type(message)] = message
        if len(found) < len(self._kinds):
            return None
        for frame_id in [i for i in self._waiting if i <= message.frame_id]:
            del self._waiting[frame_id]
        return tuple(found[kind] for kind in self._kinds)

    def forget_before(self, stamp_ns: int) -> None:
        """Forget incomplete sets that were captured earlier."""
        for frame_id, found in list(self._waiting.items()):
            if max(message.stamp_ns for message in found.values()) < stamp_ns:
                del self._waiting[frame_id]

    def __len__(self) -> int:
        return len(self._waiting)
