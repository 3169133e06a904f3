"""Collects from the messages of a run what its map folder needs."""

from __future__ import annotations

import time
from pathlib import Path

from placegraph.runtime.config import Dataflow
from placegraph.runtime.messages import Correction, End, Graph, Map, Message, NamedGraph, Pose
from placegraph.tools.map_files.corrected_trajectory import CorrectedTrajectory
from placegraph.tools.map_files.map_folder import TRAJECTORY, write_map
from placegraph.tools.map_files.trajectory_file import write_trajectory


class RunTimer:
    """Durations of a run: `start_s` until every node is ready, `mapping_s` from then to the last graph."""

    def __init__(self) -> None:
        self.start_s = self.mapping_s = 0.0
        self._since = time.monotonic()

    def begin(self) -> None:
        """The nodes are about to be started."""
        self._since = time.monotonic()

    def ready(self) -> None:
        """Every node is ready; the source starts."""
        self.start_s, self._since = time.monotonic() - self._since, time.monotonic()

    def done(self) -> None:
        """The last graph is there; only the first call counts."""
        self.mapping_s = self.mapping_s or time.monotonic() - self._since


class MapCollector:
    """Collects from the messages of a run what its map folder needs."""

    def __init__(self, dataflow: Dataflow) -> None:
        self.graph_kind = NamedGraph if dataflow.producer(NamedGraph) is not None else Graph
        self._expects_graph = dataflow.producer(self.graph_kind) is not None
        self.ended = False
        self._frames_of_source = 0
        self.timer = RunTimer()
        self._odometry: list[Pose] = []
        self._corrections = CorrectedTrajectory()
        self.map: Map | None = None
        self.graph: Graph | NamedGraph | None = None

    def add(self, message: Message) -> None:
        """Take any message: poses and corrections are kept, and the newest map and graph."""
        if isinstance(message, Pose):
            self._odometry.append(message)
        elif isinstance(message, Correction):
            self._corrections.add(message)
        elif isinstance(message, Map):
            self.map = message
        elif isinstance(message, self.graph_kind):
            self.graph = message
        elif isinstance(message, End):
            self.ended, self._frames_of_source = True, message.frames

    @property
    def poses(self) -> list[Pose]:
        """All poses so far, as corrected so far."""
        return self._corrections.correct(self._odometry)

    @property
    def frames(self) -> int:
        """How many frames the source gave; when a recording is played back, the number of its poses."""
        return self._frames_of_source or len(self._odometry)

    @property
    def complete(self) -> bool:
        """Whether the run's last graph has come; in a run without graphs, whether the source has ended."""
        if not self._expects_graph:
            return self.ended
        return self.graph is not None and self.graph.final

    def write(self, folder: Path) -> None:
        """Write the map folder as far as it is known; geometry and graph are left out when no map came."""
        folder.mkdir(parents=True, exist_ok=True)
        write_trajectory(folder / TRAJECTORY, self.poses)
        write_map(folder, self.map, self.graph)
