"""Plots of the processes' health."""

from __future__ import annotations

import rerun as rr

from placegraph.nodes.recorder.drawing import Canvas
from placegraph.runtime import messages as m


def draw_health(canvas: Canvas, health: m.Health, pngs: dict[str, bytes]) -> None:
    """A point of the plots of one node: step time, queue, drops, memory."""
    for name, value in (
        ("step_ms", health.step_p50_ms),
        ("queue", health.queue),
        ("drops", health.drops),
        ("memory_mb", health.memory_mb),
    ):
        canvas.log(["health", name, health.node], rr.Scalars(value))
