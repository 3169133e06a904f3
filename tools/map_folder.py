"""What a run leaves behind: graph.json, cloud.ply, objects.ply, retired.json, trajectory.txt (TUM), run.json.

And reading it back.
"""

from __future__ import annotations

import json
import platform
import subprocess
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from placegraph.runtime.arrays import F32, F64, U8
from placegraph.runtime.config import Dataflow, RunConfig
from placegraph.runtime.errors import ConfigError, SchemaError
from placegraph.runtime.messages import Correction, End, Graph, Map, Message, PlaceNames, Pose
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.vision.geometry import quaternion_xyzw
from placegraph.tools.corrected import CorrectedKeyframes
from placegraph.tools.ply import points_of, read_vertices, write_points

GRAPH, CLOUD, OBJECTS, TRAJECTORY, RUN = "graph.json", "cloud.ply", "objects.ply", "trajectory.txt", "run.json"
RETIRED = "retired.json"  # objects that were seen to be no longer there
RGB = ("red", "green", "blue")
PACKAGES = (
    "placegraph",
    "numpy",
    "scipy",
    "opencv-python-headless",
    "onnxruntime",
    "kiss-icp",
    "eclipse-zenoh",
    "rerun-sdk",
)


class Clock:
    """Times of one run: `start_s` until every node is ready, `mapping_s` from then to the last graph."""

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


class Collector:
    """Keeps what the map folder needs out of the messages of a run."""

    def __init__(self, dataflow: Dataflow) -> None:
        self._expects_graph = dataflow.producer(Graph) is not None
        self._expects_names = dataflow.producer(PlaceNames) is not None
        self.ended = False
        self._frames_of_source = 0
        self.clock = Clock()
        self._odometry: list[Pose] = []
        self._corrections = CorrectedKeyframes()
        self.map: Map | None = None
        self.graph: Graph | None = None

    def add(self, message: Message) -> None:
        """Take any message; keeps poses and corrections, the newest map and the newest graph."""
        if isinstance(message, Pose):
            self._odometry.append(message)
        elif isinstance(message, Correction):
            self._corrections.add(message)
        elif isinstance(message, Map):
            self.map = message
        elif isinstance(message, Graph):
            self.graph = message
        elif isinstance(message, End):
            self.ended, self._frames_of_source = True, message.frames

    @property
    def poses(self) -> list[Pose]:
        """All poses so far, as corrected so far."""
        return self._corrections.correct(self._odometry)

    @property
    def frames(self) -> int:
        """How many frames the source gave; of a recording that is played back, those it knows a pose of."""
        return self._frames_of_source or len(self._odometry)

    @property
    def complete(self) -> bool:
        """The last graph of the run is here, with its names if any are to come; without a graph, the source's end."""
        if not self._expects_graph:
            return self.ended
        return self.graph is not None and self.graph.final and (self.graph.named or not self._expects_names)

    def write(self, folder: Path) -> None:
        """Write what there is; geometry and graph are left out when no map came."""
        folder.mkdir(parents=True, exist_ok=True)
        write_trajectory(folder / TRAJECTORY, self.poses)
        if self.map is not None:
            colors = dict(zip(RGB, self.map.point_colors.T, strict=True))
            write_points(folder / CLOUD, self.map.points_world, colors)
            ids = np.repeat(self.map.object_ids, np.diff(self.map.object_point_offsets)).astype(np.int32)
            write_points(folder / OBJECTS, self.map.object_points_world, {"object": ids})
            (folder / RETIRED).write_text(json.dumps(retired(self.map), indent=1, sort_keys=True) + "\n")
        if self.graph is not None:
            SceneGraph.from_json(self.graph.json).save(folder / GRAPH)


def retired(map_: Map) -> list[dict[str, Any]]:
    """Objects that are no longer there: id, tags with votes, box in metres, the last frame that showed it and `gone`.

    `gone` is the frame that made it certain: enough keyframes had seen through the place.
    """
    return [
        {
            "id": f"O{item.id}",
            "tags": [[name, round(vote, 3)] for name, vote in item.tags],
            "box": np.round(item.box.astype(float), 3).tolist(),
            "last_seen": item.last_frame,
            "gone": item.gone_frame,
        }
        for item in map_.retired()
    ]


def prepare(folder: Path) -> None:
    """Make an empty folder for a run; raises ConfigError rather than mixing two runs."""
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise ConfigError(f"{folder}: exists and is not an empty folder; choose another --out or remove it")
    folder.mkdir(parents=True, exist_ok=True)


def next_folder(base: Path, name: str) -> Path:
    """`base/name-001`, or the next number that is free."""
    number = 1
    while (folder := base / f"{name}-{number:03d}").exists():
        number += 1
    return folder


def write_run(folder: Path, config: RunConfig, effective: dict[str, Any], summary: dict[str, Any]) -> None:
    """Write run.json: effective settings, versions, commit and the run's numbers."""
    record = {
        "config": config.model_dump(mode="json"),
        "effective": effective,
        "versions": {name: _version(name) for name in PACKAGES} | {"python": platform.python_version()},
        "commit": _commit(),
        "summary": summary,
    }
    (folder / RUN).write_text(json.dumps(record, indent=1, sort_keys=True) + "\n")


def read_run(folder: Path) -> dict[str, Any]:
    """Read run.json; raises SchemaError."""
    try:
        record = json.loads((folder / RUN).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SchemaError(f"{folder / RUN}: cannot read: {error}") from None
    if not isinstance(record, dict):
        raise SchemaError(f"{folder / RUN}: expected an object, found {type(record).__name__}")
    return record


def read_config(folder: Path) -> RunConfig:
    """The dataflow that a run.json tells of; raises SchemaError."""
    try:
        return RunConfig.model_validate(read_run(folder).get("config"))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(["config", *map(str, first["loc"])])
        raise SchemaError(f"{folder / RUN}: {where}: {first['msg']}; written by another version?") from None


def find_graph(path: Path) -> Path:
    """The graph file of a map folder, or the path itself if it is a file; raises SchemaError."""
    found = path / GRAPH if path.is_dir() else path
    if not found.is_file():
        raise SchemaError(
            f"{path}: no {GRAPH} here; expected a map folder that `placegraph run` wrote, or a graph file"
        )
    return found


def write_trajectory(path: Path, poses: list[Pose]) -> None:
    """TUM format: `seconds x y z qx qy qz qw` for each trusted pose, world_from_camera, by time."""
    lines = []
    for pose in sorted((p for p in poses if p.trusted), key=lambda pose: pose.frame_id):
        x, y, z = pose.world_from_camera[:3, 3]
        quaternion = quaternion_xyzw(pose.world_from_camera[:3, :3])
        seconds = f"{pose.stamp_ns // 10**9}.{pose.stamp_ns % 10**9:09d}"
        lines.append(" ".join([seconds, *(f"{v:.6f}" for v in (x, y, z, *quaternion))]))
    path.write_text("# seconds tx ty tz qx qy qz qw\n" + "".join(line + "\n" for line in lines))


def read_trajectory(path: Path) -> dict[int, F64]:
    """TUM file to stamp_ns -> (3,) position in metres; raises SchemaError naming the line."""
    found: dict[int, F64] = {}
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise SchemaError(f"{path}: cannot read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise SchemaError(f"{path}: cannot read: {error}") from None
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            stamp, *numbers = line.split()
            seconds, _, fraction = stamp.partition(".")
            position = np.array(numbers, float)
            if position.shape != (7,) or not np.isfinite(position).all():
                raise ValueError("expected 8 finite numbers")
            found[int(seconds) * 10**9 + int(fraction.ljust(9, "0")[:9] or 0)] = position[:3]
        except ValueError as error:
            raise SchemaError(f"{path}:{number}: {error}") from None
    return found


def read_cloud(folder: Path) -> tuple[F32, U8]:
    """Points (P, 3) in metres, world frame, and colours (P, 3) of a map folder; raises SchemaError."""
    path = folder / CLOUD
    rows = read_vertices(path)
    if not set(RGB) <= set(rows.dtype.names or ()):
        raise SchemaError(f"{path}: not a cloud that `placegraph run` wrote: its points have no colours")
    rgb = np.stack([rows[channel] for channel in RGB], axis=1)
    return points_of(rows, path).astype(np.float32), rgb.astype(np.uint8)


def read_object_clouds(folder: Path) -> dict[str, F32]:
    """Points (N, 3) in metres, world frame, of each object of a map folder by its id; raises SchemaError."""
    path = folder / OBJECTS
    rows = read_vertices(path)
    if "object" not in (rows.dtype.names or ()):
        raise SchemaError(f"{path}: not the objects' points that `placegraph run` writes: they name no object")
    xyz = points_of(rows, path).astype(np.float32)
    order = np.argsort(rows["object"], kind="stable")
    numbers, starts = np.unique(rows["object"][order], return_index=True)
    parts = np.split(xyz[order], starts[1:])
    return {f"O{number}": part for number, part in zip(numbers.tolist(), parts, strict=True)} if len(rows) else {}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    here = Path(__file__).resolve().parent
    found = subprocess.run(
        ["git", "-C", str(here), "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    )
    return found.stdout.strip() if found.returncode == 0 else "not from a checkout"
