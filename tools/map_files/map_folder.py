"""A map folder: graph.json, cloud.ply, objects.ply, retired.json, trajectory.txt and run.json, written and read."""

from __future__ import annotations

import json
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from placegraph.runtime.arrays import F32, U8
from placegraph.runtime.config import RunConfig
from placegraph.runtime.errors import ConfigError, SchemaError
from placegraph.runtime.messages import Graph, Map, NamedGraph
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.map_files.ply import points_of, read_vertices, write_points

GRAPH, CLOUD, OBJECTS, TRAJECTORY, RUN = "graph.json", "cloud.ply", "objects.ply", "trajectory.txt", "run.json"
RETIRED = "retired.json"  # objects that were seen to be gone
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


def read_graph(path: Path) -> SceneGraph:
    """The graph of a map folder, or in a graph file; raises SchemaError."""
    return SceneGraph.load(find_graph(path))


def write_map(folder: Path, map_: Map | None, graph: Graph | NamedGraph | None) -> None:
    """Write the clouds, the retired objects and the graph into a folder; what is None is left out."""
    if map_ is not None:
        colors = dict(zip(RGB, map_.point_colors.T, strict=True))
        write_points(folder / CLOUD, map_.points_world, colors)
        ids = np.repeat(map_.object_ids, np.diff(map_.object_point_offsets)).astype(np.int32)
        write_points(folder / OBJECTS, map_.object_points_world, {"object": ids})
        (folder / RETIRED).write_text(json.dumps(retired_objects(map_), indent=1, sort_keys=True) + "\n")
    if graph is not None:
        SceneGraph.from_json(graph.json).save(folder / GRAPH)


def retired_objects(map_: Map) -> list[dict[str, Any]]:
    """Rows for retired.json: id, tags with votes, box in metres, the last frame that showed the object, and `gone`.

    `gone` is the frame at which enough keyframes had seen through the object's place.
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


def make_empty_folder(folder: Path) -> None:
    """Make an empty folder for one run's files; raises ConfigError when it holds other files already."""
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
    """Write run.json: the dataflow, effective settings, versions, commit and the run's numbers."""
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
    """The dataflow in a folder's run.json; raises SchemaError."""
    try:
        return RunConfig.model_validate(read_run(folder).get("config"))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(["config", *map(str, first["loc"])])
        raise SchemaError(f"{folder / RUN}: {where}: {first['msg']}; written by another version?") from None


def find_graph(path: Path) -> Path:
    """The graph file of a map folder, or the path itself if it is a file; raises SchemaError."""
    file = path / GRAPH if path.is_dir() else path
    if not file.is_file():
        raise SchemaError(
            f"{path}: no {GRAPH} here; expected a map folder that `placegraph run` wrote, or a graph file"
        )
    return file


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
    command = ["git", "-C", str(Path(__file__).resolve().parent), "describe", "--always", "--dirty"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    return result.stdout.strip() if result.returncode == 0 else "not from a checkout"
