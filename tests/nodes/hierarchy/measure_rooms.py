"""Rooms on real occupancy maps against their published truth: mean IoU-F1@.5 (Bormann et al. 2016, ipa maps).

    python tests/nodes/hierarchy/measure_rooms.py FOLDER

FOLDER holds `<map>.png` (255 free, 0 occupied, 5 cm a pixel), `<map>_furnitures.png`, `<map>_truth_labels.png`.
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np

from placegraph.nodes.hierarchy.rooms import RoomConfig, segment_rooms, walls_of_plan

TRUTH = "_truth_labels.png"


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


def measure(image: Path, truth: Path, config: RoomConfig) -> tuple[float, float]:
    """F1 of one map, and the seconds it took."""
    occupied = cv2.imread(str(image), cv2.IMREAD_GRAYSCALE) <= 250
    labels = cv2.imread(str(truth), cv2.IMREAD_UNCHANGED).astype(np.int64)
    began = time.perf_counter()
    found = segment_rooms(walls_of_plan(occupied, config), np.ones_like(occupied), config)
    return f1(found, labels), time.perf_counter() - began


def main(folder: Path) -> None:
    names = sorted(path.name.removesuffix(TRUTH) for path in folder.glob(f"*{TRUTH}"))
    config, rows = RoomConfig(cell_m=0.05), []
    print("| map | empty | furnished | s |\n|---|---|---|---|")
    for name in names:
        empty, seconds = measure(folder / f"{name}.png", folder / f"{name}{TRUTH}", config)
        furnished, _ = measure(folder / f"{name}_furnitures.png", folder / f"{name}{TRUTH}", config)
        rows.append((empty, furnished))
        print(f"| {name} | {empty:.3f} | {furnished:.3f} | {seconds:.1f} |")
    mean = np.mean(rows, axis=0)
    print(f"| mean of {len(rows)} | {mean[0]:.3f} | {mean[1]:.3f} | |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
