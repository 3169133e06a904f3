"""Rooms on real occupancy maps against their published truth: mean IoU-F1@.5 (Bormann et al. 2016, ipa maps).

    python tests/measurements/room_segmentation.py FOLDER [--sensitivity]

FOLDER holds `<map>.png` (255 free, 0 occupied, 5 cm a pixel), `<map>_furnitures.png`, `<map>_truth_labels.png`.
Beside ours the published method (docs/method.md, rooms): distance field, smooth, Otsu's threshold, seeds, watershed.
With --sensitivity also the means for each parameter a quarter less and a quarter more, and the means without each map.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from placegraph.nodes.hierarchy.rooms import RoomConfig, keep_walls, segment_rooms

TRUTH = "_truth_labels.png"
TURNED = ("door_m", "neck_share", "seed_min_m", "smooth_m", "wall_min_m")  # those that a plan picture depends on

Plan = tuple[str, np.ndarray, np.ndarray]  # name, occupied (R, C) bool, true labels (R, C)
Method = Callable[[np.ndarray, RoomConfig], np.ndarray]


def f1(found: np.ndarray, truth: np.ndarray, wanted: float = 0.5) -> float:
    """Share of rooms of two label images that match one to one by IoU > `wanted` (at .5 no room can match twice)."""
    pairs = np.stack((found.ravel(), truth.ravel()), axis=1)
    (labels, shared), sizes_found, sizes_truth = (
        np.unique(pairs[(pairs > 0).all(axis=1)], axis=0, return_counts=True),
        np.bincount(found.ravel()),
        np.bincount(truth.ravel()),
    )
    union = sizes_found[labels[:, 0]] + sizes_truth[labels[:, 1]] - shared
    matches = np.count_nonzero(shared / union > wanted)
    rooms = np.count_nonzero(sizes_found[1:]) + np.count_nonzero(sizes_truth[1:])
    return 2 * matches / rooms if rooms else 1.0


def ours(occupied: np.ndarray, config: RoomConfig) -> np.ndarray:
    return segment_rooms(keep_walls(occupied, config), np.ones_like(occupied), config)


def published(occupied: np.ndarray, config: RoomConfig) -> np.ndarray:
    """HOV-SG's values: the field smoothed over 11 cells with sigma 10, no seed under half a metre across."""
    field = cv2.distanceTransform((~occupied).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    field = cv2.GaussianBlur(field, (11, 11), 10)
    scaled = cv2.normalize(field, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    # of the whole picture: of its free cells alone the threshold is higher and the score lower (.39 and .12)
    _, seeds = cv2.threshold(scaled, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(seeds)
    small = boxes[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1) * config.cell_m < 0.5
    outside = len(boxes)
    markers = np.where(small[labels], 0, labels).astype(np.int32)
    markers[occupied] = outside
    found = cv2.watershed(cv2.cvtColor(255 - scaled, cv2.COLOR_GRAY2BGR), markers)
    found[(found == outside) | (found < 0)] = 0
    return found


def measure(method: Method, config: RoomConfig, maps: list[Plan]) -> np.ndarray:
    """(maps, 2) F1 and seconds."""
    rows = []
    for _, occupied, truth in maps:
        began = time.perf_counter()
        found = method(occupied, config)
        seconds = time.perf_counter() - began
        rows.append((f1(found, truth), seconds))
    return np.array(rows)


def read(folder: Path, kind: str) -> list[Plan]:
    names = sorted(path.name.removesuffix(TRUTH) for path in folder.glob(f"*{TRUTH}"))
    return [
        (
            name,
            cv2.imread(str(folder / f"{name}{kind}.png"), cv2.IMREAD_GRAYSCALE) <= 250,
            cv2.imread(str(folder / f"{name}{TRUTH}"), cv2.IMREAD_UNCHANGED).astype(np.int64),
        )
        for name in names
    ]


def sensitivity(plans: list[list[Plan]], config: RoomConfig, scores: list[np.ndarray]) -> None:
    print("\n| parameter | empty | furnished |\n|---|---|---|")
    for name in TURNED:
        for factor in (0.75, 1.25):
            changed = config.model_copy(update={name: getattr(config, name) * factor})
            means = [measure(ours, changed, some)[:, 0].mean() for some in plans]
            print(f"| {name} x {factor} | {means[0]:.3f} | {means[1]:.3f} |", flush=True)
    print("\n| left out | empty | furnished |\n|---|---|---|")
    for i, (name, _, _) in enumerate(plans[0]):
        means = [np.delete(some[:, 0], i).mean() for some in scores]
        print(f"| {name} | {means[0]:.3f} | {means[1]:.3f} |")


def main(folder: Path, with_sensitivity: bool) -> None:
    config, plans = RoomConfig(cell_m=0.05), [read(folder, kind) for kind in ("", "_furnitures")]
    mine, theirs = ([measure(method, config, some) for some in plans] for method in (ours, published))
    print(
        "| map | empty | furnished | published, empty | published, furnished | m2 | s |\n|---|---|---|---|---|---|---|"
    )
    columns = [*(some[:, 0] for some in (*mine, *theirs))]
    for i, (name, _, truth) in enumerate(plans[0]):
        size = np.count_nonzero(truth) * config.cell_m**2
        values = " | ".join(f"{column[i]:.3f}" for column in columns)
        print(f"| {name} | {values} | {size:.0f} | {mine[0][i, 1]:.2f} |")
    print(f"| mean of {len(plans[0])} | " + " | ".join(f"{column.mean():.3f}" for column in columns) + " | | |")
    if with_sensitivity:
        sensitivity(plans, config, mine)


if __name__ == "__main__":
    main(Path(sys.argv[1]), "--sensitivity" in sys.argv[2:])
