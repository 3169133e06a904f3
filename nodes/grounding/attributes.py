"""Colour and size words, and how well an object fits them."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.scene_graph import Node

# sRGB of the eleven basic colour terms (Berlin and Kay) and beige, as in CSS but for brown, green and pink,
# which in homes are duller than their CSS namesakes.
BASIC_COLORS: dict[str, tuple[int, int, int]] = {
    "black": (20, 20, 20), "white": (240, 240, 240), "gray": (128, 128, 128), "red": (190, 30, 35),
    "green": (40, 130, 50), "blue": (40, 70, 180), "yellow": (235, 215, 40), "orange": (240, 140, 30),
    "brown": (115, 75, 40), "pink": (235, 150, 175), "purple": (120, 50, 140), "beige": (220, 205, 170),
}  # fmt: skip
COLORS = {name: name for name in BASIC_COLORS} | {
    "grey": "gray",
    "violet": "purple",
    "golden": "yellow",
    "tan": "beige",
}
SIZES = {"big": "large", "large": "large", "huge": "large", "small": "small", "little": "small", "tiny": "small"}
COLOR_FALLOFF = 30.0  # departs: CIELAB distance at which a colour's fit falls to 1/e; a median under room light is dull
UNKNOWN_FIT = 0.5  # an object whose colour was not seen neither fits nor fails


def color_fit(node: Node, color: str) -> float:
    """How well an object's median colour is called `color`, 0..1: 1 when that is the nearest of the basic terms."""
    if color in {word for tag in node.tags for word in tag.name.lower().split()}:
        return 1.0
    if len(node.color) != 3:
        return UNKNOWN_FIT
    seen = _lab([node.color])[0]
    names = list(BASIC_COLORS)
    distances = np.linalg.norm(_lab(list(BASIC_COLORS.values())) - seen, axis=1)
    excess = float(distances[names.index(color)] - distances.min())
    return float(np.exp(-excess / COLOR_FALLOFF))


def size_fit(nodes: Sequence[Node], size: str) -> list[float]:
    """How well each of the nodes is called large or small among them, 0..1: its rank by volume."""
    if len(nodes) < 2:
        return [1.0] * len(nodes)
    volumes = [float(np.prod(np.maximum(np.ptp(node.box, axis=0), 0.01))) for node in nodes]
    below = [sum(other < volume for other in volumes) / (len(volumes) - 1) for volume in volumes]
    return [0.5 + 0.5 * (share if size == "large" else 1 - share) for share in below]


def _lab(colors: Sequence[tuple[int, ...]]) -> NDArray[np.float64]:
    pixels = np.asarray(colors, np.float32).reshape(1, -1, 3) / 255
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2Lab)[0], np.float64)
