"""Rendered views as augmented training batches: zoom, shift, mirror, colour; boxes follow exactly."""

from __future__ import annotations

import queue
import threading
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from placegraph.runtime.arrays import F32, F64, I64, U8, U16, Bool
from placegraph.runtime.errors import SourceError

FILL = 114  # models_onnx/letterbox.py
MIN_SHARE = 0.0006  # visible px of an object by those of the image: smaller ones are neither asked for nor wrong
MIN_CUT = 0.3  # an object cut by the border counts while so much of its visible box is left


@dataclass(frozen=True, eq=False)
class Shard:
    """The views of one house (view_rendering.py); `shown` is the class by instance value, boxes are (M, 7)."""

    color: U8
    depth: U16
    instance: U16
    shown: I64
    boxes: list[F32]


@dataclass(frozen=True, eq=False)
class TrainingSample:
    """One augmented view at network size.

    color (H, W, 3), boxes (M, 4) px, classes (M,), which of them count (M,), ids (M,), instance (H, W), depth (H, W) in
    m, and the class at the centre of each stride-8 cell (A8,), -1: none.
    """

    color: U8
    boxes: F32
    classes: I64
    counts: Bool
    ids: I64
    instance: U16
    depth: F32
    cells: I64


def load_shards(folder: Path) -> list[Shard]:
    """All shards of a folder by seed, memory-mapped; raises SourceError when there is none."""
    folders = sorted((path for path in folder.glob("*") if path.name.isdigit()), key=lambda path: int(path.name))
    if not folders:
        raise SourceError(f"{folder}: no shards; render them with `placegraph train views`")
    shards = []
    for path in folders:
        color, depth, instance = (np.load(path / f"{n}.npy", mmap_mode="r") for n in ("color", "depth", "instance"))
        boxes = np.load(path / "boxes.npy")
        shown = np.concatenate(([-1], np.load(path / "item_class.npy").astype(np.int64)))
        shards.append(Shard(color, depth, instance, shown, [boxes[boxes[:, 0] == k, 1:] for k in range(len(color))]))
    return shards


class Augmentation:
    """Random views of shards at one network size, from one seed."""

    def __init__(
        self,
        shards: list[Shard],
        height: int,
        width: int,
        seed: int,
        squash: bool = False,
        varied: bool = True,
        common: float = 0.0,
        with_depth: bool = True,
    ) -> None:
        """`squash`: the image fills the input whatever its aspect, as RAM++ does, else it is letterboxed; not `varied`:
        only the order is random. Views of classes that less than a share `common` of all views show come more often.
        Not `with_depth`: samples hold none (0, 0); reading it takes memory that the pictures need.
        """
        self._with_depth = with_depth
        self._varied = varied
        self._repeats = repeat_factors(shards, common)
        self._shards, self._height, self._width, self._squash = shards, height, width, squash
        self._random = np.random.default_rng(seed)
        self._views = [(i, k) for i, shard in enumerate(shards) for k in range(len(shard.color))]
        self._order: list[int] = []

    def sample(self) -> TrainingSample:
        """The next view: every view comes once (or as often as its rarest class requires) before any is repeated."""
        if not self._order:
            counts = np.floor(self._repeats + self._random.random(len(self._repeats))).astype(int)
            self._order = self._random.permutation(np.repeat(np.arange(len(self._views)), counts)).tolist()
        i, k = self._views[self._order.pop()]
        shard = self._shards[i]
        move = self._affine(shard.color.shape[2], shard.color.shape[1])
        size = (self._width, self._height)
        # boxes count from the edge of a pixel, OpenCV from its middle
        centered = move.copy()
        centered[:, 2] += 0.5 * (np.diag(move[:, :2]) - 1)
        fill = (FILL,) * 3
        color = np.asarray(cv2.warpAffine(shard.color[k], centered, size, borderValue=fill), np.uint8)
        instance = np.asarray(cv2.warpAffine(shard.instance[k], centered, size, flags=cv2.INTER_NEAREST), np.uint16)
        depth = np.zeros((0, 0), np.float32)
        if self._with_depth:
            depth = np.asarray(cv2.warpAffine(shard.depth[k], centered, size, flags=cv2.INTER_NEAREST), np.float32)
            depth /= np.float32(1000)
        boxes, classes, counts, ids = self._place(shard.boxes[k], move)
        cells = shard.shown[instance[4::8, 4::8]].ravel()
        color = self._paint(color) if self._varied else color
        return TrainingSample(color, boxes, classes, counts, ids, instance, depth, cells)

    def _affine(self, width: int, height: int) -> F32:
        """Image px to network px: fit, then zoom, shift and mirror at random."""
        random = self._random
        fit_x, fit_y = self._width / width, self._height / height
        if not self._squash:
            fit_x = fit_y = min(fit_x, fit_y)
        if not self._varied:
            spare = (self._width - fit_x * width) / 2, (self._height - fit_y * height) / 2
            return np.array([[fit_x, 0, spare[0]], [0, fit_y, spare[1]]], np.float32)
        zoom = np.exp(random.uniform(-0.35, 0.5)) if random.random() < 0.75 else 1.0
        stretch = np.exp(random.normal(0, 0.06))
        sx, sy = fit_x * zoom * stretch, fit_y * zoom / stretch
        spare_x, spare_y = self._width - sx * width, self._height - sy * height
        tx = spare_x * (random.random() if zoom != 1.0 else 0.5)
        ty = spare_y * (random.random() if zoom != 1.0 else 0.5)
        if random.random() < 0.5:
            return np.array([[-sx, 0, tx + sx * width], [0, sy, ty]], np.float32)
        return np.array([[sx, 0, tx], [0, sy, ty]], np.float32)

    def _place(self, rows: F32, move: F32) -> tuple[F32, I64, Bool, I64]:
        corners = np.stack((rows[:, [2, 4]] * move[0, 0] + move[0, 2], rows[:, [3, 5]] * move[1, 1] + move[1, 2]), 2)
        whole = np.concatenate((corners.min(axis=1), corners.max(axis=1)), 1)
        limit = np.array([self._width, self._height] * 2, np.float32)
        boxes = np.clip(whole, 0, limit)
        area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
        left = area / np.maximum(np.prod(whole[:, 2:] - whole[:, :2], axis=1), 1e-6)
        px = rows[:, 6] * abs(move[0, 0] * move[1, 1]) * left
        is_visible = (area > 16) & (left > 0.02)
        counts = (px >= MIN_SHARE * self._width * self._height) & (left >= MIN_CUT)
        return (
            boxes[is_visible].astype(np.float32),
            rows[is_visible, 1].astype(np.int64),
            counts[is_visible],
            rows[is_visible, 0].astype(np.int64),
        )

    def _paint(self, color: U8) -> U8:
        """Brightness, contrast, colour cast, blur and noise."""
        random = self._random
        gain = np.exp(random.normal(0, 0.18)) * np.exp(random.normal(0, 0.06, 3))
        lift = random.normal(0, 12)
        gamma = np.exp(random.normal(0, 0.15))
        levels = np.arange(256)[:, None] / 255
        table = np.clip(levels**gamma * gain * 255 + lift, 0, 255).astype(np.uint8)
        color = np.asarray(cv2.LUT(color, table[None]), np.uint8)
        if random.random() < 0.15:
            gray = color.mean(axis=2, keepdims=True)
            share = random.uniform(0.3, 1.0)
            color = (color * (1 - share) + gray * share).astype(np.uint8)
        if random.random() < 0.2:
            color = np.asarray(cv2.GaussianBlur(color, (0, 0), random.uniform(0.4, 1.2)), np.uint8)
        if random.random() < 0.2:
            shape = color.shape
            color = np.clip(color + random.normal(0, random.uniform(2, 8), shape).astype(np.float32), 0, 255).astype(
                np.uint8
            )
        return np.asarray(color)


def repeat_factors(shards: list[Shard], common: float) -> F64:
    """How often each view comes in a round (views,), at least 1: sqrt(common / share of views with its rarest class).

    Source: repeat-factor sampling, Gupta et al., "LVIS", CVPR 2019.
    """
    shown = [set(rows[:, 1].astype(int).tolist()) for shard in shards for rows in shard.boxes]
    count = Counter(k for classes in shown for k in classes)
    factor = {k: max(1.0, (common * len(shown) / n) ** 0.5) for k, n in count.items()}
    return np.array([max((factor[k] for k in classes), default=1.0) for classes in shown])


def batches(augment: Augmentation, size: int, ahead: int = 6) -> Iterator[list[TrainingSample]]:
    """Endless batches, prepared by a background thread."""
    ready: queue.Queue[list[TrainingSample] | Exception] = queue.Queue(ahead)

    def prepare() -> None:
        try:
            while True:
                ready.put([augment.sample() for _ in range(size)])
        except Exception as error:  # raised in the consumer, which would otherwise wait forever
            ready.put(error)

    threading.Thread(target=prepare, daemon=True).start()
    while True:
        batch = ready.get()
        if isinstance(batch, Exception):
            raise batch
        yield batch
