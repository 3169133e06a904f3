"""Objects of a map against the true ones.

A map object *fits* a true object when its strongest tag is a word of the true class (classes.py: said or unsaid,
plurals alike) and either their axis-aligned boxes overlap by an IoU of at least .25, or the true object is thin (an
extent below .12 m: a picture, a rug, a curtain) and the boxes' centres are less than .25 m apart. Map objects are
paired with the true objects that were seen well, one to one, the largest IoU first, then the nearest centres. A map
object *lies on* a true object when it fits, or is of its class and has at least half of its volume inside its box.

Right: paired. Set aside, neither right nor wrong: not paired, and lies on an object that was seen, but not well.
Wrong: the rest, duplicates among them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from placegraph.models_onnx.text import TextEncoder
from placegraph.nodes.grounding.words import normal_form
from placegraph.tools.evaluate.aligned_map import MapObject
from placegraph.tools.evaluate.places import share
from placegraph.tools.house.classes import CLASSES, NAMES
from placegraph.tools.house.truth import Seen, TrueObject

F64 = NDArray[np.float64]
Bools = NDArray[np.bool_]

LEAST_FRAMES = 5  # seen well: clear in so many frames
LEAST_IOU = 0.25
STRICT_IOU = 0.5
THIN_M = 0.12
NEAR_M = 0.25
INSIDE = 0.5
TOP_K = (1, 3, 5, 10)


@dataclass(frozen=True, eq=False)
class Pairing:
    """Boxes compared, (map, true): IoU, distance of centres in metres, share of the map box inside, same name."""

    iou: F64
    apart_m: F64
    inside: F64
    named: Bools


def class_of_word() -> dict[str, str]:
    """The class's name of each word, by the word's normal form."""
    return {normal_form(word): one.name for one in CLASSES for word in (*one.said, *one.unsaid)}


def seen_well(seen: Seen) -> bool:
    """Whether the walk showed an object well enough to ask for it."""
    return seen.clear_frames >= LEAST_FRAMES


def object_scores(found: Sequence[MapObject], true: Sequence[TrueObject], seen: Sequence[Seen]) -> dict[str, Any]:
    """All numbers of the objects; `seen` has an entry for each true object."""
    well = np.array([seen_well(one) for one in seen], bool)
    boxes = np.array([one.box for one in true]).reshape(-1, 2, 3)
    pairing = compare(found, true)
    fit = fits(pairing, boxes)
    right = pair(pairing, fit & well)
    strict = pair(pairing, pairing.named & (pairing.iou >= STRICT_IOU) & well)
    anyhow = pair(pairing, (pairing.iou >= LEAST_IOU) & well)
    on = fit | (pairing.named & (pairing.inside >= INSIDE))
    poor = np.array([one.frames > 0 for one in seen], bool) & ~well
    aside = {i for i in range(len(found)) if i not in right and on[i, poor].any()}
    got = sorted(right.values())
    truth, judged = int(well.sum()), len(found) - len(aside)
    return {
        "truth": truth,
        "of": len(true),
        "map": len(found),
        "aside": len(aside),
        "found": len(got),
        "recall": share(len(got), truth),
        "precision": share(len(right), judged),
        "recall_50": share(len(strict), truth),
        "recall_any_name": share(len(anyhow), truth),
        "mean_iou": share(float(sum(pairing.iou[i, j] for i, j in right.items())), len(right)),
        "map_per_found": share(int(on[:, got].any(axis=1).sum()) if got else 0, len(got)),
        "top_k": top_k([(found[i].tags, true[j].class_name) for i, j in sorted(anyhow.items())]),
        "classes": _by_class(found, true, well, right, aside),
    }


def compare(found: Sequence[MapObject], true: Sequence[TrueObject]) -> Pairing:
    """Compare each map object with each true one."""
    a = np.array([one.box for one in found]).reshape(-1, 1, 2, 3)
    b = np.array([one.box for one in true]).reshape(1, -1, 2, 3)
    edges = np.minimum(a[..., 1, :], b[..., 1, :]) - np.maximum(a[..., 0, :], b[..., 0, :])
    shared = np.prod(np.maximum(edges, 0), axis=2)
    of_a, of_b = (np.prod(one[..., 1, :] - one[..., 0, :], axis=2) for one in (a, b))
    union = of_a + of_b - shared
    names = class_of_word()
    called = [names.get(normal_form(one.tags[0].name), "") if one.tags else "" for one in found]
    named = [[name == other.class_name for other in true] for name in called]
    return Pairing(
        iou=np.divide(shared, union, out=np.zeros_like(shared), where=union > 0),
        apart_m=np.linalg.norm(a.mean(axis=2) - b.mean(axis=2), axis=2),
        inside=np.divide(shared, of_a, out=np.zeros_like(shared), where=(of_a > 0) & (union > 0)),
        named=np.array(named, bool).reshape(len(found), len(true)),
    )


def fits(pairing: Pairing, true_boxes: F64) -> Bools:
    """(map, true) which map objects fit which true boxes (T, 2, 3)."""
    thin = (true_boxes[:, 1] - true_boxes[:, 0]).min(axis=1) < THIN_M
    return np.asarray(pairing.named & ((pairing.iou >= LEAST_IOU) | (thin[None] & (pairing.apart_m < NEAR_M))))


def pair(pairing: Pairing, allowed: Bools) -> dict[int, int]:
    """Map object to true object, one to one among the allowed (map, true): largest IoU first, then nearest centres."""
    rows, columns = np.nonzero(allowed)
    order = np.lexsort((pairing.apart_m[rows, columns], -pairing.iou[rows, columns]))
    taken: dict[int, int] = {}
    used: set[int] = set()
    for i, j in zip(rows[order].tolist(), columns[order].tolist(), strict=True):
        if i not in taken and j not in used:
            taken[i] = j
            used.add(j)
    return taken


def top_k(pairs: Sequence[tuple[tuple[Any, ...], str]]) -> dict[str, Any]:
    """How soon the true class comes among all classes, ranked by likeness to the object's tags.

    The likeness of a class is the mean cosine of its name with the tags, by their weights; `auc` is the area under the
    curve of top-k accuracy, k over the number of classes. Source: paper, AUC top-k (from HOV-SG).
    """
    if not pairs:
        return {"objects": 0, "classes": len(NAMES)}
    encoder = TextEncoder()
    names = encoder.encode(NAMES)
    ranks = []
    for tags, true_class in pairs:
        weights = np.array([tag.weight for tag in tags])
        likeness = names @ (encoder.encode([tag.name for tag in tags]).T @ weights)
        ranks.append(int((likeness > likeness[NAMES.index(true_class)] + 1e-6).sum()))
    accuracy = np.array([np.mean(np.array(ranks) < k) for k in range(1, len(NAMES) + 1)])
    curve = {f"top_{k}": float(accuracy[k - 1]) for k in TOP_K}
    return {"objects": len(ranks), "classes": len(NAMES), "auc": float(accuracy.mean())} | curve


def _by_class(
    found: Sequence[MapObject], true: Sequence[TrueObject], well: Bools, right: dict[int, int], aside: set[int]
) -> dict[str, dict[str, int]]:
    """Counts by class: true ones seen well, found, map objects so called, and those of them that are wrong."""
    words = class_of_word()
    table: dict[str, dict[str, int]] = {}

    def row(name: str) -> dict[str, int]:
        return table.setdefault(name, {"truth": 0, "found": 0, "map": 0, "wrong": 0})

    for one, counts in zip(true, well.tolist(), strict=True):
        if counts:
            row(one.class_name)["truth"] += 1
    for i, thing in enumerate(found):
        called = thing.tags[0].name if thing.tags else "(no name)"
        mine = row(words.get(normal_form(called), called))
        mine["map"] += 1
        mine["found"] += i in right
        mine["wrong"] += i not in right and i not in aside
    return dict(sorted(table.items()))
