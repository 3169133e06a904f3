"""The table of topics: the key of each message class, how it is delivered, and whether it is recorded."""

from __future__ import annotations

from dataclasses import dataclass

from placegraph.runtime import messages as m


@dataclass(frozen=True)
class Topic:
    """One row: a message class and how it travels.

    A producer may be `credit` messages ahead of its slowest consumer before it waits (0: it never waits; such messages
    are small, and no more than others that do wait). A consumer keeps the `keep_newest` newest messages when live:
    older ones are dropped and counted, and the producer never waits. In replay nothing is dropped: `keep_newest` is
    ignored and `credit` holds.
    """

    kind: type[m.Message]
    key: str
    credit: int
    keep_newest: int  # 0: every message, also when live
    rate_hz: float  # lowest rate of a healthy live run; 0: no expectation
    recorded: bool  # whether the recorder writes it into the recording

    @property
    def delivery(self) -> str:
        """The delivery rule in words, for tables."""
        return f"every in replay, newest {self.keep_newest} live" if self.keep_newest else "every"


TOPICS: dict[type[m.Message], Topic] = {
    topic.kind: topic
    for topic in (
        # frames are recorded by `placegraph record` only
        Topic(m.Frame, "frame", credit=8, keep_newest=8, rate_hz=10.0, recorded=False),
        Topic(m.End, "end", credit=8, keep_newest=0, rate_hz=0.0, recorded=True),
        # live, odometry must never wait for a blocked `keyframe`: 4096 poses are 2 MB and two minutes at 30 Hz
        Topic(m.Pose, "pose", credit=64, keep_newest=4096, rate_hz=10.0, recorded=True),
        Topic(m.Keyframe, "keyframe", credit=6, keep_newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Correction, "correction", credit=6, keep_newest=0, rate_hz=0.0, recorded=True),
        Topic(m.LastKeyframe, "last_keyframe", credit=6, keep_newest=0, rate_hz=0.0, recorded=True),
        Topic(m.Tags, "tags", credit=6, keep_newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Detections, "detections", credit=6, keep_newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Segments, "segments", credit=6, keep_newest=0, rate_hz=1.0, recorded=True),
        Topic(m.Map, "map", credit=2, keep_newest=1, rate_hz=0.0, recorded=True),
        Topic(m.Graph, "graph", credit=2, keep_newest=1, rate_hz=0.0, recorded=True),
        Topic(m.NamedGraph, "named_graph", credit=2, keep_newest=1, rate_hz=0.0, recorded=True),
        Topic(m.Question, "question", credit=0, keep_newest=0, rate_hz=0.0, recorded=True),
        Topic(m.Answer, "answer", credit=0, keep_newest=0, rate_hz=0.0, recorded=True),
        Topic(m.Health, "health", credit=0, keep_newest=0, rate_hz=1.0, recorded=True),
    )
}
