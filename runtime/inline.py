"""Run the whole dataflow in one thread, in a fixed order: for tests, data sets and debugging."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from placegraph.runtime.config import Dataflow
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.health import StepStats
from placegraph.runtime.messages import Message
from placegraph.runtime.node import Node, Source

MAX_CASCADE = 1000  # messages that one message of the source may cause; far above any real dataflow's


class Inline:
    """Runs a dataflow; `stats` holds each node's step times afterwards."""

    def __init__(self, dataflow: Dataflow, observe: Callable[[Message], None] = lambda message: None) -> None:
        """`observe` gets every message once, before its consumers."""
        self._dataflow, self._observe = dataflow, observe
        self.stats = {name: StepStats(name) for name in dataflow.nodes}

    def __enter__(self) -> Inline:
        started: list[Node] = []
        try:
            for node in self._dataflow.nodes.values():
                started.append(node)
                node.start()
        except BaseException:
            for node in started:
                node.stop()
            raise
        return self

    def __exit__(self, *error: object) -> None:
        for node in self._dataflow.nodes.values():
            node.stop()

    def run(self) -> None:
        """Pass everything that the source produces through the nodes."""
        source = self._dataflow.source
        name = next(name for name, node in self._dataflow.nodes.items() if node is source)
        began = time.monotonic()
        for message in source.messages():
            self.stats[name].add_step(time.monotonic() - began)
            self.feed(message)
            began = time.monotonic()

    def feed(self, message: Message) -> None:
        """Deliver one message and all that follows from it, oldest first."""
        queue, delivered = deque([message]), 0
        while queue:
            current = queue.popleft()
            current.check()
            self._observe(current)
            delivered += 1
            if delivered > MAX_CASCADE:
                kinds = sorted({type(queued).__name__ for queued in queue} | {type(current).__name__})
                raise ConfigError(f"one message caused more than {MAX_CASCADE} others, last {', '.join(kinds)}")
            for name in self._dataflow.consumers(type(current)):
                node = self._dataflow.nodes[name]
                if isinstance(node, Source):
                    continue
                began = time.monotonic()
                queue.extend(node.step(current))
                self.stats[name].add_step(time.monotonic() - began)
