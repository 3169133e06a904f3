"""Floors and rooms of point clouds without a camera: what is found, and that odd clouds are no exception. (contract)"""

from pathlib import Path

import numpy as np
import pytest

from placegraph.nodes.hierarchy.floors import FloorConfig
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.map_files.ply import write_points
from placegraph.tools.rooms.point_cloud import (
    EYE_HEIGHT_M,
    floors_of_cloud,
    read_point_cloud,
    standpoints,
    voxel_centroids,
)

STEP_M = 0.04
Range = tuple[float, float]


def sheet(x: Range, y: Range, z: Range) -> np.ndarray:
    """Points of a level or upright rectangle: one of the ranges has no length."""
    axes = [np.arange(low, high + STEP_M / 2, STEP_M) for low, high in (x, y, z)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def storey(z: float, height: float = 2.5, ceiling: bool = True) -> list[np.ndarray]:
    """8 x 4 m, rooms of 5 x 4 and 3 x 4 m with a door of .9 x 2 m between them, and a table in the larger one."""
    top = z + height
    around = [
        ((0, 8), (0, 0)),
        ((0, 8), (4, 4)),
        ((0, 0), (0, 4)),
        ((8, 8), (0, 4)),
        ((5, 5), (0, 1)),
        ((5, 5), (1.9, 4)),
    ]
    sheets = [sheet(x, y, (z, top)) for x, y in around]
    sheets += [sheet((5, 5), (1, 1.9), (z + 2, top)), sheet((0, 8), (0, 4), (z, z))]
    sheets.append(sheet((1, 2.5), (1, 2), (z + 0.75, z + 0.75)))
    return [*sheets, sheet((0, 8), (0, 4), (top, top))] if ceiling else sheets


def areas(floors: list) -> list[list[float]]:
    return [[float(room.mask.sum()) * floor.grid.cell_m**2 for room in floor.rooms] for floor in floors]


def heights(floors: list) -> list[list[float]]:
    return [[floor.span.low_m, floor.span.high_m] for floor in floors]


@pytest.mark.parametrize("ceiling", [True, False])
def test_two_floors_with_two_rooms_each(ceiling: bool) -> None:
    floors = floors_of_cloud(np.concatenate(storey(0.0) + storey(2.8, ceiling=ceiling)), 0.05)
    np.testing.assert_allclose(heights(floors), [[0, 2.5], [2.8, 5.3]], atol=0.05)
    np.testing.assert_allclose(areas(floors), [[20, 12], [20, 12]], rtol=0.1)


def test_an_upper_floor_that_covers_half_of_the_lower_one_is_one() -> None:
    upper = [points[points[:, 0] > 4.9] for points in storey(2.8)]
    floors = floors_of_cloud(np.concatenate(storey(0.0) + upper), 0.05)
    np.testing.assert_allclose(heights(floors), [[0, 2.5], [2.8, 5.3]], atol=0.05)


def test_neither_foundations_nor_a_roof_nor_tables_are_floors() -> None:
    slabs = [sheet((0, 8), (0, 4), (z, z)) for z in (-0.3, 2.8)]
    floors = floors_of_cloud(np.concatenate(storey(0.0) + slabs), 0.05)
    np.testing.assert_allclose(heights(floors), [[0, 2.5]], atol=0.35)  # the roof may be taken for the ceiling
    assert floors[0].span.low_m == pytest.approx(0, abs=0.05)


def test_the_order_of_the_points_changes_nothing() -> None:
    points = np.concatenate(storey(0.0) + storey(2.8))
    shuffled = np.random.default_rng(0).permutation(points)
    for one, other in zip(floors_of_cloud(points, 0.05), floors_of_cloud(shuffled, 0.05), strict=True):
        assert heights([one]) == [pytest.approx(heights([other])[0])]
        assert [room.outline.tolist() for room in one.rooms] == [room.outline.tolist() for room in other.rooms]


@pytest.mark.parametrize(
    "points",
    [
        np.random.default_rng(0).uniform(0, 1.9, (2000, 3)),
        np.zeros((1, 3)),
        np.zeros((50, 3)),
        sheet((0, 3), (0, 3), (0, 0)),
        sheet((0, 3), (1, 1), (0, 2.5)),
        np.stack([np.arange(40) * 0.25, np.zeros(40), np.arange(40) * 0.17], axis=1),
    ],
    ids=["noise", "one point", "one place", "a level", "a wall", "stairs"],
)
def test_odd_clouds_have_one_floor_with_a_room(points: np.ndarray) -> None:
    floors = floors_of_cloud(points, 0.05)
    assert len(floors) == 1 and len(floors[0].rooms) >= 1
    assert np.isfinite(heights(floors)).all() and floors[0].span.low_m <= floors[0].span.high_m


def test_people_stand_on_floors_only() -> None:
    eyes = standpoints(voxel_centroids(np.concatenate(storey(0.0) + storey(2.8)), 0.05), FloorConfig())
    assert set(np.round(eyes[:, 2] - EYE_HEIGHT_M, 1)) == {0.0, 2.8}


def test_thinned_points_are_the_middles_of_their_voxels() -> None:
    points = np.array([[0, 0, 0], [0.02, 0, 0.04], [0.2, 0, 0]])
    np.testing.assert_allclose(voxel_centroids(points, 0.05), [[0.01, 0, 0.02], [0.2, 0, 0]])


@pytest.mark.parametrize(
    ("points", "text"),
    [
        (np.zeros((0, 3)), "holds no points"),
        (np.array([[0, 0, 0], [9000, 0, 0.0]]), "its points lie 9000 m apart: a building in metres"),
    ],
)
def test_clouds_of_no_building_are_named(tmp_path: Path, points: np.ndarray, text: str) -> None:
    write_points(tmp_path / "a.ply", points, {})
    with pytest.raises(SourceError, match=rf"a\.ply: {text}"):
        read_point_cloud(tmp_path / "a.ply")


@pytest.mark.parametrize("cell_m", [0.0, -0.05, float("nan"), float("inf"), 1e-5])
def test_a_cell_of_no_use_is_named(cell_m: float) -> None:
    with pytest.raises(ConfigError, match=r"--resolution: .*(not a positive length|more than 10000 a side)"):
        floors_of_cloud(np.array([[0, 0, 0], [1, 0, 0.0]]), cell_m)


@pytest.mark.parametrize("cell_m", [0.02, 0.3, 3.0])
def test_fine_and_coarse_cells_find_the_same_floors(cell_m: float) -> None:
    floors = floors_of_cloud(np.concatenate(storey(0.0) + storey(2.8)), cell_m)
    np.testing.assert_allclose(heights(floors), [[0, 2.5], [2.8, 5.3]], atol=0.05)
    assert all(floor.rooms for floor in floors)
