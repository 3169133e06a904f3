"""Soft and round things: pillows, teddy bears and balls."""

from __future__ import annotations

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, chance, drawn, fitted, hoop
from placegraph.tools.simulator.color_palette import COLORS, MUTED, VIVID, darker, jitter, pick
from placegraph.tools.simulator.house_model import Color, Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import block, ellipsoid, grid_faces, moved, turned

_FURS: dict[str, Color] = {"brown": (122, 80, 48), "light brown": (178, 132, 84), "beige": (212, 190, 154),
                           "gray": (140, 138, 136), "white": (228, 222, 212), "pink": (220, 156, 172)}  # fmt: skip


def _puffed(width_m: float, depth_m: float, height_m: float, material: Material, count: int = 9) -> Part:
    """A lying cushion: thick in the middle, thin at its seam, its sides drawn in a little between the corners."""
    line = np.linspace(-1, 1, count)
    u, v = (grid.reshape(-1) for grid in np.meshgrid(line, line, indexing="xy"))
    x, y = u * (1 - 0.08 * (1 - v**2)), v * (1 - 0.08 * (1 - u**2))
    bulge = np.sqrt(np.clip((1 - u**4) * (1 - v**4), 0, None)) * height_m / 2
    sheet = np.stack((x * width_m / 2, y * depth_m / 2, bulge), axis=1)
    upper = grid_faces(count, count)
    vertices = np.concatenate((sheet, sheet * np.array([1, 1, -1])))
    return Part(vertices, np.concatenate((upper, upper[:, ::-1] + len(sheet))), material)


def pillow(random: Random, wanted: WantedSize) -> Item:
    """A bed pillow or a square cushion, lying; one that is given taller than deep stands on its edge."""
    bed = chance(random, 0.35)
    width = drawn(random, wanted.width_m, *((0.55, 0.75) if bed else (0.38, 0.5)))
    depth = drawn(random, wanted.depth_m, 0.36, 0.45) if bed else (width if wanted.depth_m is None else wanted.depth_m)
    height = drawn(random, wanted.height_m, 0.12, 0.18)
    name, color = pick(random, ("white", "white", "beige", "blue", "gray") if bed else (*VIVID, *MUTED))
    texture = str(random.choice(["plain", "fabric"] if bed else ["fabric", "stripes", "checks", "plain"]))
    second = darker(color, 0.8) if texture == "fabric" else pick(random, MUTED)[1]
    cloth = Material(color, texture, second, float(random.uniform(0.06, 0.3)), int(random.integers(1000)))
    if height > depth:
        cushion = turned(_puffed(width, height, depth, cloth), np.pi / 2, "x")
    else:
        cushion = _puffed(width, depth, height, cloth)
    parts = [cushion]
    if not bed and height <= depth:
        button = Material(darker(color, 0.5))
        parts.append(ellipsoid((0, 0, height / 2), (0.016, 0.016, 0.006), button, sides=6))
    return fitted("pillow", parts, (width, depth, height), name)


def teddy_bear(random: Random, wanted: WantedSize) -> Item:
    """A sitting bear with round ears, a pale muzzle, legs stretched to the front, often a bow or a shirt."""
    name = str(random.choice(list(_FURS)))
    fur = Material(jitter(_FURS[name], random), "noise", darker(_FURS[name], 0.8), 0.03)
    pale = Material(darker(fur.color, 1.3) if name != "white" else (206, 176, 150))
    dark = Material((28, 24, 24), gloss=0.6)
    shirt = Material(pick(random, VIVID)[1], "stripes", (236, 234, 228), 0.05) if chance(random, 0.35) else fur
    s, belly = drawn(random, wanted.height_m, 0.22, 0.5) / 0.96, float(random.uniform(0.2, 0.26))
    parts = [ellipsoid((0, 0, 0.3), (belly, 0.19, 0.3), shirt, sides=10)]
    parts += [ellipsoid((0, -0.01, 0.7), (0.2, 0.18, 0.19), fur, sides=10)]
    parts += [ellipsoid((0, -0.17, 0.65), (0.09, 0.07, 0.07), pale, sides=7)]
    parts += [block((0, -0.25, 0.665), (0.05, 0.03, 0.035), dark)]
    spread = float(random.uniform(0.3, 0.7))
    for side in (-1, 1):
        parts.append(ellipsoid((side * 0.16, 0.02, 0.87), (0.085, 0.045, 0.085), fur, sides=6))
        parts.append(block((side * 0.075, -0.185, 0.735), (0.035, 0.03, 0.035), dark))
        arm = ellipsoid((side * 0.23, 0, 0.36), (0.07, 0.08, 0.2), shirt, sides=6)
        parts.append(turned(arm, -side * spread, "y", (side * 0.2, 0, 0.5)))
        leg = [ellipsoid((side * 0.12, -0.28, 0.09), (0.095, 0.23, 0.09), fur, sides=6)]
        leg.append(ellipsoid((side * 0.12, -0.49, 0.11), (0.085, 0.04, 0.1), pale, sides=5))
        parts += [turned(part, side * spread * 0.5, "z", (side * 0.12, 0, 0)) for part in leg]
    if chance(random, 0.5):
        bow = Material(pick(random, VIVID)[1])
        for side in (-1, 1):
            parts.append(ellipsoid((side * 0.07, -0.19, 0.53), (0.075, 0.025, 0.045), bow, sides=4))
    scaled = [Part(part.vertices * s, part.faces, part.material) for part in parts]
    return fitted("teddy bear", scaled, wanted, name)


def _icosahedron() -> F64:
    golden = (1 + 5**0.5) / 2
    corners = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            corners += [(0, a, b), (a, b, 0), (b, 0, a)]
    return np.asarray(np.array(corners) / np.hypot(1, golden))


def _fan(ring: F64) -> tuple[F64, list[tuple[int, int, int]]]:
    """A ring (N, 3) on the unit sphere as a fan about its middle, which is raised to the sphere; faces outward."""
    middle = ring.mean(axis=0) / np.linalg.norm(ring.mean(axis=0))
    side = np.cross(middle, (0.31, 0.52, 0.8))
    angles = np.arctan2(ring @ np.cross(middle, side), ring @ side)
    count = len(ring)
    return np.concatenate((ring[np.argsort(angles)], middle[None])), [(i, (i + 1) % count, count) for i in range(count)]


def _patches(rings: list[F64], radius_m: float, material: Material) -> Part:
    vertices: list[F64] = []
    faces: list[tuple[int, ...]] = []
    for ring in rings:
        start = sum(len(points_before) for points_before in vertices)
        points, fan = _fan(ring / np.linalg.norm(ring, axis=1, keepdims=True))
        vertices.append(points)
        faces += [tuple(i + start for i in face) for face in fan]
    return Part(np.concatenate(vertices) * radius_m, np.array(faces, np.int32), material)


def _football(random: Random, radius_m: float) -> tuple[str, list[Part]]:
    """Twelve dark pentagons and twenty light hexagons: a third of each edge belongs to each of its ends."""
    corners = _icosahedron()
    near = corners @ corners.T > 0.4
    edge = {(i, j): (2 * corners[i] + corners[j]) / 3 for i in range(12) for j in range(12) if i != j and near[i, j]}
    pentagons = [np.array([edge[i, j] for j in range(12) if (i, j) in edge]) for i in range(12)]
    hexagons = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                if near[i, j] and near[j, k] and near[i, k]:
                    pairs = [(i, j), (j, i), (j, k), (k, j), (k, i), (i, k)]
                    hexagons.append(np.array([edge[pair] for pair in pairs]))
    _, dark = pick(random, ("black", "black", "blue", "red"))
    light = Material(jitter(COLORS["white"], random, 5), gloss=0.3)
    return "white", [_patches(pentagons, radius_m, Material(dark, gloss=0.3)), _patches(hexagons, radius_m, light)]


def _basketball(random: Random, radius_m: float) -> tuple[str, list[Part]]:
    skin = Material(jitter((206, 108, 46), random), "noise", (178, 88, 36), 0.02)
    seam = Material((36, 28, 26))
    parts = [ellipsoid((0, 0, 0), (radius_m, radius_m, radius_m), skin, sides=14)]
    ring = hoop((0, 0, 0), radius_m, radius_m * 0.02, seam, 16, 3)
    return "orange", [turned(part, random.uniform(0, 1), "z") for part in (*parts, ring, turned(ring, np.pi / 2, "z"))]


def _beach_ball(random: Random, radius_m: float) -> tuple[str, list[Part]]:
    """Six lunes of three colours."""
    names = [str(name) for name in random.permutation(list(VIVID))[:2]]
    colors = [COLORS["white"], *(jitter(COLORS[name], random) for name in names)]
    globe = ellipsoid((0, 0, 0), (radius_m, radius_m, radius_m), Material(colors[0]), sides=18)
    centers = globe.vertices[globe.faces].mean(axis=1)
    lune = np.floor((np.arctan2(centers[:, 1], centers[:, 0]) + np.pi) / (2 * np.pi) * 6).astype(int) % 3
    lean = float(random.uniform(0.3, 1.2))
    parts = [Part(globe.vertices, globe.faces[lune == k], Material(colors[k], gloss=0.5)) for k in range(3)]
    return "", [turned(part, lean, "x") for part in parts]


def ball(random: Random, wanted: WantedSize) -> Item:
    """A football, a basketball or a beach ball; one size that is given holds for all three."""
    size = drawn(random, next((size_m for size_m in wanted if size_m is not None), None), 0.19, 0.26)
    kinds = (_football, _football, _basketball, _beach_ball)
    name, parts = kinds[int(random.integers(len(kinds)))](random, size / 2)
    turn = float(random.uniform(0, 2 * np.pi))
    parts = [moved(turned(part, turn, "z"), (0, 0, size / 2)) for part in parts]
    return fitted("ball", parts, (wanted.width_m or size, wanted.depth_m or size, wanted.height_m or size), name)


DESIGNS = {"pillow": pillow, "teddy bear": teddy_bear, "ball": ball}
