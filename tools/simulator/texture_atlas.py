"""Procedural textures: each material is painted into a small tile, and all tiles are packed in one atlas image.

Every tile is stored at six sizes (mipmaps) with a border of one pixel, so that one bilinear lookup of the whole frame
in the atlas reads the right material everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import F32, F64, I64, U8, Bool
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.house_model import TEXTURES, Color, Material

TILE_PX = 128
LEVELS = 6  # 128, 64, 32, 16, 8, 4 px
LEVEL_SIZES_PX = np.array([TILE_PX >> level for level in range(LEVELS)], np.float32)
LEVEL_LEFT_PX = np.array([sum((TILE_PX >> k) + 2 for k in range(level)) for level in range(LEVELS)], np.float32)
_CELL_WIDTH_PX = int(sum(LEVEL_SIZES_PX)) + 2 * LEVELS
_CELL_HEIGHT_PX = TILE_PX + 2
_ROWS = 240  # atlas rows: cv2.remap reads no coordinate beyond 32767
_PLAIN_PX = 3  # a plain material needs no more than one pixel and its neighbours

_V, _U = np.meshgrid((np.arange(TILE_PX) + 0.5) / TILE_PX, (np.arange(TILE_PX) + 0.5) / TILE_PX, indexing="ij")
_SPINES: tuple[Color, ...] = (
    (146, 44, 40), (40, 62, 112), (48, 92, 62), (196, 168, 108), (222, 214, 196), (58, 52, 54), (186, 112, 52),
    (92, 52, 88), (70, 122, 138), (204, 186, 60), (120, 84, 58), (168, 60, 88),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Atlas:
    """All tiles (H, W, 3) uint8 sRGB, and (M, 2) float32 pixel (x, y) of each material's texture origin in it."""

    image: U8
    origins_px: F32


def _tileable_noise(random: np.random.Generator, across: int, down: int) -> F64:
    """(128, 128) smooth noise that repeats at the borders, about -1..1, with `across` x `down` bumps."""
    coarse = np.pad(random.uniform(-1, 1, (down, across)), 2, mode="wrap")
    step_x, step_y = TILE_PX / across, TILE_PX / down
    x = (np.arange(TILE_PX, dtype=np.float32) + 0.5) / step_x + 1.5
    y = (np.arange(TILE_PX, dtype=np.float32) + 0.5) / step_y + 1.5
    map_x, map_y = np.meshgrid(x, y)
    smooth = cv2.remap(coarse.astype(np.float32), map_x, map_y, cv2.INTER_CUBIC)
    return np.asarray(smooth, np.float64)


def _mix_colors(material: Material, share: F64 | float, light: F64 | float = 0.0) -> F64:
    """The material's two colours mixed by `share` (0 first, 1 second), then lightened by `light` grey levels."""
    base, second = np.array(material.color, float), np.array(material.second, float)
    weight = np.clip(np.broadcast_to(share, (TILE_PX, TILE_PX)), 0, 1)[..., None]
    return np.asarray(base + (second - base) * weight + np.broadcast_to(light, (TILE_PX, TILE_PX))[..., None])


def _joints(count_u: int, count_v: int, width: float, shift: float = 0.0) -> tuple[Bool, I64]:
    """Joints of a running bond: the mask of joints and the block number of each pixel."""
    row = np.floor(_V * count_v).astype(int)
    u = (_U * count_u + shift * row) % count_u
    column = np.floor(u).astype(int)
    near_u = np.minimum(u % 1, 1 - u % 1) / count_u
    near_v = np.minimum(_V * count_v % 1, 1 - _V * count_v % 1) / count_v
    return (near_u < width) | (near_v < width), row * count_u + column


def _noise(material: Material, random: np.random.Generator) -> F64:
    share = 0.15 + 0.3 * _tileable_noise(random, 5, 5) + 0.12 * _tileable_noise(random, 32, 32)
    return _mix_colors(material, share, 4 * _tileable_noise(random, 64, 64))


def _wood(material: Material, random: np.random.Generator) -> F64:
    """Grain along u; a repeat of 0.9 m and more is laid as four planks, like a floor."""
    rings = np.sin(2 * np.pi * (5 * _V + 0.9 * _tileable_noise(random, 2, 3)))
    share = 0.28 + 0.22 * rings + 0.22 * _tileable_noise(random, 3, 40)
    light = 9 * _tileable_noise(random, 2, 64)
    if material.scale_m >= 0.9:
        joints, plank = _joints(2, 4, 0.006, 0.37)
        light = light + random.uniform(-15, 15, 8)[plank] - 38 * joints
    return _mix_colors(material, share, light)


def _fabric(material: Material, random: np.random.Generator) -> F64:
    over, under = np.sin(2 * np.pi * 32 * _U), np.sin(2 * np.pi * 32 * _V)
    weave = np.where((np.floor(_U * 32) + np.floor(_V * 32)) % 2 > 0, np.abs(over), np.abs(under))
    return _mix_colors(
        material,
        0.3 - 0.3 * weave + 0.15 * _tileable_noise(random, 7, 7),
        9 * weave - 5 + 7 * _tileable_noise(random, 64, 64),
    )


def _stripes(material: Material, random: np.random.Generator) -> F64:
    count = int(random.integers(3, 7))
    share = (_U * count) % 1 < random.uniform(0.3, 0.6)
    return _mix_colors(material, share.astype(float), 4 * _tileable_noise(random, 64, 64))


def _checks(material: Material, random: np.random.Generator) -> F64:
    count = int(random.integers(2, 5))
    share = 0.5 * ((_U * count) % 1 < 0.5) + 0.5 * ((_V * count) % 1 < 0.5)
    return _mix_colors(material, share, 4 * _tileable_noise(random, 64, 64))


def _tiles(material: Material, random: np.random.Generator) -> F64:
    joints, block = _joints(2, 2, 0.009)
    return _mix_colors(
        material, joints.astype(float), random.uniform(-7, 7, 4)[block] + 3 * _tileable_noise(random, 24, 24)
    )


def _bricks(material: Material, random: np.random.Generator) -> F64:
    joints, block = _joints(2, 6, 0.012, 0.5)
    light = random.uniform(-22, 18, 12)[block] + 9 * _tileable_noise(random, 40, 40)
    return _mix_colors(material, joints.astype(float), light)


def _marble(material: Material, random: np.random.Generator) -> F64:
    veins = [1 - np.abs(_tileable_noise(random, n, n) + 0.5 * _tileable_noise(random, 2 * n, 2 * n)) for n in (2, 4)]
    return _mix_colors(material, 0.75 * veins[0] ** 9 + 0.4 * veins[1] ** 7, 4 * _tileable_noise(random, 6, 6))


def _leaves(material: Material, random: np.random.Generator) -> F64:
    image = np.ascontiguousarray(_mix_colors(material, 1.0, -25.0))
    for _ in range(150):
        x, y = random.integers(0, TILE_PX, 2).tolist()
        axes, angle = (int(random.integers(8, 15)), int(random.integers(3, 6))), float(random.uniform(0, 180))
        mix = random.uniform(0, 1)
        ink = np.array(material.color) * (1 - mix) + np.array(material.second) * mix + random.uniform(-18, 22)
        for dx in (-TILE_PX, 0, TILE_PX):
            for dy in (-TILE_PX, 0, TILE_PX):
                cv2.ellipse(image, (x + dx, y + dy), axes, angle, 0, 360, ink.tolist(), -1)
                cv2.ellipse(image, (x + dx, y + dy), (axes[0], 0), angle, 0, 360, (ink * 0.8).tolist(), 1)
    return image


def _books(material: Material, random: np.random.Generator) -> F64:
    """Book spines on a dark back; the material's colour is the most frequent spine, `second` the back."""
    image = np.ascontiguousarray(_mix_colors(material, 1.0) * (0.45 + 0.4 * _V[..., None]))
    x = 0
    while x < TILE_PX - 2:
        if random.random() < 0.06:  # a gap between books
            x += int(random.integers(3, 10))
        width, top = int(random.integers(4, 10)), int(random.integers(6, 42))
        choice = int(random.integers(0, len(_SPINES) + 4))
        ink = np.array(_SPINES[choice] if choice < len(_SPINES) else material.color) + random.uniform(-14, 14)
        right = min(x + width, TILE_PX) - 1
        cv2.rectangle(image, (x, top), (right, TILE_PX), ink.tolist(), -1)
        cv2.line(image, (right, top), (right, TILE_PX), (ink * 0.55).tolist(), 1)
        label = 232.0 - ink if random.random() < 0.7 else ink * 0.7
        for y in random.integers(top + 6, TILE_PX - 10, 2).tolist():
            cv2.rectangle(
                image, (x + 1, y), (max(right - 2, x + 1), y + int(random.integers(1, 9))), label.tolist(), -1
            )
        x += width
    return image


def _landscape(material: Material, random: np.random.Generator) -> F64:
    """Sky, sun and hills between the material's two colours."""
    first, second = np.array(material.color, float), np.array(material.second, float)
    sky = np.array([168, 198, 226.0]) * 0.7 + 0.3 * second
    image = np.ascontiguousarray(sky + (1 - _V[..., None]) * random.uniform(-70, 30) + np.zeros(3))
    spot = (int(random.integers(20, 108)), int(random.integers(14, 50)))
    cv2.circle(image, spot, int(random.integers(5, 13)), (250.0, 232.0, 188.0), -1)
    for k in range(4):
        ridge = 0.4 + 0.15 * k + 0.1 * _tileable_noise(random, 2 + k, 1)[0]
        ink = first * (0.25 + 0.25 * k) + second * (0.5 - 0.12 * k) + random.uniform(-26, 26, 3)
        image = np.where((ridge < _V)[..., None], ink + 9 * _tileable_noise(random, 20, 30)[..., None], image)
    return image


def _abstract(material: Material, random: np.random.Generator) -> F64:
    """Fields, discs and bars in the material's two colours and a third that contrasts."""
    image = np.ascontiguousarray(_mix_colors(material, 0.3 + 0.3 * _tileable_noise(random, 3, 3)))
    inks = [np.array(material.second, float), 255.0 - np.array(material.color), random.uniform(20, 240, 3)]
    for _ in range(int(random.integers(5, 12))):
        ink = (inks[int(random.integers(0, 3))] + random.uniform(-20, 20)).tolist()
        x, y = random.integers(0, TILE_PX, 2).tolist()
        w, h = random.integers(8, 60, 2).tolist()
        kind = int(random.integers(0, 3))
        if kind == 0:
            cv2.rectangle(image, (x, y), (x + w, y + h), ink, -1)
        elif kind == 1:
            cv2.circle(image, (x, y), w // 2 + 2, ink, -1)
        else:
            cv2.line(image, (x, y), (x + 2 * w - 60, y + 2 * h - 60), ink, int(random.integers(2, 7)))
    return image + 6 * _tileable_noise(random, 40, 40)[..., None]


def _picture(material: Material, random: np.random.Generator) -> F64:
    """A landscape or an abstract painting, half of them in a white mount."""
    image = _landscape(material, random) if random.random() < 0.5 else _abstract(material, random)
    if random.random() < 0.5:
        outside = np.minimum(np.minimum(_U, 1 - _U), np.minimum(_V, 1 - _V)) < random.uniform(0.06, 0.16)
        image = np.where(outside[..., None], [228.0, 226, 220], image)
    return image


def _screen(material: Material, random: np.random.Generator) -> F64:
    """A dark desktop with windows and lines of text, or a film still, or a dark screen with a faint sheen."""
    kind = random.random()
    if kind < 0.3:
        return _landscape(material, random) * 0.8
    image = np.ascontiguousarray(_mix_colors(material, 0.0, 12 * (_U - _V)))
    if kind > 0.8:
        return image
    cv2.rectangle(image, (0, 0), (TILE_PX, 6), (np.array(material.second) * 0.7).tolist(), -1)
    for _ in range(int(random.integers(2, 5))):
        x, y = random.integers(4, 76, 2).tolist()
        w, h = random.integers(30, 60, 2).tolist()
        paper = float(random.choice([38.0, 70.0, 205.0, 232.0]))
        cv2.rectangle(image, (x, y), (x + w, y + h), (paper, paper, paper + 8), -1)
        cv2.rectangle(image, (x, y), (x + w, y + 4), (np.array(material.second) * 1.0).tolist(), -1)
        for line in range(y + 8, y + h - 2, 4):
            end = x + 3 + int(random.integers(4, w - 4))
            cv2.line(image, (x + 3, line), (end, line), (255 - paper,) * 3, 1)
    return image


def _grille(material: Material, random: np.random.Generator) -> F64:
    slots = ((_V * 8) % 1 > 0.5) & (np.abs(_U - 0.5) < 0.46)
    return _mix_colors(material, slots.astype(float), 3 * _tileable_noise(random, 40, 40))


_PAINTERS: dict[str, Callable[[Material, np.random.Generator], F64]] = {
    "noise": _noise, "wood": _wood, "fabric": _fabric, "stripes": _stripes, "checks": _checks, "tiles": _tiles,
    "bricks": _bricks, "marble": _marble, "leaves": _leaves, "books": _books, "picture": _picture, "screen": _screen,
    "grille": _grille,
}  # fmt: skip


def tile(material: Material) -> U8:
    """The (128, 128, 3) uint8 sRGB image of one repeat; raises ConfigError for an unknown texture."""
    if material.texture == "plain":
        return np.broadcast_to(np.array(material.color, np.uint8), (TILE_PX, TILE_PX, 3)).copy()
    if material.texture not in _PAINTERS:
        raise ConfigError(f"a material has the texture {material.texture!r}; known are {', '.join(TEXTURES)}")
    random = np.random.default_rng([material.seed, TEXTURES.index(material.texture)])
    return np.clip(np.round(_PAINTERS[material.texture](material, random)), 0, 255).astype(np.uint8)


def atlas(materials: Sequence[Material]) -> Atlas:
    """The tiles of all materials in one image; plain materials are a few pixels in the strip at its right."""
    textured = [k for k, material in enumerate(materials) if material.texture != "plain"]
    plain = [k for k, material in enumerate(materials) if material.texture == "plain"]
    columns = -(-len(textured) // _ROWS)
    height = max(min(len(textured), _ROWS) * _CELL_HEIGHT_PX, 128 * _PLAIN_PX)
    per_column = height // _PLAIN_PX
    left = columns * _CELL_WIDTH_PX
    image = np.zeros((height, left + -(-len(plain) // per_column) * _PLAIN_PX, 3), np.uint8)
    origins = np.zeros((len(materials), 2), np.float32)
    for n, k in enumerate(textured):
        x, y = n // _ROWS * _CELL_WIDTH_PX, n % _ROWS * _CELL_HEIGHT_PX
        _place(image, tile(materials[k]), x, y, "wrap" if materials[k].scale_m > 0 else "edge")
        origins[k] = (x + 0.5, y + 0.5)  # u = 0 is the left edge of the first pixel inside the border
    for n, k in enumerate(plain):
        x, y = left + n // per_column * _PLAIN_PX, n % per_column * _PLAIN_PX
        image[y : y + _PLAIN_PX, x : x + _PLAIN_PX] = materials[k].color
        origins[k] = (x + 1, y + 1)
    return Atlas(image, origins)


def _place(image: U8, picture: U8, x: int, y: int, border: str) -> None:
    """Write all sizes of a tile side by side."""
    for level in range(LEVELS):
        size = TILE_PX >> level
        small = cv2.resize(picture, (size, size), interpolation=cv2.INTER_AREA) if level else picture
        bordered = np.pad(small, ((1, 1), (1, 1), (0, 0)), mode="wrap" if border == "wrap" else "edge")
        start = x + int(LEVEL_LEFT_PX[level])
        image[y : y + size + 2, start : start + size + 2] = bordered
