"""Counters and percentiles behind the Health message. Pure: the shell hands in every duration."""

from __future__ import annotations

from collections import deque

import numpy as np

from placegraph.runtime.messages import Health

WINDOW = 4096  # durations kept for the percentiles of a whole run: enough for hours of keyframes, bounded for days


class StepStats:
    """What one node did: steps, durations, drops."""

    def __init__(self, node: str) -> None:
        self.node = node
        self.steps = 0
        self.drops = 0
        self._durations_ms: deque[float] = deque(maxlen=WINDOW)
        self._steps_at_last_report = 0

    def add_step(self, duration_s: float) -> None:
        """Count one step of `duration_s` seconds."""
        self.steps += 1
        self._durations_ms.append(duration_s * 1000)

    def percentile_ms(self, percent: float) -> float:
        """Percentile of the step durations in ms; 0 when there was no step."""
        return float(np.percentile(np.array(self._durations_ms), percent)) if self._durations_ms else 0.0

    def report(self, elapsed_s: float, queue: int, memory_mb: float) -> Health:
        """The Health message for the `elapsed_s` seconds since the last report."""
        done = self.steps - self._steps_at_last_report
        self._steps_at_last_report = self.steps
        return Health(
            frame_id=-1,
            stamp_ns=0,
            node=self.node,
            steps=self.steps,
            rate_hz=done / elapsed_s if elapsed_s > 0 else 0.0,
            step_p50_ms=self.percentile_ms(50),
            step_p95_ms=self.percentile_ms(95),
            queue=queue,
            drops=self.drops,
            memory_mb=memory_mb,
        )
