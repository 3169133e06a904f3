"""Colours by the words that people use for them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.tools.simulator.house_model import Color

COLORS: dict[str, Color] = {
    "white": (236, 234, 228),
    "black": (34, 33, 36),
    "gray": (128, 130, 132),
    "red": (186, 42, 38),
    "orange": (222, 124, 38),
    "yellow": (230, 196, 62),
    "green": (62, 124, 66),
    "blue": (48, 84, 158),
    "purple": (112, 66, 138),
    "pink": (224, 142, 168),
    "brown": (112, 72, 44),
    "beige": (206, 186, 150),
}
WOODS: dict[str, Color] = {
    "white": (226, 224, 218),
    "black": (48, 42, 40),
    "brown": (104, 66, 40),
    "light brown": (176, 132, 86),
    "beige": (204, 176, 134),
}
METALS: dict[str, Color] = {"gray": (150, 152, 156), "black": (44, 44, 48), "white": (228, 228, 230)}
VIVID = ("red", "orange", "yellow", "green", "blue", "purple", "pink")
MUTED = ("white", "black", "gray", "brown", "beige", "blue", "green")


def jitter(color: Color, random: np.random.Generator, sigma: float = 9.0) -> Color:
    """A similar colour: brightness and hue vary, the colour word stays true."""
    shift = random.normal(0, sigma) + random.normal(0, sigma / 3, 3)
    r, g, b = np.clip(np.round(np.array(color) + shift), 6, 249).astype(int).tolist()
    return (r, g, b)


def pick(
    random: np.random.Generator, names: Sequence[str] = MUTED, colors: dict[str, Color] | None = None
) -> tuple[str, Color]:
    """One of the named colours, slightly varied: its word and sRGB value."""
    table = COLORS if colors is None else colors
    name = str(random.choice(list(names)))
    return name, jitter(table[name], random)


def darker(color: Color, share: float = 0.7) -> Color:
    """The same hue scaled in brightness: darker for a share below 1, lighter above."""
    r, g, b = np.clip(np.array(color) * share, 0, 255).astype(int).tolist()
    return (r, g, b)
