"""Tagger, detector and segmenter on views with truth."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.models_onnx import Detector, NamedBoxes, ScoredNames, Segmenter, Tagger
from placegraph.models_onnx.load import load
from placegraph.models_onnx.manifest import find_weights
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.node import plugin
from placegraph.tools.evaluate import detection, tags
from placegraph.tools.evaluate.detection import FoundBoxes, TrueBoxes, mean_of_known
from placegraph.tools.evaluate.house import HOUSE_WORDS
from placegraph.tools.evaluate.masks import mask_overlaps
from placegraph.tools.evaluate.views import evaluation_views
from placegraph.tools.simulator.classes import CLASSES, NAMES
from placegraph.tools.training.samples import Shard

FAMILIES = "placegraph.models_onnx"
MIN_SCORE = 0.01  # in place of a run's own floor: average precision is about the order of all finds
UNSAID = tuple(one.unsaid[0] if one.unsaid else one.name for one in CLASSES)  # a class without a synonym by its name
HAS_UNSAID = np.array([bool(one.unsaid) for one in CLASSES])
CLASS_OF_WORD = {word: NAMES.index(name) for word, name in HOUSE_WORDS.class_of_word.items()}


@dataclass(frozen=True)
class Chosen:
    """Names of weights, and folders with manifests of their own."""

    tagger: str
    detector: str
    segmenter: str
    model_dirs: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Networks:
    """The three networks, loaded."""

    tagger: Tagger
    detector: Detector
    segmenter: Segmenter

    @classmethod
    def of_a_run(cls, chosen: Chosen, threads: int) -> Networks:
        """As a run loads them. Raises ModelError, and ConfigError when one is of another task."""
        names = (chosen.tagger, chosen.detector, chosen.segmenter)
        return cls._of(names, [load(name, chosen.model_dirs, threads) for name in names])

    @classmethod
    def unfloored(cls, chosen: Chosen) -> Networks:
        """With floors and thresholds of the scores taken away, on one thread. Raises ModelError, ConfigError."""
        names = (chosen.tagger, chosen.detector, chosen.segmenter)
        return cls._of(names, [_unfloored(name, chosen.model_dirs) for name in names])

    @classmethod
    def _of(cls, names: Sequence[str], models: Sequence[object]) -> Networks:
        tagger, detector, segmenter = models
        if not isinstance(tagger, Tagger):
            raise ConfigError(f"--tagger: {names[0]!r} cannot tag images")
        if not isinstance(detector, Detector):
            raise ConfigError(f"--detector: {names[1]!r} cannot find boxes")
        if not isinstance(segmenter, Segmenter):
            raise ConfigError(f"--segmenter: {names[2]!r} cannot give masks for boxes")
        return cls(tagger, detector, segmenter)


def _unfloored(name: str, model_dirs: Sequence[Path]) -> object:
    weights = find_weights(name, model_dirs)
    options = import_module(f"{FAMILIES}.{weights.family}").Options
    floor = {"min_score": MIN_SCORE} if "min_score" in options.model_fields else {}
    with tempfile.TemporaryDirectory() as folder:
        files = dict(weights.files)
        if "thresholds" in files:  # RAM's floors are a file, one for each tag
            files["thresholds"] = Path(folder) / "thresholds.txt"
            files["thresholds"].write_text("0\n" * len(weights.class_names()))
        lowered = replace(weights, options=weights.options | floor, files=files)
        built: object = plugin(FAMILIES, weights.family, "FAMILY", "model family")(lowered, 1)
    return built


def network_scores(shards: Sequence[Shard], networks: Networks) -> dict[str, Any]:
    """Quality of the three networks, `unfloored`, on all views of the shards. Raises ModelError."""
    found_tags, true_tags, ious = [], [], [np.zeros(0)]
    by_name: list[FoundBoxes] = []
    by_synonym: list[FoundBoxes] = []
    whole: list[TrueBoxes] = []
    with_cut: list[TrueBoxes] = []
    for view in evaluation_views(shards):
        found_tags.append(tag_scores(networks.tagger.tag(view.color)))
        true_tags.append(view.tags)
        by_name.append(found_boxes(networks.detector.detect(view.color, NAMES)))
        by_synonym.append(found_boxes(networks.detector.detect(view.color, UNSAID)))
        whole.append(view.true_boxes(with_cut=False))
        with_cut.append(view.true_boxes(with_cut=True))
        masks = networks.segmenter.segment(view.color, view.depth_m, view.asked_boxes)
        ious.append(mask_overlaps(masks, view.asked_masks()))
    overlaps = np.concatenate(ious)
    return _summary(
        tags.average_precisions(np.array(found_tags), np.array(true_tags)),
        detection.average_precisions(by_name, whole, len(NAMES)),
        np.where(HAS_UNSAID, detection.average_precisions(by_synonym, whole, len(NAMES)), np.nan),
        detection.average_precisions(by_name, with_cut, len(NAMES)),
    ) | {
        "views": len(whole),
        "objects": sum(len(one.classes) for one in whole),
        "small": sum(int(one.ignored.sum()) for one in with_cut),
        "cut": sum(int((a.ignored & ~b.ignored).sum()) for a, b in zip(whole, with_cut, strict=True)),
        "segmenter_miou": mean_of_known(overlaps),
        "masks": int((~np.isnan(overlaps)).sum()),
    }


def _summary(tagger: F64, names: F64, unsaid: F64, with_cut: F64) -> dict[str, Any]:
    """Means and the table of average precisions (classes,)."""
    columns = {"tagger": tagger, "names": names, "unsaid": unsaid, "with_cut": with_cut}
    return {
        "tagger_map": mean_of_known(tagger),
        "tagger_classes": int((~np.isnan(tagger)).sum()),
        "detector_ap50": mean_of_known(names),
        "detector_classes": int((~np.isnan(names)).sum()),
        "detector_ap50_unsaid": mean_of_known(unsaid),
        "unsaid_classes": int((~np.isnan(unsaid)).sum()),
        "detector_ap50_with_cut": mean_of_known(with_cut),
        "classes": {
            name: {head: float(column[k]) for head, column in columns.items()}
            for k, name in enumerate(NAMES)
            if not np.isnan([tagger[k], with_cut[k]]).all()
        },
    }


def tag_scores(found: ScoredNames) -> F64:
    """(classes,) the best score of a word of each class, 0 for one that is not named."""
    scores = np.zeros(len(NAMES))
    for name, score in zip(found.names, found.scores.tolist(), strict=True):
        k = CLASS_OF_WORD.get(normal_form(name))
        if k is not None:
            scores[k] = max(scores[k], score)
    return scores


def found_boxes(found: NamedBoxes) -> FoundBoxes:
    """Boxes by class; those whose name is no word of a class are left out."""
    classes = np.array([CLASS_OF_WORD.get(normal_form(name), -1) for name in found.names], np.int64)
    known = classes >= 0
    return FoundBoxes(found.boxes_px[known].astype(np.float64), classes[known], found.scores[known].astype(np.float64))
