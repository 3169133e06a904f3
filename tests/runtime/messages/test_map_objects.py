import numpy as np

from placegraph.runtime.messages import Map, MapObject, RetiredObject, pack_objects


def cube(at: float) -> np.ndarray:
    return np.array([[at, 0, 0], [at + 1, 1, 1]], np.float32)


def map_object(number: int, points: int, *tags: tuple[str, float]) -> MapObject:
    return MapObject(
        id=number,
        box=cube(number),
        oriented_box=np.arange(7, dtype=np.float32) + number,
        color=np.full(3, number, np.uint8),
        observations=number + 1,
        first_frame=number + 2,
        last_frame=number + 3,
        points=np.full((points, 3), number, np.float32),
        tags=tags,
    )


def map_of(objects: list[MapObject], retired: list[RetiredObject]) -> Map:
    nothing = np.zeros((0, 3), np.float32)
    made = Map(
        frame_id=1,
        stamp_ns=0,
        revision=0,
        final=False,
        keyframes=0,
        voxel_m=0.05,
        points_world=nothing,
        point_colors=np.zeros((0, 3), np.uint8),
        free_cell_m=0.1,
        free_points_world=nothing,
        camera_positions_world=nothing,
        **pack_objects(objects, retired),
    )
    made.check()
    return made


def test_a_map_without_objects() -> None:
    assert map_of([], []).objects() == [] == map_of([], []).retired()


def test_objects_come_back_as_they_were_packed() -> None:
    objects = [map_object(2, 3, ("cup", 2.5), ("mug", 0.5)), map_object(5, 0), map_object(7, 1, ("chair", 1.0))]
    gone = [RetiredObject(id=4, box=cube(9), last_frame=3, gone_frame=8, tags=(("lamp", 1.5),))]
    map_ = map_of(objects, gone)
    for packed, item in zip(map_.objects(), objects, strict=True):
        for name, value in vars(item).items():
            assert np.array_equal(getattr(packed, name), value), name
    assert [item.name for item in map_.objects()] == ["cup", "object", "chair"]
    (retired,) = map_.retired()
    assert (retired.id, retired.last_frame, retired.gone_frame, retired.tags) == (4, 3, 8, (("lamp", 1.5),))
    assert np.array_equal(retired.box, cube(9))
