"""The renderer: depth, instances and occlusion against geometry worked out by hand."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.house_mesh import box_uv_mapping
from placegraph.tools.simulator.house_model import TEXTURES, Floor, House, Item, Material, Part, PlacedItem
from placegraph.tools.simulator.mesh_primitives import block, box
from placegraph.tools.simulator.render import Renderer
from placegraph.tools.simulator.texture_atlas import atlas, tile

WHITE = Material((230, 230, 230))
AHEAD = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 1], [0, 0, 0, 1]])  # at (0, 0, 1), looking along +y


def make_house(*parts: Part, items: tuple[PlacedItem, ...] = (), seed: int = 1) -> House:
    floor = Floor(0, 0.0, 2.5, np.array([[-9.0, -9], [9, -9], [9, 9], [-9, 9]]), (), ())
    return House(seed, (floor,), (), parts, items, lights=((0.0, 1.0, 2.3),))


def place(id: int, x: float, y: float, z: float = 0.0, yaw: float = 0.0, **changes: object) -> PlacedItem:
    material = Material(**({"color": (200, 60, 40)} | changes))  # type: ignore[arg-type]
    return PlacedItem(id, Item("box", (block((0, 0, 0), (0.6, 0.4, 2), material),)), x, y, z, yaw, 0)


def test_depth_is_that_of_the_plane_under_a_tilted_camera():
    house = make_house(box((-20, -20, -0.1), (20, 20, 0), WHITE))
    tilt = np.deg2rad(35)
    pose = AHEAD.copy()
    pose[:3, 1], pose[:3, 2] = (0, -np.sin(tilt), -np.cos(tilt)), (0, np.cos(tilt), -np.sin(tilt))
    pose[:3, 3] = (0.3, -0.2, 1.4)
    renderer = Renderer(house, 160, 120)
    view = renderer.render(pose)
    fx, fy, cx, cy = renderer.intrinsics
    rows, columns = np.mgrid[:120, :160]
    down = np.stack(((columns - cx) / fx, (rows - cy) / fy, np.ones((120, 160))), axis=-1) @ pose[2, :3]
    expected = np.where(down < 0, -1.4 / down, 0)
    near = (expected > 0) & (expected < 15)
    assert near.mean() > 0.7
    assert np.abs(view.depth_m - expected)[near].max() < 2e-5
    assert view.depth_m.dtype == np.float32


def test_rays_that_hit_nothing_have_no_depth_and_no_item():
    view = Renderer(make_house(box((-1, 30, 0), (1, 31, 2), WHITE)), 80, 60).render(AHEAD)
    assert view.depth_m[0, 0] == 0
    assert not view.instance.any()
    assert (view.depth_m > 0).any()


def test_instance_is_the_item_id_plus_one_and_the_nearer_item_hides_the_farther():
    items = (place(0, 0, 4), place(1, 0, 2), place(2, 0, -2), place(3, 1.5, 4))
    view = Renderer(make_house(box((-9, 6, 0), (9, 6.2, 3), WHITE), items=items), 160, 120).render(AHEAD)
    assert view.instance[60, 80] == 2  # item 1 stands before item 0
    assert sorted(set(view.instance.ravel().tolist())) == [0, 2, 4]
    assert view.depth_m[60, 80] == pytest.approx(1.8, abs=1e-5)
    assert view.depth_m[60, 2] == pytest.approx(6.0, abs=1e-5)


def test_yaw_turns_the_front_of_an_item():
    front = Item("tv", (block((0, 0, 0), (1, 0.1, 2), Material((20, 20, 200))),
                        block((0, -0.06, 0), (1, 0.01, 2), Material((200, 20, 20)))))  # fmt: skip
    for yaw, red in ((0.0, True), (np.pi, False)):
        house = make_house(items=(PlacedItem(0, front, 0, 2, 0, yaw, 0),))
        color = Renderer(house, 80, 60).render(AHEAD).color[30, 40].astype(int)
        assert (color[0] > color[2]) == red


def test_equal_houses_give_equal_bytes_and_the_seed_changes_the_light():
    parts = (box((-3, 3, 0), (3, 3.2, 2.5), Material((180, 90, 70), "bricks", gloss=0.5)),)
    items = (place(0, 0.5, 2, texture="fabric", second=(90, 30, 20)),)
    views = [Renderer(make_house(*parts, items=items, seed=s), 96, 72).render(AHEAD) for s in (1, 1, 2)]
    for name in ("color", "depth_m", "instance", "shine"):
        assert getattr(views[0], name).tobytes() == getattr(views[1], name).tobytes()
    assert (views[0].color != views[2].color).any()
    assert (views[0].depth_m == views[2].depth_m).all()


def test_a_frame_does_not_depend_on_those_before_it():
    renderer = Renderer(make_house(box((-3, 3, 0), (3, 3.2, 2.5), WHITE)), 80, 60)
    first, elsewhere = renderer.render(AHEAD), AHEAD.copy()
    elsewhere[0, 3] = 1
    renderer.render(elsewhere)
    assert (renderer.render(AHEAD).color == first.color).all()


def test_faces_hit_from_behind_are_lit():
    sheet = Part(
        np.array([[-2.0, 2, 0], [2, 2, 0], [2, 2, 2], [-2, 2, 2]]), np.array([[0, 2, 1], [0, 3, 2]], np.int32), WHITE
    )
    color = Renderer(make_house(sheet), 80, 60).render(AHEAD).color
    assert color[30, 40].min() > 50


def test_what_glows_is_brighter_than_what_is_lit():
    items = (place(0, -0.5, 2), place(1, 0.5, 2, glow=1.0))
    view = Renderer(make_house(items=items), 160, 120).render(AHEAD)
    lit, glowing = (view.color[view.instance == k].mean() for k in (1, 2))
    assert glowing > 1.15 * lit
    assert set(view.shine[view.instance == 2].tolist()) == {255}


def test_light_is_less_under_a_table_than_beside_it():
    table = Item("table", (block((0, 0, 0.7), (1.4, 1.0, 0.04), WHITE),))
    house = make_house(box((-4, -4, -0.1), (4, 4, 0), WHITE), items=(PlacedItem(0, table, 0, 1, 0, 0, 0),))
    pose = AHEAD.copy()
    pose[:3, 3] = (0, -1.5, 0.4)
    view = Renderer(house, 160, 120).render(pose)
    fx, _, _, cy = Renderer(house, 160, 120).intrinsics
    row_under, row_before = round(cy + fx * 0.4 / 2.5), round(cy + fx * 0.4 / 1.4)
    assert view.instance[row_under, 80] == view.instance[row_before, 80] == 0
    assert view.color[row_under, 80].mean() < 0.85 * view.color[row_before, 80].mean()


def test_a_wall_keeps_the_lamp_of_the_next_room_out_and_no_lamp_at_all_is_dim_but_not_black():
    wall = box((-9, 3, -1), (9, 3.1, 9), WHITE)  # the lamp is on this side of it
    beyond = AHEAD.copy()
    beyond[:3, :3] = beyond[:3, :3] @ np.diag([-1.0, 1, -1])
    beyond[1, 3] = 5
    house = make_house(wall)
    near, far = (Renderer(house, 64, 48).render(pose).color.mean() for pose in (AHEAD, beyond))
    unlit = Renderer(dataclasses.replace(house, lights=()), 64, 48).render(AHEAD).color.mean()
    assert 40 < far < 0.85 * near
    assert unlit == pytest.approx(far, rel=0.1)


def test_a_picture_hangs_upright_and_unmirrored():
    paint = Material((62, 124, 66), "picture", (48, 84, 158), 0.0, 4)
    canvas = PlacedItem(0, Item("picture", (block((0, 0, 0), (2, 0.02, 2), paint),)), 0, 1.0, 0, 0, 0)
    view = Renderer(make_house(items=(canvas,)), 400, 400).render(AHEAD)
    middle = np.flatnonzero(view.instance[200])
    assert len(middle) == 400  # nearer than its edges: the middle 1.35 m of 2 m are seen
    fx = 400 / 2 / np.tan(0.6)
    share = 0.99 * 400 / fx / 2
    cut = np.linspace(64 - 64 * share, 64 + 64 * share, 400, dtype=np.float32)
    expected = cv2.remap(tile(paint), *np.meshgrid(cut, cut), cv2.INTER_LINEAR).astype(float)

    def likeness(other: np.ndarray) -> float:
        return float(np.corrcoef(view.color.astype(float).ravel(), other.ravel())[0, 1])

    assert likeness(expected) > 0.95
    assert max(likeness(expected[:, ::-1]), likeness(expected[::-1])) < 0.8


@pytest.mark.parametrize(("low", "high"), [((0, 0, 0), (2, 0.5, 0.02)), ((0, 0, 0), (0.02, 0.5, 2))])
def test_the_grain_of_wood_runs_along_a_board(low, high):
    board = box(low, high, Material((150, 100, 60), "wood", scale_m=0.5))
    uv, texels_per_m = box_uv_mapping(board.vertices[board.faces], board.material)
    widest = np.ptp(uv, axis=1).max(axis=0)
    assert widest[0] == pytest.approx(4) and widest[1] <= 1.01
    assert set(texels_per_m.tolist()) == {256.0}


@pytest.mark.parametrize("texture", TEXTURES)
def test_every_texture_is_deterministic_and_shows_its_color(texture):
    one, other = (tile(Material((150, 100, 60), texture, (60, 80, 120), 0.5, seed)) for seed in (1, 2))
    assert one.shape == (128, 128, 3) and one.dtype == np.uint8
    assert (one == tile(Material((150, 100, 60), texture, (60, 80, 120), 0.5, 1))).all()
    assert (texture in ("plain", "grille", "checks")) or (one != other).any()


def test_the_atlas_holds_more_materials_than_fit_below_each_other():
    plain = [Material((k % 256, k // 256, 7)) for k in range(1200)]
    stripes = [Material((k, 0, 0), "stripes", (0, k, 0), seed=k) for k in range(250)]
    made = atlas([*plain, *stripes])
    assert max(made.image.shape[:2]) < 32768
    for k, one in enumerate([*plain, *stripes]):
        x, y = np.ceil(made.origins_px[k]).astype(int)
        assert tuple(made.image[y, x]) == tuple(tile(one)[0, 0])


def test_what_cannot_be_rendered_is_refused():
    with pytest.raises(ConfigError, match="neither structure nor items"):
        Renderer(make_house())
    with pytest.raises(ConfigError, match="velvet"):
        Renderer(make_house(box((0, 0, 0), (1, 1, 1), Material((9, 9, 9), "velvet"))))
    with pytest.raises(ConfigError, match="px over"):
        Renderer(make_house(box((0, 0, 0), (1, 1, 1), WHITE)), 0, 480)
    renderer = Renderer(make_house(box((0, 0, 0), (1, 1, 1), WHITE)), 16, 16)
    with pytest.raises(ConfigError, match="finite"):
        renderer.render(np.full((4, 4), np.nan))
