"""The terminal display of a run: a live table of the nodes, and the numbers at the end."""

from __future__ import annotations

import time
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Column, Table

from placegraph.runtime.config import Dataflow
from placegraph.runtime.messages import Health
from placegraph.runtime.messages.topics import TOPICS

PLAIN_PERIOD_S = 5.0  # between lines, where standard error is not a terminal
MIN_RATE_SHARE = 0.9  # of a topic's declared rate; below it a live node is marked


class ProgressTable:
    """Live table on a terminal, a line every few seconds elsewhere, nothing when quiet. Use as a context manager."""

    def __init__(self, dataflow: Dataflow, quiet: bool) -> None:
        self._dataflow, self._quiet = dataflow, quiet
        self._console = Console(stderr=True)
        self._health: dict[str, Health] = {}
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._last_line = time.monotonic()

    def __enter__(self) -> ProgressTable:
        if not self._quiet and self._console.is_terminal:
            self._live.start()
            self._live.update(f"starting {', '.join(self._dataflow.nodes)} ...", refresh=True)
        return self

    def __exit__(self, *error: object) -> None:
        if self._live.is_started:
            self._live.stop()

    def add(self, health: Health) -> None:
        """Take one node's newest report."""
        self._health[health.node] = health

    def say(self, text: str) -> None:
        """Print a line beside the table."""
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def refresh(self) -> None:
        """Show the newest reports."""
        if self._quiet or not self._health:
            return
        if self._live.is_started:
            self._live.update(self._table(), refresh=True)
        elif time.monotonic() - self._last_line >= PLAIN_PERIOD_S:
            self._last_line = time.monotonic()
            steps = [f"{name} {self._health[name].steps}" for name in self._dataflow.nodes if name in self._health]
            self.say("  ".join(steps))

    def _table(self) -> Table:
        table = Table(
            "node", *(_right(title) for title in ("steps", "per s", "p50 ms", "p95 ms", "waiting", "dropped", "MB"))
        )
        for name in self._dataflow.nodes:
            h = self._health.get(name)
            if h is None:
                table.add_row(name, *["-"] * 7)
                continue
            rate = f"[yellow]{h.rate_hz:.1f}[/]" if self._is_slow(name, h) else f"{h.rate_hz:.1f}"
            drops = f"[red]{h.drops}[/]" if h.drops else "0"
            times = f"{h.step_p50_ms:.1f}", f"{h.step_p95_ms:.1f}"
            table.add_row(name, str(h.steps), rate, *times, str(h.queue), drops, _megabytes(h.memory_mb))
        return table

    def _is_slow(self, name: str, health: Health) -> bool:
        if self._dataflow.context.lossless:  # a replay has no rate to keep
            return False
        expected_hz = max((TOPICS[kind].rate_hz for kind in self._dataflow.nodes[name].outputs), default=0.0)
        return health.rate_hz < MIN_RATE_SHARE * expected_hz

    def print_summary(self, summary: dict[str, Any]) -> None:
        """Numbers of the whole run, on standard output."""
        console = Console(highlight=False, soft_wrap=True)  # a terminal wraps by itself; a file keeps whole lines
        table = Table("node", *(_right(title) for title in ("steps", "p50 ms", "p95 ms", "dropped", "MB")))
        for name, n in summary["nodes"].items():
            times = f"{n['p50_ms']:.1f}", f"{n['p95_ms']:.1f}"
            table.add_row(name, str(n["steps"]), *times, str(n["drops"]), _megabytes(n["memory_mb"]))
        console.print(table)
        details = f" ({_counted(summary['keyframes'], 'keyframe')}, {summary['untrusted_poses']} untrusted)"
        console.print(
            f"{_counted(summary['frames'], 'frame')}{details if 'pose' in summary['nodes'] else ''}"
            f" in {summary['mapping_s']} s: {summary['frames_per_s']} frames per second; start {summary['start_s']} s"
        )
        if summary["trajectory"]:
            console.print(
                "trajectory: ATE rmse {ate_rmse_m} m, max {ate_max_m} m over {path_m} m".format(**summary["trajectory"])
            )
        if "graph" in summary:
            console.print("graph: " + ", ".join(_counted(count, layer) for layer, count in summary["graph"].items()))


def _megabytes(memory_mb: float) -> str:
    return f"{memory_mb:.0f}" if memory_mb else "-"  # inline, all nodes share one process


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _right(title: str) -> Column:
    return Column(title, justify="right")
