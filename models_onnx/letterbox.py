"""Fit an image into a network's input without changing its aspect, and map boxes back to the image."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import F32, U8

FILL = 114  # YOLOX and YOLOv8 were trained with this grey


@dataclass(frozen=True)
class Letterbox:
    """Where an image of `width` x `height` px lies inside the network's input: scaled, then moved by the pads (px).

    The two scales differ only by the rounding of the resized image to whole pixels.
    """

    width: int
    height: int
    scale_x: float
    scale_y: float
    pad_x: int
    pad_y: int

    def to_image(self, boxes: F32) -> F32:
        """Boxes (N, 4) from px of the network's input to px of the image, clipped to it."""
        shift = np.array([self.pad_x, self.pad_y] * 2, np.float32)
        scale = np.array([self.scale_x, self.scale_y] * 2, np.float32)
        limit = np.array([self.width, self.height] * 2, np.float32)
        return np.asarray(np.clip((boxes - shift) / scale, 0, limit), np.float32)

    def to_input(self, boxes: F32) -> F32:
        """Boxes (N, 4) from px of the image to px of the network's input."""
        shift = np.array([self.pad_x, self.pad_y] * 2, np.float32)
        scale = np.array([self.scale_x, self.scale_y] * 2, np.float32)
        return np.asarray(boxes * scale + shift, np.float32)


def letterbox_image(image: U8, height: int, width: int, *, centered: bool) -> tuple[U8, Letterbox]:
    """Resize (H, W, 3) to fit (height, width, 3) px with grey borders: around it, or only right and below."""
    image_height, image_width = image.shape[:2]
    ratio = min(height / image_height, width / image_width)
    new_height = min(max(round(image_height * ratio), 1), height)
    new_width = min(max(round(image_width * ratio), 1), width)
    pad_x = (width - new_width) // 2 if centered else 0
    pad_y = (height - new_height) // 2 if centered else 0
    canvas = np.full((height, width, 3), FILL, np.uint8)
    resized = cv2.resize(image, (new_width, new_height), interpolation=cv2.INTER_LINEAR)
    canvas[pad_y : pad_y + new_height, pad_x : pad_x + new_width] = resized
    box = Letterbox(image_width, image_height, new_width / image_width, new_height / image_height, pad_x, pad_y)
    return canvas, box
