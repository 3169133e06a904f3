"""Text labels on a drawing that do not overlap."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import U8
from placegraph.tools.simulator.house_model import Color

REGULAR, BOLD = 400, 700  # weights of the font
HALO: Color = (255, 255, 255)


@dataclass(frozen=True)
class Label:
    """One word around a centre (px)."""

    text: str
    center: tuple[float, float]
    size_px: int
    color: Color
    bold: bool


class LabelLayout:
    """Labels for one image (H, W, 3) RGB, placed one after the other and drawn at the end."""

    def __init__(self, image: U8) -> None:
        self._image, self._font = image, cv2.FontFace("sans")
        self.placed: list[Label] = []
        self._taken: list[tuple[float, float, float, float]] = []  # x0 y0 x1 y1 in px

    def add(
        self,
        text: str,
        centers: list[tuple[float, float]],
        size_px: int,
        color: Color,
        bold: bool = False,
        must: bool = False,
    ) -> None:
        """Places a label at the first of the centres (px) where it overlaps no other label.

        Without such a centre the label is omitted, or with `must` placed at the first one.
        """
        for center in centers:
            box = self._box(text, center, size_px, bold)
            if not any(_boxes_overlap(box, taken) for taken in self._taken):
                break
        else:
            if not must:
                return
            center = centers[0]
            box = self._box(text, center, size_px, bold)
        self._taken.append(box)
        self.placed.append(Label(text, center, size_px, color, bold))

    def draw(self) -> None:
        """Write all words on the image."""
        for label in self.placed:
            self.write(label.text, label.center, label.size_px, label.color, label.bold)

    def write(self, text: str, center: tuple[float, float], size_px: int, color: Color, bold: bool = False) -> None:
        """Writes one label around a centre (px) with a light halo."""
        x0, y0, x1, y1 = self._box(text, center, size_px, bold)
        edge = size_px  # room for descenders and the rim
        top, left = max(int(y0) - edge, 0), max(int(x0) - edge, 0)
        part = np.ascontiguousarray(self._image[top : int(y1) + edge, left : int(x1) + edge])
        if part.size == 0:
            return
        weight = BOLD if bold else REGULAR
        start = (round(x0) - left, round(center[1] + size_px * 0.36) - top)
        rim = np.zeros(part.shape[:2], np.uint8)
        cv2.putText(rim, text, start, (255,), self._font, size_px, weight)
        near = cv2.GaussianBlur(cv2.dilate(rim, np.ones((3, 3), np.uint8)), (5, 5), 0)[..., None] / 255 * 0.75
        part[:] = np.round(part * (1 - near) + np.array(HALO) * near).astype(np.uint8)
        cv2.putText(part, text, start, color, self._font, size_px, weight)
        self._image[top : top + part.shape[0], left : left + part.shape[1]] = part

    def _box(
        self, text: str, center: tuple[float, float], size_px: int, bold: bool
    ) -> tuple[float, float, float, float]:
        size = (self._image.shape[1], self._image.shape[0])
        width = cv2.getTextSize(size, text, (0, 0), self._font, size_px, BOLD if bold else REGULAR)[2]
        x, y = center
        return x - width / 2, y - size_px * 0.5, x + width / 2, y + size_px * 0.5


def _boxes_overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
