"""Views of the evaluation houses with their true boxes, tags and masks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from placegraph.runtime.arrays import F32, F64, I64, U8, U16, Bool
from placegraph.runtime.errors import ConfigError
from placegraph.tools.evaluate.network_metrics import TrueBoxes
from placegraph.tools.simulator.house_frames import generator_version
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.training.data_augmentation import MIN_SHARE, Shard, load_shards
from placegraph.tools.training.view_rendering import EVALUATION_SEEDS, HEIGHT, WIDTH, render_houses


@dataclass(frozen=True, eq=False)
class EvaluationView:
    """One view: color (H, W, 3) sRGB, depth (H, W) in m, instance (H, W), and its objects, each of which is `small`
    (visible px under MIN_SHARE of the image, as in training) or `cut` (its box touches the image's border), or not.
    """

    color: U8
    depth_m: F32
    instance: U16
    items: I64  # (M,); the instance image holds item + 1
    classes: I64  # (M,)
    boxes: F64  # (M, 4) x0 y0 x1 y1 px
    small: Bool  # (M,)
    cut: Bool  # (M,)

    def true_boxes(self, with_cut: bool) -> TrueBoxes:
        """True boxes of the view: small ones are ignored, and cut ones unless `with_cut`."""
        return TrueBoxes(self.boxes, self.classes, self.small if with_cut else self.small | self.cut)

    @property
    def tags(self) -> F64:
        """(classes,) 1 for a class that is shown, 0 for one that is not, NaN where all its objects are small."""
        tags = np.zeros(len(NAMES))
        tags[self.classes] = np.nan
        tags[self.classes[~self.small]] = 1.0
        return tags

    @property
    def prompt_boxes(self) -> F32:
        """(N, 4) px boxes that the segmenter gets as prompts: of all objects that are not small."""
        return self.boxes[~self.small].astype(np.float32)

    def prompt_masks(self) -> list[Bool]:
        """The visible pixels (H, W) of the object of each prompt box."""
        return [np.asarray(self.instance == item + 1) for item in self.items[~self.small].tolist()]


def evaluation_shards(houses: int, views: int, data: Path) -> list[Shard]:
    """The first `houses` evaluation houses with at most `views` views each, rendered into `data` unless they are there.

    Raises ConfigError when fewer seeds are set aside.
    """
    if houses > len(EVALUATION_SEEDS):
        raise ConfigError(f"--houses: at most {len(EVALUATION_SEEDS)} seeds are set aside for evaluation")
    folder = shard_folder(views, data)
    seeds = list(EVALUATION_SEEDS[:houses])
    missing = [seed for seed in seeds if not (folder / str(seed)).exists()]
    if missing:
        render_houses(missing, views, folder)
    return load_shards(folder)[:houses]  # in order of their seeds


def shard_folder(views: int, data: Path) -> Path:
    """The shards' folder: one for each number and size of views and each version of the generator."""
    return data / f"{generator_version()}-{views}-{WIDTH}x{HEIGHT}"


def evaluation_views(shards: Sequence[Shard]) -> Iterator[EvaluationView]:
    """Every view, by house."""
    for shard in shards:
        for k in range(len(shard.color)):
            yield evaluation_view(shard.color[k], shard.depth[k], shard.instance[k], shard.boxes[k])


def evaluation_view(color: U8, depth_mm: U16, instance: U16, rows: F32) -> EvaluationView:
    """A view of a shard; rows (M, 7): item, class, x0 y0 x1 y1 (exclusive), visible px."""
    height, width = instance.shape
    boxes = rows[:, 2:6].astype(np.float64)
    return EvaluationView(
        color=np.array(color),
        depth_m=np.asarray(depth_mm, np.float32) / np.float32(1000),
        instance=np.array(instance),
        items=rows[:, 0].astype(np.int64),
        classes=rows[:, 1].astype(np.int64),
        boxes=boxes,
        small=rows[:, 6] < MIN_SHARE * height * width,
        cut=np.asarray(((boxes[:, :2] <= 0) | (boxes[:, 2:] >= (width, height))).any(axis=1)),
    )
