import numpy as np

from placegraph.nodes.fusion.voxel_map import FreeSpace, VoxelMap, depth_edges


def colors(n, value=10):
    return np.full((n, 3), value, np.uint8)


def test_empty_map():
    voxels = VoxelMap(0.05)
    voxels.integrate(np.zeros((0, 3)), colors(0))
    assert len(voxels) == 0 and voxels.points().shape == (0, 3) and voxels.colors().shape == (0, 3)


def test_points_of_one_voxel_are_averaged_over_calls():
    voxels = VoxelMap(1.0)
    voxels.integrate(np.array([[0.2, 0.2, 0.2]]), colors(1, 10))
    voxels.integrate(np.array([[0.4, 0.6, 0.2], [1.5, 0.0, 0.0]]), colors(2, 20))
    assert np.allclose(voxels.points(), [[0.3, 0.4, 0.2], [1.5, 0, 0]], atol=1e-3)
    assert voxels.colors().tolist() == [[15] * 3, [20] * 3]


def test_map_grows_past_its_first_size_and_keeps_old_rows():
    xyz = np.stack((np.arange(5000.0), np.zeros(5000), np.zeros(5000)), axis=1)
    voxels = VoxelMap(1.0)
    for part in np.split(xyz, 10):
        voxels.integrate(part, colors(len(part)))
    assert np.allclose(voxels.points(), xyz)


def test_flat_and_slanted_depth_has_no_edges_but_a_jump_has():
    flat = np.full((6, 8), 2.0, np.float32)
    assert not depth_edges(flat).any()
    slanted = flat + 0.02 * np.arange(8, dtype=np.float32)
    assert not depth_edges(slanted).any()
    jump = flat.copy()
    jump[:, 4:] = 3
    assert np.flatnonzero(depth_edges(jump).all(axis=0)).tolist() == [3, 4]


def test_missing_depth_is_no_edge():
    depth = np.full((5, 5), 2.0, np.float32)
    depth[2, 2] = 0
    assert not depth_edges(depth).any()
    assert not depth_edges(np.zeros((5, 5), np.float32)).any()


def test_a_ray_frees_what_it_crosses_and_not_what_it_hits():
    free = FreeSpace(0.1, 0.5, 0.15)
    free.carve(np.array([0.0, 0.05, 0.25]), np.array([[2.0, 0.05, 0.25]]))
    x = np.sort(free.points()[:, 0])
    assert np.allclose(x, np.arange(0.05, 1.9, 0.1), atol=1e-6)
    assert np.allclose(free.points()[:, 1:], [0.05, 0.25])


def test_nothing_is_carved_without_points_or_closer_than_the_clearance():
    free = FreeSpace(0.1, 0.5, 0.15)
    free.carve(np.zeros(3), np.zeros((0, 3)))
    free.carve(np.zeros(3), np.array([[0.1, 0, 0], [0, 0, 0]]))
    assert len(free) == 0 and free.points().shape == (0, 3)


def test_carving_again_adds_nothing():
    free = FreeSpace(0.1, 0.5, 0.15)
    for _ in range(2):
        free.carve(np.array([0.0, 0.0, 1.0]), np.array([[3.0, 1.0, 0.0]]))
        count = len(free)
    once = FreeSpace(0.1, 0.5, 0.15)
    once.carve(np.array([0.0, 0.0, 1.0]), np.array([[3.0, 1.0, 0.0]]))
    assert count == len(once) > 20


def turned(degrees, shift):
    pose = np.eye(4)
    angle = np.radians(degrees)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:3, 3] = shift
    return pose


def test_a_submap_that_is_moved_and_moved_back_leaves_no_trace():
    random = np.random.default_rng(1)
    voxels, still = VoxelMap(0.05, keep_submaps=True), VoxelMap(0.05, keep_submaps=True)
    for submap in range(3):
        xyz, rgb = random.uniform(0, 1, (3000, 3)), random.integers(0, 255, (3000, 3)).astype(np.uint8)
        for one in (voxels, still):
            one.integrate(xyz, rgb, submap)
    voxels.move_submap(1, turned(10, (0.3, 0, 0)))
    assert not np.array_equal(voxels.points(), still.points())
    voxels.move_submap(1, np.eye(4))
    assert np.array_equal(voxels.sums[voxels.occupied_rows()], still.sums[still.occupied_rows()])
    assert np.array_equal(voxels.points(), still.points())


def test_moved_free_space_neither_grows_nor_shrinks():
    free = FreeSpace(0.1, 0.5, 0.15, keep_submaps=True)
    ends = np.array([[3.0, y, z] for y in np.linspace(-2, 2, 60) for z in (0.3, 0.8)])
    free.carve(np.array([0.0, 0.0, 0.6]), ends)
    before = len(free)
    free.move_submap(0, turned(30, (0.05, 0.02, 0)))
    assert abs(len(free) - before) < 0.1 * before


def test_removed_voxels_do_not_come_back_with_a_submap_that_moves():
    voxels = VoxelMap(0.05, keep_submaps=True)
    xyz = np.stack((np.arange(0.025, 2, 0.05), np.zeros(40), np.zeros(40)), axis=1)
    for submap in (0, 1):
        voxels.integrate(xyz, colors(40), submap)
    voxels.remove(np.arange(10))
    assert len(voxels) == 30
    for submap in (0, 1):
        voxels.move_submap(submap, turned(0, (0, 1.0, 0)))
    assert len(voxels) == 30 and voxels.points()[:, 0].min() > 0.5
    voxels.integrate(xyz, colors(40), 2)  # it is there again
    assert len(voxels) == 70
