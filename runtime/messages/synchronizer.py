"""Match messages of several kinds by frame id, so that a node's output cannot depend on how its inputs interleave."""

from __future__ import annotations

from placegraph.runtime.messages import Message


class FrameSynchronizer:
    """Collects one message of each kind per frame id and returns complete sets.

    When a set is complete, older incomplete ones are forgotten: each kind arrives in frame order, so what they lack
    was lost (live only).
    """

    def __init__(self, *kinds: type[Message]) -> None:
        self._kinds = kinds
        self._incomplete: dict[int, dict[type[Message], Message]] = {}

    def add(self, message: Message) -> tuple[Message, ...] | None:
        """Add a message; returns the set in the order of the kinds when it is complete now, else None."""
        messages = self._incomplete.setdefault(message.frame_id, {})
        messages[type(message)] = message
        if len(messages) < len(self._kinds):
            return None
        for frame_id in [i for i in self._incomplete if i <= message.frame_id]:
            del self._incomplete[frame_id]
        return tuple(messages[kind] for kind in self._kinds)

    def forget_before(self, stamp_ns: int) -> None:
        """Forget incomplete sets that were captured earlier."""
        for frame_id, messages in list(self._incomplete.items()):
            if max(message.stamp_ns for message in messages.values()) < stamp_ns:
                del self._incomplete[frame_id]

    def __len__(self) -> int:
        """Number of incomplete sets."""
        return len(self._incomplete)
