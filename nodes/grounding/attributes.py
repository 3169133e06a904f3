"""How well things fit words for their appearance: colour, size, and words that are found in tags.

Not in the paper. A size word ("big") is judged by the rank among things of the same name. A word that is neither colour
nor size is looked up in the tags; when no tag contains it, it has no effect.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import HOLDS
from placegraph.nodes.grounding.relations.extent import length_m, log_size
from placegraph.nodes.grounding.settings import AppearanceSettings
from placegraph.nodes.grounding.word_lists import word_list, word_table
from placegraph.runtime.arrays import F64, Bool
from placegraph.runtime.language.word_forms import tokens
from placegraph.runtime.scene_graph import GraphNode

# sRGB of the eleven basic colour terms (Berlin and Kay) and beige, as in CSS but for brown, green and pink,
# which in homes are duller than their CSS namesakes.
BASIC_COLORS: dict[str, tuple[int, int, int]] = {
    "black": (20, 20, 20), "white": (240, 240, 240), "gray": (128, 128, 128), "red": (190, 30, 35),
    "green": (40, 130, 50), "blue": (40, 70, 180), "yellow": (235, 215, 40), "orange": (240, 140, 30),
    "brown": (115, 75, 40), "pink": (235, 150, 175), "purple": (120, 50, 140), "beige": (220, 205, 170),
}  # fmt: skip
COLORS: dict[str, str] = word_table("colors")
SIZES: dict[str, str] = word_table("sizes")
SHADES = {"dark": -1.0, "darker": -1.0, "deep": -1.0, "light": 1.0, "lighter": 1.0, "pale": 1.0, "bright": 0.0}
FILLER_WORDS = frozenset(word_list("appearance_filler"))


@dataclass(frozen=True, eq=False)
class AppearanceFits:
    """How well n things fit the words: values (n,) 0..1, whether the map holds evidence, a sentence for each."""

    values: F64
    known: bool
    sentences: tuple[str, ...]


def appearance_fits(
    words: str, nodes: Sequence[GraphNode], boxes: Boxes, among: Bool, settings: AppearanceSettings
) -> AppearanceFits:
    """How well each of n nodes fits the words of an `is` condition; among (n,): the nodes whose sizes are compared."""
    content_words = [word for word in tokens(words.replace("-", " ")) if word not in FILLER_WORDS]
    values, known = np.ones(len(nodes)), []
    notes: list[list[str]] = [[] for _ in nodes]
    color = next((COLORS[stem] for word in content_words if (stem := _color_stem(word)) in COLORS), "")
    shade = next((SHADES[word] for word in content_words if word in SHADES), 0.0)
    if color or (shade and len(content_words) == 1):
        fits, is_known = _colors(nodes, color, shade, content_words, settings)
        values *= fits
        known.append(is_known)
        for i, node in enumerate(nodes):
            color_text = f"sRGB {node.color}" if node.color else "a colour that was not seen"
            notes[i].append(f"{boxes.labels[i]} has {color_text}: {words} fits {fits[i]:.2f}")
    for word in content_words:
        if _color_stem(word) in COLORS or word in SHADES:
            continue
        tagged = np.array([_is_tagged(node, word) for node in nodes], bool)
        if tagged.any():
            values *= np.where(tagged, 1.0, 0.1)
            known.append(True)
            for i in np.flatnonzero(tagged).tolist():
                notes[i].append(f"{boxes.labels[i]} is tagged {word}")
        elif word in SIZES:
            fits = size_fit(boxes, SIZES[word], among, settings)
            values *= fits
            known.append(True)
            for i in range(len(nodes)):
                notes[i].append(f"{boxes.labels[i]} among {int(among.sum())}: {word} fits {fits[i]:.2f}")
        else:
            known.append(False)
    return AppearanceFits(values, bool(known) and all(known), tuple("; ".join(note) for note in notes))


def _color_stem(word: str) -> str:
    """The colour in "greenish", "reddish", "whitish"; other words unchanged."""
    if not word.endswith("ish"):
        return word
    stem = word[:-3]
    return next((name for name in (stem, stem + "e", re.sub(r"(.)\1$", r"\1", stem)) if name in COLORS), word)


def _is_tagged(node: GraphNode, word: str) -> bool:
    return any(word in tokens(tag.name) for tag in node.tags)


def _colors(
    nodes: Sequence[GraphNode], color: str, shade: float, content_words: Sequence[str], settings: AppearanceSettings
) -> tuple[F64, bool]:
    tagged = np.array(
        [any(_is_tagged(node, word) for word in content_words if _color_stem(word) in COLORS) for node in nodes], bool
    )
    has_color = np.array([len(node.color) == 3 for node in nodes], bool)
    fits = np.full(len(nodes), HOLDS)
    if has_color.any():
        lab = _lab([node.color for node in nodes if len(node.color) == 3])
        fits[has_color] = (
            _color_fits(lab, color, shade, settings) if color else np.clip(0.5 + shade * (lab[:, 0] - 50) / 60, 0, 1)
        )
    # scaled so that a fit of MIN_COLOR_FIT becomes 0.5, from which on any condition holds
    fits = np.where(has_color & (fits < settings.min_color_fit), fits * 0.5 / settings.min_color_fit, fits)
    if tagged.any():
        fits = np.where(tagged, 1.0, np.where(has_color, fits, 0.3))
    return fits, bool(has_color.any() or tagged.any())


def _color_fits(lab: F64, color: str, shade: float, settings: AppearanceSettings) -> F64:
    """(n,) 1 where `color` is the nearest basic colour; "dark" and "light" (shade -1, 1) shift its lightness."""
    names = list(BASIC_COLORS)
    terms = _lab(list(BASIC_COLORS.values()))
    if shade:
        terms[names.index(color), 0] = np.clip(terms[names.index(color), 0] + shade * settings.shade_lightness, 5, 95)
    distances = np.linalg.norm(lab[:, None] - terms[None], axis=2)
    excess = distances[:, names.index(color)] - distances.min(axis=1)
    return np.asarray(np.exp(-excess / settings.color_falloff))


def color_fit(node: GraphNode, color: str, settings: AppearanceSettings) -> float:
    """How well `color` names an object's median colour, 0..1; 1 when it is the nearest basic colour."""
    return float(_colors([node], color, 0.0, [color], settings)[0][0])


def size_fit(boxes: Boxes, size: str, among: Bool, settings: AppearanceSettings) -> F64:
    """(n,) how well large, small, tall, short, long or narrow fits each, by its rank among the others."""
    if size in ("large", "small"):
        values = log_size(boxes, settings.short_side_weight)
    elif size in ("tall", "short"):
        values = boxes.size[:, 2]
    else:
        values = length_m(boxes)
    peers = values[among]
    if len(peers) < 2:
        return np.ones(len(boxes))
    below = (peers[None] < values[:, None] - 1e-6).sum(axis=1) / (len(peers) - 1)
    share = np.clip(below, 0, 1) if size in ("large", "tall", "long") else np.clip(1 - below, 0, 1)
    return np.asarray(settings.min_size_fit + (1 - settings.min_size_fit) * share)


def _lab(colors: Sequence[tuple[int, ...]]) -> F64:
    pixels = np.asarray(colors, np.float32).reshape(1, -1, 3) / 255
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2Lab)[0], np.float64)
