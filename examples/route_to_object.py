"""Plan how a robot gets to an object of a map: the way points, and where to stand in front of it.

    python examples/route_to_object.py out/demo refrigerator 1.0 2.0 0.0

The robot is at x, y, z in metres in the map's frame, z the height of its floor.
"""

import sys
from pathlib import Path

import numpy as np

from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.scene_graph.route import find_route


def main(folder: str, name: str, *position: str) -> None:
    """Print the nearest object of that name by travel distance, the way points and the goal."""
    graph = SceneGraph.load(Path(folder) / "graph.json")
    start = np.array(position, float)
    routes = [
        (route.length_m, thing, route)
        for thing in graph.layer("object")
        if thing.name == name and thing.approach and (route := find_route(graph, start, thing.id))
    ]
    if not routes:
        sys.exit(f"no {name} can be reached")
    length_m, thing, route = min(routes, key=lambda entry: entry[0])
    print(f"{thing.id} {thing.name}: {length_m:.2f} m")
    for x, y, z in route.points:
        print(f"  ({x:.2f}, {y:.2f}, {z:.2f})")
    print(f"look to {np.degrees(thing.approach.yaw_rad):.0f} degrees")


if __name__ == "__main__":
    main(*sys.argv[1:])
