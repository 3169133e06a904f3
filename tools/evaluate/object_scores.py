"""Objects of a map against the true ones.

A map object *fits* a true object when its strongest tag means the true class (ClassVocabulary) and either their axis-
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
from placegraph.tools.evaluate.ground_truth import ClassVocabulary, GroundTruthObject
from placegraph.tools.evaluate.place_overlap import ratio

MIN_IOU = 0.25
STRICT_IOU = 0.5
MAX_THIN_M = 0.12  # the smallest extent of a thin object; chosen by hand, as are the next two
MAX_CENTER_DISTANCE_M = 0.25
MIN_INSIDE = 0.5
TOP_K = (1, 3, 5, 10)
SAME_SIMILARITY = 1e-6  # similarities that differ by less count as equal


@dataclass(frozen=True, eq=False)
class BoxComparison:
    """Boxes compared, (map, true): IoU, distance of centres, share of the map box inside, whether the class agrees."""

    iou: F64
    distance_m: F64
    inside: F64
    same_class: Bool


def object_scores(
    objects: Sequence[MapObject], true: Sequence[GroundTruthObject], vocabulary: ClassVocabulary
) -> dict[str, Any]:
    """All numbers of the objects. Source of duplicates and AUC top-k: the paper, which has them from HOV-SG."""
    well, poorly = (np.array([thing.seen == seen for thing in true], bool) for seen in ("well", "poorly"))
    classes = vocabulary.classes_of([thing.tags[0].name if thing.tags else "" for thing in objects])
    boxes = compare_boxes(objects, true, classes)
    fit = fits(boxes, np.array([thing.box for thing in true]).reshape(-1, 2, 3))
    right = match_pairs(boxes, fit & well)
    strict = match_pairs(boxes, boxes.same_class & (boxes.iou >= STRICT_IOU) & well)
    any_class = match_pairs(boxes, (boxes.iou >= MIN_IOU) & well)
    lies_on = fit | (boxes.same_class & (boxes.inside >= MIN_INSIDE))
    aside = {i for i in range(len(objects)) if i not in right and lies_on[i, poorly].any()}
    found, truth = sorted(right.values()), int(well.sum())
    tags = [(objects[i].tags, true[j].name) for i, j in sorted(any_class.items())]
    return {
        "truth": truth,
        "of": len(true),
        "map": len(objects),
        "aside": len(aside),
        "found": len(found),
        "recall": ratio(len(found), truth),
        "precision": ratio(len(right), len(objects) - len(aside)),
        "recall_50": ratio(len(strict), truth),
        "recall_any_name": ratio(len(any_class), truth),
        "mean_iou": ratio(float(sum(boxes.iou[i, j] for i, j in right.items())), len(right)),
        "map_per_found": _map_objects_per_found(lies_on, found),
        "map_per_found_any_name": _map_objects_per_found(boxes.iou >= MIN_IOU, sorted(any_class.values())),
        "top_k": top_k(tags, vocabulary),
        "classes": _counts_by_class(objects, true, classes, right, aside),
    }


def _map_objects_per_found(lies_on: Bool, found: Sequence[int]) -> float:
    """Map objects that lie on the true ones that were found, for each of those: 1 where there are no duplicates."""
    return ratio(int(lies_on[:, list(found)].any(axis=1).sum()) if found else 0, len(found))


def compare_boxes(
    objects: Sequence[MapObject], true: Sequence[GroundTruthObject], classes: Sequence[str]
) -> BoxComparison:
    """Compare each map object, and the class of its strongest tag, with each true one."""
    a = np.array([thing.box for thing in objects]).reshape(-1, 1, 2, 3)
    b = np.array([thing.box for thing in true]).reshape(1, -1, 2, 3)
    edges = np.minimum(a[..., 1, :], b[..., 1, :]) - np.maximum(a[..., 0, :], b[..., 0, :])
    shared = np.prod(np.maximum(edges, 0), axis=2)
    volume_a, volume_b = (np.prod(box[..., 1, :] - box[..., 0, :], axis=2) for box in (a, b))
    union = volume_a + volume_b - shared
    same_class = [[name == thing.name for thing in true] for name in classes]
    return BoxComparison(
        iou=np.divide(shared, union, out=np.zeros_like(shared), where=union > 0),
        distance_m=np.linalg.norm(a.mean(axis=2) - b.mean(axis=2), axis=2),
        inside=np.divide(shared, volume_a, out=np.zeros_like(shared), where=(volume_a > 0) & (union > 0)),
        same_class=np.array(same_class, bool).reshape(len(objects), len(true)),
    )


def fits(boxes: BoxComparison, true_boxes: F64) -> Bool:
    """(map, true) which map objects fit which true boxes (T, 2, 3)."""
    thin = (true_boxes[:, 1] - true_boxes[:, 0]).min(axis=1) < MAX_THIN_M
    near = thin[None] & (boxes.distance_m < MAX_CENTER_DISTANCE_M)
    return np.asarray(boxes.same_class & ((boxes.iou >= MIN_IOU) | near))


def match_pairs(boxes: BoxComparison, allowed: Bool) -> dict[int, int]:
    """Map object to true object, one to one among the allowed (map, true): largest IoU first, then nearest centres."""
    rows, columns = np.nonzero(allowed)
    order = np.lexsort((boxes.distance_m[rows, columns], -boxes.iou[rows, columns]))
    true_of: dict[int, int] = {}
    used: set[int] = set()
    for i, j in zip(rows[order].tolist(), columns[order].tolist(), strict=True):
        if i not in true_of and j not in used:
            true_of[i] = j
            used.add(j)
    return true_of


def top_k(objects: Sequence[tuple[Sequence[Tag], str]], vocabulary: ClassVocabulary) -> dict[str, Any]:
    """At which rank the true class comes among all classes, by similarity to an object's tags; (tags, true class).

    The similarity of a class is the mean cosine of its name with the tags, by their weights; `auc` is the area under
    the curve of top-k accuracy, k over the number of classes. Equally similar classes share their ranks, so that an
    object without tags gets no credit. Source: paper, AUC top-k (from HOV-SG).
    """
    count = len(vocabulary.names)
    if not objects:
        return {"objects": 0, "classes": count}
    curves = []
    for tags, true_class in objects:
        similarities = vocabulary.class_similarities([tag.name for tag in tags])
        similarity = np.array([tag.weight for tag in tags]) @ similarities
        lead = similarity - similarity[vocabulary.names.index(true_class)]
        before, equal = (lead > SAME_SIMILARITY).sum(), (np.abs(lead) <= SAME_SIMILARITY).sum()
        curves.append(np.clip((np.arange(1, count + 1) - before) / equal, 0, 1))
    accuracy = np.mean(curves, axis=0)
    curve = {f"top_{k}": float(accuracy[min(k, count) - 1]) for k in TOP_K}
    return {"objects": len(objects), "classes": count, "auc": float(accuracy.mean())} | curve


def _counts_by_class(
    objects: Sequence[MapObject],
    true: Sequence[GroundTruthObject],
    classes: Sequence[str],
    right: dict[int, int],
    aside: set[int],
) -> dict[str, dict[str, int]]:
    """By class: true objects seen well, found, map objects of that class, and those of them that are wrong."""
    table: dict[str, dict[str, int]] = {}

    def row(name: str) -> dict[str, int]:
        return table.setdefault(name, {"truth": 0, "found": 0, "map": 0, "wrong": 0})

    for true_object in true:
        if true_object.seen == "well":
            row(true_object.name)["truth"] += 1
    for i, thing in enumerate(objects):
        counts = row(classes[i] or (thing.tags[0].name if thing.tags else "(no name)"))
        counts["map"] += 1
        counts["found"] += i in right
        counts["wrong"] += i not in right and i not in aside
    return dict(sorted(table.items()))
