"""THE table of topics: what a message class's address is, how it is delivered, and who keeps it."""

from __future__ import annotations

from dataclasses import dataclass

from placegraph.runtime import messages as m


@dataclass(frozen=True)
class Topic:
    """One row: a message class and how it travels.

    `window` is how many messages a giver may be ahead of its slowest taker before it waits (0: it never waits; such
    messages are small, and bounded by those that do). `newest` is how many a taker keeps when live: an older one gives
    way and is counted as dropped. In replay nothing is dropped: `newest` is ignored and `window` holds instead.
    """

    kind: type[m.Message]
    key: str
    window: int
    newest: int  # 0: every message, also when live
    rate_hz: float  # what a healthy live run reaches at least; 0: no expectation
    recorded: bool  # exactly, into the recording

    @property
    def delivery(self) -> str:
        """In words, for tables."""
        return f"every in replay, newest {self.newest} live" if self.newest else "every"


TOPICS: dict[type[m.Message], Topic] = {
    topic.kind: topic
    for topic in (
        Topic(m.Frame, "frame", window=8, newest=8, rate_hz=10.0, recorded=False),  # `placegraph record` keeps these
        Topic(m.End, "end", window=8, newest=0, rate_hz=0.0, recorded=True),
        Topic(m.Pose, "pose", window=64, newest=0, rate_hz=10.0, recorded=True),
        Topic(m.Keyframe, "keyframe", window=6, newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Correction, "correction", window=6, newest=0, rate_hz=0.0, recorded=True),
        Topic(m.LastKeyframe, "last_keyframe", window=6, newest=0, rate_hz=0.0, recorded=True),
        Topic(m.Tags, "tags", window=6, newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Detections, "detections", window=6, newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Segments, "segments", window=6, newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Map, "map", window=2, newest=1, rate_hz=0.0, recorded=True),
        Topic(m.Graph, "graph", window=2, newest=1, rate_hz=0.0, recorded=True),
        Topic(m.NamedGraph, "named_graph", window=2, newest=1, rate_hz=0.0, recorded=True),
        Topic(m.Question, "question", window=0, newest=0, rate_hz=0.0, recorded=True),
        Topic(m.Answer, "answer", window=0, newest=0, rate_hz=0.0, recorded=True),
        Topic(m.Health, "health", window=0, newest=0, rate_hz=1.0, recorded=True),
    )
}
