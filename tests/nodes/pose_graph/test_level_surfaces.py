import numpy as np

from placegraph.nodes.pose_graph.level_surfaces import LevelSurfaceConfig, up_from_level_surfaces
from placegraph.runtime.vision.point_to_plane import SurfaceConfig, SurfaceMap, coarse_depth
from placegraph.runtime.vision.registration import exponential


def test_the_floor_tells_up_against_a_leaning_pose(room_view, standing) -> None:
    true = standing(0, 0, 0.2) @ exponential(np.array([0, 0, 0, -0.3, 0, 0]))  # looks down at the floor
    _, depth, intrinsics = room_view(true)
    surface = SurfaceMap(coarse_depth(depth), intrinsics, SurfaceConfig())
    leaning = true @ exponential(np.array([0, 0, 0, 0.05, 0.0, 0.03]))
    up = up_from_level_surfaces(surface, leaning, LevelSurfaceConfig())
    assert up is not None
    assert np.degrees(np.arccos(up @ true[2, :3])) < 0.5


def test_walls_alone_tell_nothing(standing) -> None:
    wall = np.full((240, 320), 2.0, np.float32)
    surface = SurfaceMap(coarse_depth(wall), np.array([260.0, 260, 160, 120]), SurfaceConfig())
    assert up_from_level_surfaces(surface, standing(0, 0, 0), LevelSurfaceConfig()) is None


def test_no_depth_tells_nothing(standing) -> None:
    surface = SurfaceMap(np.zeros((60, 80), np.float32), np.array([260.0, 260, 160, 120]), SurfaceConfig())
    assert up_from_level_surfaces(surface, standing(0, 0, 0), LevelSurfaceConfig()) is None
