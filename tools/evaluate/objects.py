"""Objects of a map against the true ones.

A map object *fits* a true object when its strongest tag means the true class (known.Words) and either their axis-
aligned boxes overlap by an IoU of at least .25, or the true object is thin (an extent below .12 m: a picture, a rug, a
curtain) and the boxes' centres are less than .25 m apart. Map objects are paired with the true objects that were seen
well, one to one, the largest IoU first, then the nearest centres. A map object *lies on* a true object when it fits,
or is of its class and has at least half of its volume inside its box.

Right: paired. Set aside, neither right nor wrong: not paired, and lies on an object that was seen, but not well.
Wrong: the rest, duplicates among them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64, Bool
from placegraph.runtime.scene_graph import Tag
from placegraph.tools.evaluate.aligned_map import MapObject
from placegraph.tools.evaluate.ground_truth import KnownObject, Words
from placegraph.tools.evaluate.places import share

MIN_IOU = 0.25
STRICT_IOU = 0.5
THIN_M = 0.12
NEAR_M = 0.25
INSIDE = 0.5
TOP_K = (1, 3, 5, 10)
ALIKE = 1e-6  # of likenesses: not told apart


@dataclass(frozen=True, eq=False)
class Pairing:
    """Boxes compared, (map, true): IoU, distance of centres in metres, share of the map box inside, same name."""

    iou: F64
    apart_m: F64
    inside: F64
    named: Bool


def object_scores(found: Sequence[MapObject], true: Sequence[KnownObject], words: Words) -> dict[str, Any]:
    """All numbers of the objects. Source of duplicates and AUC top-k: METHOD.md, section 11."""
    well, poor = (np.array([one.seen == sight for one in true], bool) for sight in ("well", "poorly"))
    called = words.called([one.tags[0].name if one.tags else "" for one in found])
    pairing = compare(found, true, called)
    fit = fits(pairing, np.array([one.box for one in true]).reshape(-1, 2, 3))
    right = pair(pairing, fit & well)
    strict = pair(pairing, pairing.named & (pairing.iou >= STRICT_IOU) & well)
    anyhow = pair(pairing, (pairing.iou >= MIN_IOU) & well)
    on = fit | (pairing.named & (pairing.inside >= INSIDE))
    aside = {i for i in range(len(found)) if i not in right and on[i, poor].any()}
    got, truth = sorted(right.values()), int(well.sum())
    tags = [(found[i].tags, true[j].name) for i, j in sorted(anyhow.items())]
    return {
        "truth": truth,
        "of": len(true),
        "map": len(found),
        "aside": len(aside),
        "found": len(got),
        "recall": share(len(got), truth),
        "precision": share(len(right), len(found) - len(aside)),
        "recall_50": share(len(strict), truth),
        "recall_any_name": share(len(anyhow), truth),
        "mean_iou": share(float(sum(pairing.iou[i, j] for i, j in right.items())), len(right)),
        "map_per_found": _each(on, got),
        "map_per_found_any_name": _each(pairing.iou >= MIN_IOU, sorted(anyhow.values())),
        "top_k": top_k(tags, words),
        "classes": _by_class(found, true, called, right, aside),
    }


def _each(on: Bool, got: Sequence[int]) -> float:
    """Map objects on true ones that were found, for each of those: 1 where none is there twice."""
    return share(int(on[:, list(got)].any(axis=1).sum()) if got else 0, len(got))


def compare(found: Sequence[MapObject], true: Sequence[KnownObject], called: Sequence[str]) -> Pairing:
    """Compare each map object, and the class that it is called, with each true one."""
    a = np.array([one.box for one in found]).reshape(-1, 1, 2, 3)
    b = np.array([one.box for one in true]).reshape(1, -1, 2, 3)
    edges = np.minimum(a[..., 1, :], b[..., 1, :]) - np.maximum(a[..., 0, :], b[..., 0, :])
    shared = np.prod(np.maximum(edges, 0), axis=2)
    of_a, of_b = (np.prod(one[..., 1, :] - one[..., 0, :], axis=2) for one in (a, b))
    union = of_a + of_b - shared
    named = [[name == other.name for other in true] for name in called]
    return Pairing(
        iou=np.divide(shared, union, out=np.zeros_like(shared), where=union > 0),
        apart_m=np.linalg.norm(a.mean(axis=2) - b.mean(axis=2), axis=2),
        inside=np.divide(shared, of_a, out=np.zeros_like(shared), where=(of_a > 0) & (union > 0)),
        named=np.array(named, bool).reshape(len(found), len(true)),
    )


def fits(pairing: Pairing, true_boxes: F64) -> Bool:
    """(map, true) which map objects fit which true boxes (T, 2, 3)."""
    thin = (true_boxes[:, 1] - true_boxes[:, 0]).min(axis=1) < THIN_M
    return np.asarray(pairing.named & ((pairing.iou >= MIN_IOU) | (thin[None] & (pairing.apart_m < NEAR_M))))


def pair(pairing: Pairing, allowed: Bool) -> dict[int, int]:
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


def top_k(pairs: Sequence[tuple[Sequence[Tag], str]], words: Words) -> dict[str, Any]:
    """How soon the true class comes among all classes, ranked by likeness to the object's tags.

    The likeness of a class is the mean cosine of its name with the tags, by their weights; `auc` is the area under the
    curve of top-k accuracy, k over the number of classes. Classes that are equally like come in every order alike, so
    that an object without tags gets no credit. Source: paper, AUC top-k (from HOV-SG).
    """
    count = len(words.names)
    if not pairs:
        return {"objects": 0, "classes": count}
    curves = []
    for tags, true_class in pairs:
        likeness = np.array([tag.weight for tag in tags]) @ words.likeness([tag.name for tag in tags])
        ahead = likeness - likeness[words.names.index(true_class)]
        before, equal = (ahead > ALIKE).sum(), (np.abs(ahead) <= ALIKE).sum()
        curves.append(np.clip((np.arange(1, count + 1) - before) / equal, 0, 1))
    accuracy = np.mean(curves, axis=0)
    curve = {f"top_{k}": float(accuracy[min(k, count) - 1]) for k in TOP_K}
    return {"objects": len(pairs), "classes": count, "auc": float(accuracy.mean())} | curve


def _by_class(
    found: Sequence[MapObject],
    true: Sequence[KnownObject],
    called: Sequence[str],
    right: dict[int, int],
    aside: set[int],
) -> dict[str, dict[str, int]]:
    """Counts by class: true ones seen well, found, map objects so called, and those of them that are wrong."""
    table: dict[str, dict[str, int]] = {}

    def row(name: str) -> dict[str, int]:
        return table.setdefault(name, {"truth": 0, "found": 0, "map": 0, "wrong": 0})

    for one in true:
        if one.seen == "well":
            row(one.name)["truth"] += 1
    for i, thing in enumerate(found):
        mine = row(called[i] or (thing.tags[0].name if thing.tags else "(no name)"))
        mine["map"] += 1
        mine["found"] += i in right
        mine["wrong"] += i not in right and i not in aside
    return dict(sorted(table.items()))
