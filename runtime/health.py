"""Counters and percentiles of the Health message. Reads no clock: the shell passes every duration."""

from __future__ import annotations

from collections import deque

import numpy as np

from placegraph.runtime.messages import Health

MAX_DURATIONS = 4096  # kept for the percentiles: hours of keyframes, and bounded in a run of days


class StepStats:
    """Steps of one node: how many, how long they took, how many messages were dropped before them."""

    def __init__(self, node: str) -> None:
        self.node = node
        self.steps = 0
        self.drops = 0
        self._durations_ms: deque[float] = deque(maxlen=MAX_DURATIONS)
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
        new_steps = self.steps - self._steps_at_last_report
        self._steps_at_last_report = self.steps
        return Health(
            frame_id=-1,
            stamp_ns=0,
            node=self.node,
            steps=self.steps,
            rate_hz=new_steps / elapsed_s if elapsed_s > 0 else 0.0,
            step_p50_ms=self.percentile_ms(50),
            step_p95_ms=self.percentile_ms(95),
            queue=queue,
            drops=self.drops,
            memory_mb=memory_mb,
        )
