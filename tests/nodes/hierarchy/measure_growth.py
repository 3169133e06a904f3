"""CPU time of one hierarchy step as a generated building grows: 20 rooms of 4 x 4 m a floor, ten objects in each.

    python tests/nodes/hierarchy/measure_growth.py [FLOORS]

At each height three Maps: the first that shows its top floor, one in which objects and points were added to one room,
and one in which nothing changed.
"""

import sys
import time

import numpy as np

from placegraph.models_onnx.load import load
from placegraph.nodes.hierarchy.graph_builder import GraphBuilder, LayerConfig
from placegraph.nodes.hierarchy.locations import LocationConfig
from placegraph.runtime.messages import Map
from placegraph.runtime.node import Context

STEP = 0.05
ROOMS, SIDE_M, STOREY_M, CEILING_M = (10, 2), 4.0, 3.0, 2.6


def grid_points(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)


def storey(base_m: float) -> np.ndarray:
    """Floor, ceiling and walls with a door in the middle of each inner wall."""
    width, depth = ROOMS[0] * SIDE_M, ROOMS[1] * SIDE_M
    x, y, z = (np.arange(STEP / 2, size, STEP) for size in (width, depth, CEILING_M))
    parts = [grid_points(x, y, np.array([0.0, CEILING_M]))]
    across, along = (np.arange(0, size + 0.1, SIDE_M) for size in (width, depth))
    parts += [grid_points(across, y, z), grid_points(x, along, z)]
    points = np.concatenate(parts)
    offset = np.abs(points % SIDE_M - SIDE_M / 2)
    on_wall = (np.minimum(points[:, :2] % SIDE_M, -points[:, :2] % SIDE_M) < 1e-6).any(axis=1)
    inner = (points[:, 0] > 1) & (points[:, 0] < width - 1) & (points[:, 1] > 1) & (points[:, 1] < depth - 1)
    is_door = on_wall & inner & (offset[:, :2].min(axis=1) < 0.45) & (points[:, 2] < 2.05)
    return points[~is_door] + (0, 0, base_m)


def furniture(base_m: float, random: np.random.Generator) -> list[np.ndarray]:
    """Boxes of half a metre in every room."""
    box = grid_points(*(np.arange(0, 0.5, 0.025),) * 2, np.array([0.0, 0.25, 0.5]))
    rooms = [(i * SIDE_M, j * SIDE_M) for i in range(ROOMS[0]) for j in range(ROOMS[1])]
    return [box + np.r_[room + random.uniform(0.3, 3.2, 2), base_m] for room in rooms for _ in range(10)]


def as_map(revision: int, points: np.ndarray, objects: list[np.ndarray], floors: int) -> Map:
    free = [grid_points(np.arange(0.05, 40, 0.1), np.arange(0.05, 8, 0.1), STOREY_M * i + np.arange(0.25, 2.5, 0.5))
            for i in range(floors)]  # fmt: skip
    path = np.array([(x, 2.0, STOREY_M * i + 1.4) for i in range(floors) for x in np.arange(1, 39, 0.5)])
    boxes = np.array([(xyz.min(axis=0), xyz.max(axis=0)) for xyz in objects], np.float32)
    n = len(objects)
    turned = np.concatenate((boxes.mean(axis=1), boxes[:, 1] - boxes[:, 0], np.zeros((n, 1))), axis=1)
    return Map(
        frame_id=revision,
        stamp_ns=revision,
        revision=revision,
        final=False,
        keyframes=len(path),
        voxel_m=STEP,
        points_world=points.astype(np.float32),
        point_colors=np.zeros((len(points), 3), np.uint8),
        free_cell_m=0.1,
        free_points_world=np.concatenate(free).astype(np.float32),
        camera_positions_world=path.astype(np.float32),
        object_ids=np.arange(n),
        object_boxes_world=boxes,
        object_oriented_boxes=turned.astype(np.float32),
        object_colors=np.zeros((n, 3), np.uint8),
        object_observations=np.full(n, 4),
        object_first_frames=np.zeros(n, np.int64),
        object_last_frames=np.full(n, revision),
        object_points_world=np.concatenate(objects).astype(np.float32),
        object_point_offsets=np.cumsum([0, *map(len, objects)]),
        tag_names=("chair",) * n,
        tag_votes=np.ones(n, np.float32),
        tag_offsets=np.arange(n + 1),
    )


def main(most: int) -> None:
    random = np.random.default_rng(0)
    detector = load("house_locations", Context().model_dirs, 1)
    builder = GraphBuilder(LayerConfig(locations=LocationConfig(model="house_locations")), detector)
    print("| floors | points | objects | rooms | new floor, ms | one room changed, ms | nothing changed, ms |")
    print("|---|---|---|---|---|---|---|")
    points, objects, revision = np.zeros((0, 3)), list[np.ndarray](), 0
    for floor in range(most):
        points = np.concatenate((points, storey(STOREY_M * floor)))
        objects = objects + furniture(STOREY_M * floor, random)
        spent = []
        more = grid_points(np.arange(1, 1.5, 0.05), np.arange(1, 1.5, 0.05), np.array([STOREY_M * floor + 0.5]))
        for changed in (False, True, False):
            points = np.concatenate((points, more)) if changed else points
            objects = [*objects, more + np.array([0.3, 0.3, 0])] if changed else objects
            world = as_map(revision, points, objects, floor + 1)
            began = time.process_time()
            graph = builder.build(world)
            graph.to_json()
            spent.append(1000 * (time.process_time() - began))
            revision += 1
        row = (floor + 1, len(points), len(objects), len(graph.layer("room")), *(f"{ms:.0f}" for ms in spent))
        print("| " + " | ".join(map(str, row)) + " |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
