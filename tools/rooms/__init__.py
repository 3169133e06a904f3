"""Rooms of what another system mapped: an occupancy map (a picture, or ROS's YAML beside it), or a point cloud."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer
import yaml
from pydantic import BaseModel, ValidationError

from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.rooms import RoomArea, RoomConfig, keep_walls, room_areas, segment_rooms
from placegraph.runtime.arrays import Bool
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.rooms.point_cloud import floors_of_cloud, read_point_cloud

MAX_ROOMS = np.iinfo(np.uint16).max


class MapYaml(BaseModel, frozen=True, extra="ignore"):
    """The YAML beside a map's image. Source: ROS map_server, whose thresholds are the defaults."""

    image: str
    resolution: float  # metres a pixel
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of the image's lower left corner: metres, metres, rad
    negate: bool = False
    occupied_thresh: float = 0.65  # of darkness, 0 white to 1 black
    free_thresh: float = 0.196


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """Bool images with row 0 at the top as in the file, and their position; cells that are neither are unknown."""

    occupied: Bool
    free: Bool
    resolution: float
    origin: tuple[float, float]


def rooms(
    source: Annotated[
        Path,
        typer.Argument(metavar="IMAGE|YAML|PLY", help="Occupancy map, light is free, dark a wall; or a point cloud."),
    ],
    out: Annotated[
        Path,
        typer.Option(
            help="PNG to write: 16 bit, 0 no room, 1 the largest room, and so on. "
            "Of a cloud with several floors OUT-1.png for the lowest, OUT-2.png, and so on."
        ),
    ],
    resolution: Annotated[
        float | None, typer.Option(help="Metres a pixel. A YAML brings its own; of a cloud 0.05 if not given.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with the outlines in metres.")] = False,
) -> None:
    """Split an occupancy map or a point cloud of another system into rooms.

    Reads a map as PNG, PGM or ROS's YAML and a cloud as PLY; writes a label image for each floor.
    """
    if source.suffix.lower() == ".ply":
        floors = _write_floors(source, out, resolution)
        print(json.dumps({"floors": floors}, sort_keys=True) if as_json else "\n".join(map(_floor_text, floors)))
        return
    rows = _write_labels(out, source, *rooms_of_plan(read_map(source, resolution)))
    print(json.dumps({"rooms": rows}, sort_keys=True) if as_json else _text(rows, out))


def read_map(path: Path, resolution: float | None = None) -> OccupancyMap:
    """Read an image of `resolution` metres a pixel, or a YAML that names one. Raises SourceError, ConfigError."""
    if path.suffix.lower() in (".yaml", ".yml"):
        if resolution is not None:
            raise ConfigError(f"--resolution: {path} brings its own")
        description = _read_yaml(path)
        image = path.parent / description.image
    elif resolution is None:
        raise ConfigError(f"--resolution: missing: how many metres is a pixel of {path}?")
    else:
        description, image = MapYaml(image=path.name, resolution=resolution), path
    if not description.resolution > 0:
        raise ConfigError(f"{path}: a resolution of {description.resolution} metres a pixel is not positive")
    if description.origin[2] != 0:
        raise SourceError(
            f"{path}: its origin is rotated by {description.origin[2]} rad; only unrotated maps can be read"
        )
    gray = cv2.imread(str(image), cv2.IMREAD_GRAYSCALE)
    if gray is None:
        raise SourceError(f"{image}: no such file, or not an image")
    dark = np.asarray(gray, float) / 255 if description.negate else 1 - np.asarray(gray, float) / 255
    occupied, free = dark > description.occupied_thresh, dark < description.free_thresh
    return OccupancyMap(occupied, free, description.resolution, description.origin[:2])


def rooms_of_plan(plan: OccupancyMap) -> tuple[PlanGrid, list[RoomArea]]:
    """Rooms, largest first; the grid's rows run along +y, so bottom up in the image. Source: nodes/hierarchy/rooms.py.

    Short occupied pieces count as furniture, which is part of its room.
    """
    config = RoomConfig(cell_m=plan.resolution)
    occupied, known = plan.occupied[::-1], (plan.occupied | plan.free)[::-1]
    labels = segment_rooms(keep_walls(occupied, config), known, config)
    grid = PlanGrid(np.array(plan.origin), plan.resolution, occupied.shape)
    return grid, room_areas(labels, grid, config)


def _read_yaml(path: Path) -> MapYaml:
    try:
        return MapYaml.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise SourceError(f"{path}: cannot read: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise SourceError(f"{path}: not YAML: {' '.join(str(error).split())}") from None
    except ValidationError as error:
        first = error.errors()[0]
        raise SourceError(f"{path}: {'.'.join(map(str, first['loc'])) or 'the file'}: {first['msg']}") from None


def _write_floors(source: Path, out: Path, resolution: float | None) -> list[dict[str, Any]]:
    """Write the label images of a cloud's floors; returns a row for each floor, the lowest first."""
    floors = floors_of_cloud(read_point_cloud(source), RoomConfig().cell_m if resolution is None else resolution)
    rows = []
    for number, floor in enumerate(floors, 1):
        file = out if len(floors) == 1 else out.with_name(f"{out.stem}-{number}{out.suffix}")
        row = {
            "floor": number,
            "low_m": round(floor.span.low_m, 3),
            "high_m": round(floor.span.ceiling_m, 3),
            "labels": str(file),
            "origin_m": np.round(floor.grid.origin, 3).tolist(),  # of the image's lower left corner
            "cell_m": floor.grid.cell_m,
        }
        rows.append(row | {"rooms": _write_labels(file, source, floor.grid, floor.rooms)})
    return rows


def _write_labels(out: Path, source: Path, grid: PlanGrid, areas: list[RoomArea]) -> list[dict[str, Any]]:
    """Write the label image of one plan; returns a row for each room."""
    if len(areas) > MAX_ROOMS:
        raise SourceError(f"{source}: {len(areas)} rooms do not fit a 16 bit image")
    labels, rows = np.zeros(grid.shape, np.uint16), []
    for number, room in enumerate(areas, 1):
        labels[room.mask] = number
        area_m2 = round(float(room.mask.sum()) * grid.cell_m**2, 2)
        rows.append({"room": number, "area_m2": area_m2, "outline_m": np.round(room.outline, 3).tolist()})
    if out.suffix.lower() != ".png" or not cv2.imwrite(str(out), labels[::-1]):
        raise ConfigError(f"--out {out}: cannot write a picture there; is it a .png in a folder that exists?")
    return rows


def _floor_text(row: dict[str, Any]) -> str:
    heights = f"floor {row['floor']} from {row['low_m']:.2f} to {row['high_m']:.2f} m"
    return f"{heights}\n{_text(row['rooms'], Path(row['labels']))}"


def _text(rows: list[dict[str, Any]], out: Path) -> str:
    lines = [f"room {row['room']}: {row['area_m2']:.1f} m2" for row in rows]
    return "\n".join([*lines, f"{len(rows)} rooms, labels in {out}"])
