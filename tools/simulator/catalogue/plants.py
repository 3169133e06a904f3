"""Plants and flowers: potted plants from the window sill's to the floor's, vases with and without flowers."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, chance, drawn, fitted, loft, merged
from placegraph.tools.simulator.color_palette import COLORS, VIVID, darker, jitter, pick
from placegraph.tools.simulator.house_model import Color, Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import Point, block, cylinder, ellipsoid, lathe, moved, tube

_GREENS: tuple[Color, ...] = ((52, 112, 48), (84, 140, 58), (38, 88, 52), (112, 150, 70))
_TERRACOTTA: Color = (176, 96, 62)
_SOIL = Material((58, 42, 32), "noise", (38, 28, 22), 0.05)
_VASES = (  # (radius, height) from foot to mouth, as shares of the widest radius and the height
    ((0.55, 0), (0.9, 0.18), (1.0, 0.42), (0.62, 0.72), (0.36, 0.86), (0.52, 1)),
    ((0.5, 0), (0.55, 0.05), (0.66, 0.4), (0.8, 0.75), (1.0, 1)),
    ((0.62, 0), (1.0, 0.3), (0.92, 0.5), (0.3, 0.66), (0.26, 0.92), (0.4, 1)),
    ((0.8, 0), (0.86, 0.5), (0.84, 0.92), (1.0, 1)),
    ((0.42, 0), (0.34, 0.08), (0.86, 0.55), (1.0, 0.78), (0.7, 0.92), (0.74, 1)),
)


def blade(
    base: Point, yaw: float, length_m: float, width_m: float, bend: tuple[float, float], material: Material
) -> Part:
    """A leaf from `base` toward `yaw`; `bend` is its elevation at the root and how far it droops, in radians."""
    out, side = np.array([np.cos(yaw), np.sin(yaw), 0.0]), np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    point, rings = np.array(base, float), []
    shares = (0.25, 0.9, 1.0, 0.7, 0.05)
    for k, share in enumerate(shares):
        lift = bend[0] - bend[1] * k / (len(shares) - 1)
        way, roof = out * np.cos(lift) + up * np.sin(lift), up * np.cos(lift) - out * np.sin(lift)
        half = share * width_m / 2
        rings.append([point + side * half, point + roof * half * 0.35, point - side * half])
        point = point + way * length_m / (len(shares) - 1)
    return loft(np.array(rings), material)


def _pot(random: Random, radius_m: float, height_m: float) -> list[Part]:
    kind = int(random.integers(4))
    if kind == 0:
        clay = Material(jitter(_TERRACOTTA, random), "noise", darker(_TERRACOTTA, 0.85), 0.1)
        rim = cylinder((0, 0, height_m * 0.8), radius_m, height_m * 0.2, clay, sides=14)
        pot = [cylinder((0, 0, 0), radius_m * 0.66, height_m * 0.82, clay, radius_m * 0.92, sides=14), rim]
    elif kind == 1:
        straw = Material(jitter((186, 150, 100), random), "checks", (140, 106, 64), 0.05)
        pot = [cylinder((0, 0, 0), radius_m * 0.84, height_m, straw, radius_m, sides=14)]
    elif kind == 2:
        _, color = pick(random, ("white", "black", "gray", "blue", "beige"))
        glaze = Material(color, gloss=0.4)
        profile = [(0, 0), (0.6, 0), (0.95, 0.3), (1.0, 0.6), (0.85, 1), (0, 1)]
        pot = [lathe([(r * radius_m, z * height_m) for r, z in profile], glaze, sides=14)]
    else:
        _, color = pick(random, ("white", "black", "gray", "brown", "yellow"))
        size = (radius_m * 1.7, radius_m * 1.7, height_m)
        pot = [block((0, 0, 0), size, Material(color, "plain", gloss=0.2))]
    return [*pot, cylinder((0, 0, height_m), radius_m * 0.8, 0.008, _SOIL, sides=12)]


def _sword_leaves(random: Random, greens: list[Material], base_m: float, tall_m: float) -> list[Part]:
    leaves = []
    for k in range(int(random.integers(7, 10) if tall_m < 0.35 else random.integers(9, 14))):
        yaw, out = random.uniform(0, 2 * np.pi), tall_m * 0.06
        root = (out * float(np.cos(yaw)), out * float(np.sin(yaw)), base_m)
        size = tall_m * random.uniform(0.55, 1.0), max(tall_m * 0.1, 0.02)
        leaves.append(blade(root, yaw, *size, (random.uniform(1.2, 1.55), random.uniform(-0.1, 0.2)), greens[k % 2]))
    return leaves


def _palm_leaves(random: Random, greens: list[Material], base_m: float, tall_m: float) -> list[Part]:
    leaves, count = [], int(random.integers(10, 13) if tall_m < 0.35 else random.integers(16, 24))
    for k in range(count):
        yaw = 2.4 * k + random.uniform(-0.3, 0.3)
        bend = random.uniform(0.9, 1.5), random.uniform(1.0, 1.9)
        leaves.append(
            blade((0, 0, base_m), yaw, tall_m * random.uniform(0.75, 1.1), tall_m * 0.14, bend, greens[k % 2])
        )
    return leaves


def _broad_leaves(random: Random, greens: list[Material], base_m: float, tall_m: float) -> list[Part]:
    bark = Material((92, 104, 52))
    parts = [tube([(0, 0, base_m), (0.02 * tall_m, 0, base_m + 0.92 * tall_m)], 0.018 * tall_m, bark, sides=5)]
    for k in range(int(random.integers(9, 12) if tall_m < 0.35 else random.integers(14, 20))):
        z = base_m + tall_m * float(random.uniform(0.12, 0.9))
        length = tall_m * random.uniform(0.26, 0.4)
        bend = random.uniform(0.2, 0.9), random.uniform(0.6, 1.2)
        parts.append(blade((0, 0, z), 2.4 * k, length, length * random.uniform(0.5, 0.7), bend, greens[k % 2]))
    return parts


def _crown(random: Random, greens: list[Material], base_m: float, tall_m: float) -> list[Part]:
    bark = Material((96, 70, 48), "noise", (70, 50, 34), 0.05)
    trunk = tall_m * random.uniform(0.3, 0.6)
    parts = [tube([(0, 0, base_m), (0, 0, base_m + trunk)], 0.025 * tall_m + 0.004, bark, sides=6)]
    for k in range(6):
        yaw, out = 1.05 * k, (tall_m - trunk) * random.uniform(0.15, 0.35)
        at = (out * float(np.cos(yaw)), out * float(np.sin(yaw)), base_m + trunk + (tall_m - trunk) * (0.25 + 0.09 * k))
        size = (tall_m - trunk) * float(random.uniform(0.3, 0.42))
        parts.append(ellipsoid(at, (size, size, size * 0.8), greens[k % 2], sides=8))
    for k in range(10):
        at = (0.0, 0.0, base_m + trunk + (tall_m - trunk) * float(random.uniform(0.1, 0.6)))
        parts.append(blade(at, 2.4 * k, (tall_m - trunk) * 0.75, tall_m * 0.09, (0.6, 0.6), greens[k % 2]))
    return parts


def _cactus(random: Random, greens: list[Material], base_m: float, tall_m: float) -> list[Part]:
    skin = Material(greens[0].color, "stripes", darker(greens[0].color, 1.35), 0.03)
    thick = tall_m * float(random.uniform(0.13, 0.2))
    parts = [ellipsoid((0, 0, base_m + tall_m * 0.48), (thick, thick, tall_m * 0.52), skin, sides=10)]
    for side, share in ((-1, random.uniform(0.3, 0.5)), (1, random.uniform(0.4, 0.6))):
        z, out = base_m + tall_m * float(share), side * tall_m * 0.27
        path: list[Point] = [(0, 0, z), (out, 0, z), (out, 0, z + tall_m * 0.3)]
        parts.append(tube(path, thick * 0.5, skin, sides=7))
        parts.append(ellipsoid(path[-1], (thick * 0.5, thick * 0.5, thick * 0.5), skin, sides=7))
    bloom = Material(pick(random, ("pink", "red", "yellow"))[1])
    return [*parts, ellipsoid((0, 0, base_m + tall_m), (thick * 0.4, thick * 0.4, thick * 0.3), bloom, sides=6)]


def potted_plant(random: Random, wanted: WantedSize) -> Item:
    """A plant in its pot: swords, palm, broad leaves or a small tree, for small ones also a cactus."""
    sill = chance(random, 0.45)
    height = drawn(random, wanted.height_m, *((0.22, 0.45) if sill else (0.7, 1.4)))
    pot = height * float(random.uniform(0.3, 0.42) if height < 0.5 else random.uniform(0.2, 0.32))
    colors = [jitter(_GREENS[int(k)], random) for k in random.permutation(len(_GREENS))[:2]]
    greens = [Material(color, "leaves", darker(color, 0.6), max(0.06, height * 0.12)) for color in colors]
    kinds = [_sword_leaves, _palm_leaves, _broad_leaves, _crown] + ([_cactus] if height < 0.5 else [])
    parts = kinds[int(random.integers(len(kinds)))](random, greens, pot, height - pot)
    reach = max(float(np.abs(part.vertices[:, :2]).max()) for part in parts)
    slim = np.array([*[min(1.0, 0.45 * height / reach)] * 2, 1.0])  # no wider than a room has space for
    parts = [Part(part.vertices * slim, part.faces, part.material) for part in parts]
    foliage = [merged(group) for material in greens if (group := [p for p in parts if p.material is material])]
    stems = [part for part in parts if part.material not in greens]
    potted = [*_pot(random, pot * float(random.uniform(0.5, 0.65)), pot), *stems, *foliage]
    return fitted("potted plant", potted, (wanted.width_m, wanted.depth_m, height), "green")


def _flowers(random: Random, mouth_m: float, reach_m: float) -> list[Part]:
    stems, leaves, petals, hearts = [], [], [], []
    _, color = pick(random, ("red", "orange", "yellow", "purple", "pink", "white"))
    stalk, petal, heart = Material((70, 116, 54)), Material(color), Material(jitter(COLORS["yellow"], random))
    for k in range(int(random.integers(4, 7))):
        yaw, tilt = 2.4 * k, float(random.uniform(0.1, 0.5))
        way = np.array([np.cos(yaw) * np.sin(tilt), np.sin(yaw) * np.sin(tilt), np.cos(tilt)])
        root, length = np.array([0, 0, mouth_m * 0.7]), reach_m * random.uniform(0.8, 1.15)
        x, y, z = (root + way * length).tolist()
        stems.append(tube([(0, 0, mouth_m * 0.7), (x, y, z)], 0.004, stalk, sides=3))
        size = reach_m * float(random.uniform(0.13, 0.19))
        petals.append(moved(lathe([(0, -size * 0.6), (size, size * 0.1), (0, size * 0.25)], petal, sides=7), (x, y, z)))
        hearts.append(moved(lathe([(size * 0.35, 0.12 * size), (0, size * 0.5)], heart, sides=5), (x, y, z)))
        if k % 2:
            leaves.append(blade((0, 0, mouth_m), yaw + 1, length * 0.5, 0.03, (1.0, 0.8), stalk))
    return [merged(group) for group in (stems + leaves, petals, hearts)]


def vase(random: Random, wanted: WantedSize) -> Item:
    """A vase of one of five outlines, plain, striped or marbled, in most cases with flowers."""
    height = drawn(random, wanted.height_m, 0.2, 0.5)
    full = chance(random, 0.55)
    body = height * (0.55 if full else 1.0)
    profile = _VASES[int(random.integers(len(_VASES)))]
    widest = body * float(random.uniform(0.22, 0.36))
    name, color = pick(random, (*VIVID, "white", "black", "gray", "beige"))
    texture = str(random.choice(["plain", "plain", "stripes", "marble", "noise"]))
    glaze = Material(color, texture, darker(color, 0.55), 0.06, int(random.integers(1000)), gloss=0.5)
    outer = [(r * widest, z * body) for r, z in profile]
    (neck, neck_z), mouth = outer[-2], outer[-1][0] * 0.92
    inside = Material((40, 36, 34))
    parts = [
        lathe([(0, 0), *outer, (mouth, body)], glaze, sides=12),
        lathe([(mouth, body), (neck * 0.92, neck_z), (0, neck_z)], inside, sides=12),
    ]
    if full:
        parts += _flowers(random, body, height - body)
    return fitted("vase", parts, (wanted.width_m, wanted.depth_m, height), name)


DESIGNS = {"potted plant": potted_plant, "vase": vase}
