"""List the rooms of a map and the objects in them, with their positions.

    python examples/list_objects.py out/demo

Reads graph.json of a map folder with placegraph's own types; the file is plain JSON, too.
"""

import sys
from pathlib import Path

from placegraph.runtime.scene_graph import SceneGraph


def main(folder: str) -> None:
    """Print one line a room and one for each of its objects."""
    graph = SceneGraph.load(Path(folder) / "graph.json")
    for room in graph.layer("room"):
        name = room.name if room.tags else "a room without a name"
        print(f"{room.id} {name}, {graph.nodes[room.parent].id}")
        for thing in graph.descendants(room.id, "object"):
            x, y, z = thing.center
            print(f"  {thing.id} {thing.name} at ({x:.2f}, {y:.2f}, {z:.2f}) m")


if __name__ == "__main__":
    main(*sys.argv[1:])
