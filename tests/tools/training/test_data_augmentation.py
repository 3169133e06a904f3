"""Augmented samples: boxes, instances, depth and colour of one sample must all tell the same story."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from placegraph.runtime.errors import SourceError
from placegraph.tools.training.data_augmentation import (
    FILL,
    Augmentation,
    Shard,
    TrainingSample,
    batches,
    load_shards,
    repeat_factors,
)
from placegraph.tools.training.view_rendering import visible_boxes

HEIGHT, WIDTH = 96, 128
COLUMNS = 4


def make_shard(*instances: np.ndarray) -> Shard:
    """A shard whose views show `instances` (H, W); item i is of class i, has its own colour, depth (i + 1) * 100 mm."""
    items = max(int(one.max()) for one in instances)
    palette = np.random.default_rng(5).integers(0, 256, (items + 1, 3)).astype(np.uint8)
    stacked = np.stack(instances).astype(np.uint16)
    boxes = [visible_boxes(one, np.arange(items, dtype=np.uint8)) for one in stacked]
    return Shard(palette[stacked], stacked * np.uint16(100), stacked, np.arange(-1, items), boxes)


def grid_of_items() -> np.ndarray:
    """Twelve rectangles of different sizes, counted row by row from the left."""
    instance = np.zeros((HEIGHT, WIDTH), np.uint16)
    sizes = np.random.default_rng(2).integers(12, 24, (12, 2))
    for i, (h, w) in enumerate(sizes):
        y, x = 6 + 30 * (i // COLUMNS), 5 + 31 * (i % COLUMNS)
        instance[y : y + h, x : x + w] = i + 1
    return instance


def is_mirrored(sample: TrainingSample) -> bool | None:
    """Whether left and right are exchanged; None where no two items of one row are seen."""
    for a, b in itertools.combinations(range(len(sample.ids)), 2):
        if sample.ids[a] // COLUMNS == sample.ids[b] // COLUMNS:
            return bool(sample.boxes[a, 0] > sample.boxes[b, 0])
    return None


def offsets(size: tuple[int, int], squash: bool, mirrored: bool) -> np.ndarray:
    """(K, 4) px by which boxes differ from those of the warped instance image, over many samples."""
    augment = Augmentation([make_shard(grid_of_items())], *size, seed=1, squash=squash)
    found = []
    for sample in (augment.sample() for _ in range(120)):
        if is_mirrored(sample) is not mirrored:
            continue
        seen = {int(row[0]): row[2:6] for row in visible_boxes(sample.instance, np.arange(12, dtype=np.uint8))}
        # what two pixels show may be gone in one image and not in the other
        large = (sample.boxes[:, 2:] - sample.boxes[:, :2]).min(axis=1) > 3
        found += [box - seen[int(item)] for box, item in zip(sample.boxes[large], sample.ids[large], strict=True)]
    return np.array(found)


@pytest.mark.parametrize("size_squash", [((64, 80), False), ((128, 160), False), ((112, 112), True)], ids=str)
@pytest.mark.parametrize("mirrored", [False, True])
def test_boxes_follow_the_pixels(size_squash: tuple[tuple[int, int], bool], mirrored: bool) -> None:
    off = offsets(*size_squash, mirrored)
    assert len(off) > 200
    assert np.abs(off).max() < 1.5
    assert np.abs(off.mean(axis=0)).max() < 0.4  # rounding to pixels goes both ways


@pytest.mark.parametrize("squash", [False, True])
def test_color_depth_and_cells_show_what_the_instances_say(squash: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Augmentation, "_paint", lambda self, color: color)
    shard = make_shard(grid_of_items())
    augment = Augmentation([shard], 96, 112, 3, squash)
    for sample in (augment.sample() for _ in range(20)):
        np.testing.assert_allclose(sample.depth, sample.instance * np.float32(0.1), atol=1e-6)
        wanted = sample.instance.reshape(12, 8, 14, 8)[:, 4, :, 4].astype(int) - 1
        np.testing.assert_array_equal(sample.cells.reshape(12, 14), wanted)
        for box, item in zip(sample.boxes, sample.ids, strict=True):
            x, y = ((box[:2] + box[2:]) / 2).astype(int)
            if (box[2:] - box[:2]).min() > 6:
                np.testing.assert_array_equal(sample.color[y, x], shard.color[0][shard.instance[0] == item + 1][0])


def test_unvaried_samples_of_the_same_size_are_the_view_itself() -> None:
    shard = make_shard(grid_of_items())
    sample = Augmentation([shard], HEIGHT, WIDTH, 1, varied=False).sample()
    np.testing.assert_array_equal(sample.color, shard.color[0])
    np.testing.assert_array_equal(sample.instance, shard.instance[0])
    np.testing.assert_allclose(sample.depth, shard.depth[0] / 1000)
    np.testing.assert_array_equal(sample.boxes, shard.boxes[0][:, 2:6])
    np.testing.assert_array_equal(sample.ids, np.arange(12))
    assert sample.boxes.dtype == np.float32 and sample.depth.dtype == np.float32 and sample.color.dtype == np.uint8


def test_varied_samples_are_painted_and_moved() -> None:
    shard = make_shard(grid_of_items())
    augment = Augmentation([shard], HEIGHT, WIDTH, 1)
    samples = [augment.sample() for _ in range(12)]
    assert {is_mirrored(sample) for sample in samples} >= {True, False}
    assert not any(np.array_equal(sample.color, shard.color[0]) for sample in samples)


def test_letterbox_keeps_the_aspect_and_squash_fills() -> None:
    instance = np.zeros((HEIGHT, WIDTH), np.uint16)
    instance[24:72, 32:96] = 1
    shard = make_shard(instance)
    boxed = Augmentation([shard], 128, 128, 1, varied=False).sample()
    assert (boxed.color[:15] == FILL).all() and (boxed.color[113:] == FILL).all()
    assert (boxed.instance[:16] == 0).all() and (boxed.depth[:16] == 0).all()
    np.testing.assert_allclose(boxed.boxes, [[32, 40, 96, 88]])
    full = Augmentation([shard], 128, 128, 1, squash=True, varied=False).sample()
    np.testing.assert_allclose(full.boxes, [[32, 32, 96, 96]])
    np.testing.assert_array_equal(full.color[3, 3], shard.color[0, 0, 0])
    tall = Augmentation([shard], 192, 128, 1, varied=False).sample()
    np.testing.assert_allclose(tall.boxes, [[32, 72, 96, 120]])


def test_an_object_cut_off_by_the_border_stops_counting() -> None:
    instance = np.zeros((HEIGHT, WIDTH), np.uint16)
    for i, (y, x) in enumerate(itertools.product((2, 34, 66), (2, 50, 98))):
        instance[y : y + 28, x : x + 28] = i + 1
    augment = Augmentation([make_shard(instance)], 96, 128, 4)
    cut = whole = 0
    for sample in (augment.sample() for _ in range(150)):
        clear = ((sample.boxes > 0) & (sample.boxes < [128, 96, 128, 96])).all(axis=1)
        if not clear.any():
            continue
        area = np.prod(sample.boxes[:, 2:] - sample.boxes[:, :2], axis=1)
        share = area / area[clear][0]  # all are equally large
        assert sample.counts[share > 0.31].all() and not sample.counts[share < 0.29].any()
        assert (share > 0.019).all()
        cut, whole = cut + int((share < 0.29).sum()), whole + int((share > 0.31).sum())
    assert cut > 10 and whole > 100


def test_small_and_mostly_hidden_objects_do_not_count() -> None:
    instance = np.zeros((256, 256), np.uint16)  # 39.3 px are the least that count
    instance[10:16, 10:16] = 1
    instance[10:17, 30:37] = 2
    instance[100:140, 100:140] = 3
    instance[100:139, 101:140] = 4  # hides all of 3 but an edge of 79 px
    instance[200:230, 200:230] = 5
    instance[201:230, 200:229] = 6
    instance[200, 202:230] = 6  # leaves 31 px of 5
    instance[50:53, 50:55] = 7  # 15 px: too small to be mentioned
    sample = Augmentation([make_shard(instance)], 256, 256, 1, varied=False).sample()
    assert dict(zip(sample.ids.tolist(), sample.counts.tolist(), strict=True)) == {
        0: False, 1: True, 2: True, 3: True, 4: False, 5: True,
    }  # fmt: skip


def test_boxes_lie_in_the_picture_and_belong_to_what_is_there() -> None:
    augment = Augmentation([make_shard(grid_of_items())], 64, 80, 8)
    for sample in (augment.sample() for _ in range(60)):
        assert (sample.boxes >= 0).all() and (sample.boxes <= [80, 64, 80, 64]).all()
        assert len(sample.boxes) == len(sample.classes) == len(sample.counts) == len(sample.ids)
        np.testing.assert_array_equal(sample.classes, sample.ids)
        assert sample.counts.dtype == bool


def test_a_view_without_objects() -> None:
    shard = make_shard(grid_of_items(), np.zeros((HEIGHT, WIDTH), np.uint16))
    augment = Augmentation([shard], 64, 80, 8)
    empty = next(sample for sample in (augment.sample() for _ in range(2)) if not sample.instance.any())
    assert empty.boxes.shape == (0, 4) and empty.classes.shape == empty.counts.shape == empty.ids.shape == (0,)
    assert (empty.cells == -1).all() and empty.cells.shape == (80,)


def test_same_seed_same_samples() -> None:
    shard = make_shard(grid_of_items())
    one, same, other = (Augmentation([shard], 64, 80, seed) for seed in (7, 7, 8))
    differ = 0
    for _ in range(8):
        a, b, c = one.sample(), same.sample(), other.sample()
        for name in TrainingSample.__dataclass_fields__:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        differ += not np.array_equal(a.color, c.color)
    assert differ == 8


def test_every_view_comes_once_before_any_comes_again() -> None:
    views = [np.full((32, 32), i + 1, np.uint16) for i in range(7)]
    augment = Augmentation([make_shard(*views[:4]), make_shard(*views[4:])], 32, 32, 3, varied=False)
    rounds = [[int(augment.sample().instance[0, 0]) for _ in range(7)] for _ in range(4)]
    assert all(sorted(one) == [1, 2, 3, 4, 5, 6, 7] for one in rounds)
    assert len({tuple(one) for one in rounds}) > 1


def test_batches_are_the_samples_in_order() -> None:
    shard = make_shard(grid_of_items())
    alone = Augmentation([shard], 64, 80, 7)
    stream = batches(Augmentation([shard], 64, 80, 7), 3, ahead=2)
    for batch in itertools.islice(stream, 4):
        assert len(batch) == 3
        for sample in batch:
            np.testing.assert_array_equal(sample.color, alone.sample().color)


def write_shard(folder: Path, shard: Shard) -> None:
    folder.mkdir(parents=True)
    np.save(folder / "color.npy", shard.color)
    np.save(folder / "depth.npy", shard.depth)
    np.save(folder / "instance.npy", shard.instance)
    np.save(folder / "item_class.npy", shard.shown[1:].astype(np.uint8))
    np.save(folder / "boxes.npy", np.concatenate([np.insert(b, 0, k, axis=1) for k, b in enumerate(shard.boxes)]))


def test_shards_are_read_by_seed_and_boxes_by_view(tmp_path: Path) -> None:
    empty = np.zeros((HEIGHT, WIDTH), np.uint16)
    one = np.zeros_like(empty)
    one[5:50, 7:70] = 1
    shards = {"10": make_shard(one), "9": make_shard(grid_of_items(), empty, one), "11.part": make_shard(one)}
    for name, shard in shards.items():
        write_shard(tmp_path / name, shard)
    found = load_shards(tmp_path)
    assert [len(shard.color) for shard in found] == [3, 1]  # 9 before 10; what is not finished is left out
    assert [len(boxes) for boxes in found[0].boxes] == [12, 0, 1]
    np.testing.assert_array_equal(found[0].boxes[2], [[0, 0, 7, 5, 70, 50, 45 * 63]])
    np.testing.assert_array_equal(found[0].shown, np.arange(-1, 12))
    np.testing.assert_array_equal(found[0].color, shards["9"].color)


def test_a_folder_without_shards_is_named(tmp_path: Path) -> None:
    (tmp_path / "12.part").mkdir()
    with pytest.raises(SourceError, match=f"{tmp_path.name}: no shards"):
        load_shards(tmp_path)


def test_views_of_rare_classes_come_more_often() -> None:
    common = [np.zeros((HEIGHT, WIDTH), np.uint16) for _ in range(99)]
    for one in common:
        one[10:40, 10:40] = 1
    rare = common[0].copy()
    rare[50:80, 10:40] = 2
    shards = [make_shard(rare, *common)]
    assert repeat_factors(shards, 0.0).tolist() == [1.0] * 100
    assert repeat_factors(shards, 0.16).tolist() == [pytest.approx(4.0)] + [1.0] * 99
    augment = Augmentation(shards, HEIGHT, WIDTH, 0, varied=False, common=0.16)
    assert sum(1 in augment.sample().classes for _ in range(103)) == 4
