"""Plot how the processes are doing."""

from __future__ import annotations

import rerun as rr

from placegraph.nodes.recorder.drawing import Picture
from placegraph.runtime import messages as m


def draw_health(picture: Picture, health: m.Health, pngs: dict[str, bytes]) -> None:
    """One line for each node: step time, queue, drops, memory."""
    for name, value in (
        ("step_ms", health.step_p50_ms),
        ("queue", health.queue),
        ("drops", health.drops),
        ("memory_mb", health.memory_mb),
    ):
        picture.log(["health", name, health.node], rr.Scalars(value))
