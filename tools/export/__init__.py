"""`placegraph export`: a map in the formats that other systems read."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.errors import ConfigError
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.export import dsg, glb, ros, svg
from placegraph.tools.export import ply as clouds
from placegraph.tools.map_files.map_folder import read_graph


class Format(StrEnum):
    """What a map can be written as."""

    DSG = "dsg"  # JSON that spark_dsg loads
    SVG = "svg"  # floor plans
    GLB = "glb"  # the cloud, outlines of rooms and locations, boxes of objects in 3D
    PLY = "ply"  # a folder: the points of each node
    ROS = "ros"  # a folder: an occupancy map of each floor for map_server


WRITERS: dict[Format, Callable[[Path, SceneGraph, Path], list[Path]]] = {
    Format.DSG: dsg.write,
    Format.SVG: svg.write,
    Format.GLB: glb.write,
    Format.PLY: clouds.write,
    Format.ROS: ros.write,
}


def export(
    map_folder: Annotated[Path, typer.Argument(metavar="MAP", help="A folder that `placegraph run` wrote.")],
    kind: Annotated[Format, typer.Argument(metavar="dsg|svg|glb|ply|ros")],
    out: Annotated[Path, typer.Option(help="File to write; for ply and ros a folder.")],
) -> None:
    """Write a map in a format of other systems.

    dsg: JSON of spark_dsg (Hydra); svg: floor plans; glb: a 3D scene; ply: points of each node; ros: occupancy maps.
    """
    graph = read_graph(map_folder)
    try:
        for path in WRITERS[kind](map_folder, graph, out):
            print(path)
    except OSError as error:
        raise ConfigError(f"--out {out}: cannot write there: {error.strerror}") from None
