from collections.abc import Callable

import numpy as np
import pytest

from placegraph.runtime.messages import Map

STEP = 0.05


def plane(x, y, z):
    """Points on a plane: two of the arguments are (low, high), one is a number."""
    axes = [np.arange(v[0] + STEP / 2, v[1], STEP) if isinstance(v, tuple) else np.array([v]) for v in (x, y, z)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def storey(base, ceiling=2.6):
    """Two rooms of 4 x 4 m with a wall between at x = 4 and a door of 0.9 m in it (2 m high)."""
    top = base + ceiling
    walls = [plane((0, 8), y, (base, top)) for y in (0.0, 4.0)]
    walls += [plane(x, (0, 4), (base, top)) for x in (0.0, 8.0)]
    walls += [plane(4.0, (0, 1.5), (base, top)), plane(4.0, (2.4, 4), (base, top))]
    walls += [plane(4.0, (1.5, 2.4), (base + 2.0, top))]
    return np.concatenate([plane((0, 8), (0, 4), base), plane((0, 8), (0, 4), top), *walls])


def box_points(low, high):
    return np.concatenate(
        [
            plane((low[0], high[0]), (low[1], high[1]), z)
            if axis == 2
            else plane(z, (low[1], high[1]), (low[2], high[2]))
            for axis, z in ((2, high[2]), (2, low[2]), (0, low[0]), (0, high[0]))
        ]
    )


@pytest.fixture
def house_points() -> Callable[..., np.ndarray]:
    """house_points(storeys): the cloud of a house with two rooms a storey, 3 m from floor to floor."""
    return lambda storeys: np.concatenate([storey(3.0 * i) for i in range(storeys)])


@pytest.fixture
def make_map() -> Callable[..., Map]:
    """make_map(points, cameras, objects={number: (name, low, high)}, ...): a Map of boxes standing in a cloud."""

    def make(points, cameras, objects=None, revision=0, final=False, free=None):
        objects = objects or {}
        clouds = [box_points(low, high) for _, low, high in objects.values()]
        boxes = [np.stack((cloud.min(axis=0), cloud.max(axis=0))) for cloud in clouds]
        oriented = [[*b.mean(axis=0), *(b[1] - b[0]), 0.0] for b in boxes]
        n = len(objects)
        made = Map(
            frame_id=100 + revision,
            stamp_ns=5 * revision,
            revision=revision,
            final=final,
            keyframes=len(cameras),
            voxel_m=STEP,
            points_world=np.concatenate([points, *clouds]).astype(np.float32),
            point_colors=np.zeros((len(points) + sum(map(len, clouds)), 3), np.uint8),
            free_cell_m=0.1,
            free_points_world=np.asarray(np.zeros((0, 3)) if free is None else free, np.float32),
            camera_positions_world=np.asarray(cameras, np.float32).reshape(-1, 3),
            object_ids=np.array(list(objects), np.int64),
            object_boxes_world=np.array(boxes, np.float32).reshape(-1, 2, 3),
            object_oriented_boxes=np.array(oriented, np.float32).reshape(-1, 7),
            object_colors=np.full((n, 3), 9, np.uint8),
            object_observations=np.full(n, 4, np.int64),
            object_first_frames=np.arange(n, dtype=np.int64),
            object_last_frames=np.arange(n, dtype=np.int64) + 10,
            object_points_world=np.concatenate([*clouds, np.zeros((0, 3))]).astype(np.float32),
            object_point_offsets=np.cumsum([0, *map(len, clouds)], dtype=np.int64),
            tag_names=tuple(name for name, _, _ in objects.values()),
            tag_votes=np.full(n, 2.0, np.float32),
            tag_offsets=np.arange(n + 1, dtype=np.int64),
            retired_ids=np.zeros(0, np.int64),
            retired_boxes_world=np.zeros((0, 2, 3), np.float32),
            retired_last_frames=np.zeros(0, np.int64),
            retired_gone_frames=np.zeros(0, np.int64),
            retired_tag_names=(),
            retired_tag_votes=np.zeros(0, np.float32),
            retired_tag_offsets=np.zeros(1, np.int64),
        )
        made.check()
        return made

    return make


@pytest.fixture
def walk() -> Callable[[int], np.ndarray]:
    """walk(storeys): camera positions through both rooms, 1.5 m above each floor, with a climb between storeys."""

    def make(storeys):
        path = []
        for i in range(storeys):
            path += [(x, 2.0, 3.0 * i + 1.5) for x in np.linspace(1, 7, 15)]
            if i + 1 < storeys:
                path += [(7.0, 2.0, 3.0 * i + z) for z in np.linspace(2, 4, 4)]
        return np.array(path)

    return make
