"""Quality of tagger, detector and segmenter on views with ground truth."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
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
from placegraph.tools.evaluate.evaluation_views import evaluation_views
from placegraph.tools.evaluate.house_truth import HOUSE_VOCABULARY
from placegraph.tools.evaluate.network_metrics import (
    DetectedBoxes,
    TrueBoxes,
    box_average_precisions,
    mask_ious,
    mean_of_defined,
    tag_average_precisions,
)
from placegraph.tools.simulator.object_classes import CLASSES, NAMES
from placegraph.tools.training.data_augmentation import Shard

FAMILIES = "placegraph.models_onnx"
MIN_SCORE = 0.01  # instead of a run's own threshold: average precision needs the order of all detections
# The first synonym of each class that no training used as a prompt; its name where there is none.
UNTRAINED_SYNONYMS = tuple(cls.held_out_words[0] if cls.held_out_words else cls.name for cls in CLASSES)
HAS_UNTRAINED_SYNONYM = np.array([bool(cls.held_out_words) for cls in CLASSES])
CLASS_OF_WORD = {word: NAMES.index(name) for word, name in HOUSE_VOCABULARY.class_of_word.items()}


@dataclass(frozen=True)
class NetworkNames:
    """Names of the three networks' weights, and folders with more manifests."""

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
    def load(cls, names: NetworkNames, threads: int) -> Networks:
        """As a run loads them. Raises ModelError, and ConfigError when one does another task."""
        return cls._load(names, lambda name: load(name, names.model_dirs, threads))

    @classmethod
    def load_without_thresholds(cls, names: NetworkNames) -> Networks:
        """Without score thresholds, on one thread. Raises ModelError, ConfigError."""
        return cls._load(names, lambda name: _load_without_thresholds(name, names.model_dirs))

    @classmethod
    def _load(cls, names: NetworkNames, load_one: Callable[[str], object]) -> Networks:
        tagger, detector, segmenter = (load_one(name) for name in (names.tagger, names.detector, names.segmenter))
        if not isinstance(tagger, Tagger):
            raise ConfigError(f"--tagger: {names.tagger!r} cannot tag images")
        if not isinstance(detector, Detector):
            raise ConfigError(f"--detector: {names.detector!r} cannot find boxes")
        if not isinstance(segmenter, Segmenter):
            raise ConfigError(f"--segmenter: {names.segmenter!r} cannot give masks for boxes")
        return cls(tagger, detector, segmenter)


def _load_without_thresholds(name: str, model_dirs: Sequence[Path]) -> object:
    weights = find_weights(name, model_dirs)
    options = import_module(f"{FAMILIES}.{weights.family}").Options
    min_score = {"min_score": MIN_SCORE} if "min_score" in options.model_fields else {}
    with tempfile.TemporaryDirectory() as folder:
        files = dict(weights.files)
        if "thresholds" in files:  # RAM has a file with a threshold for each tag
            files["thresholds"] = Path(folder) / "thresholds.txt"
            files["thresholds"].write_text("0\n" * len(weights.class_names()))
        changed = replace(weights, options=weights.options | min_score, files=files)
        network: object = plugin(FAMILIES, weights.family, "FAMILY", "model family")(changed, 1)
    return network


def network_scores(shards: Sequence[Shard], networks: Networks) -> dict[str, Any]:
    """Quality of the three networks, loaded without thresholds, on all views of the shards. Raises ModelError."""
    tag_rows, true_tags, ious = [], [], [np.zeros(0)]
    by_name: list[DetectedBoxes] = []
    by_synonym: list[DetectedBoxes] = []
    whole: list[TrueBoxes] = []
    with_cut: list[TrueBoxes] = []
    for view in evaluation_views(shards):
        tag_rows.append(tag_scores(networks.tagger.tag(view.color)))
        true_tags.append(view.tags)
        by_name.append(detected_boxes(networks.detector.detect(view.color, NAMES)))
        by_synonym.append(detected_boxes(networks.detector.detect(view.color, UNTRAINED_SYNONYMS)))
        whole.append(view.true_boxes(with_cut=False))
        with_cut.append(view.true_boxes(with_cut=True))
        masks = networks.segmenter.segment(view.color, view.depth_m, view.prompt_boxes)
        ious.append(mask_ious(masks, view.prompt_masks()))
    all_ious = np.concatenate(ious)
    synonyms = box_average_precisions(by_synonym, whole, len(NAMES))
    return _summary(
        tag_average_precisions(np.array(tag_rows), np.array(true_tags)),
        box_average_precisions(by_name, whole, len(NAMES)),
        np.where(HAS_UNTRAINED_SYNONYM, synonyms, np.nan),
        box_average_precisions(by_name, with_cut, len(NAMES)),
    ) | {
        "views": len(whole),
        "objects": sum(len(boxes.classes) for boxes in whole),
        "small": sum(int(boxes.ignored.sum()) for boxes in with_cut),
        "cut": sum(int((a.ignored & ~b.ignored).sum()) for a, b in zip(whole, with_cut, strict=True)),
        "segmenter_miou": mean_of_defined(all_ious),
        "masks": int((~np.isnan(all_ious)).sum()),
    }


def _summary(tagger: F64, names: F64, unsaid: F64, with_cut: F64) -> dict[str, Any]:
    """Means and the table of average precisions (classes,)."""
    columns = {"tagger": tagger, "names": names, "unsaid": unsaid, "with_cut": with_cut}
    return {
        "tagger_map": mean_of_defined(tagger),
        "tagger_classes": int((~np.isnan(tagger)).sum()),
        "detector_ap50": mean_of_defined(names),
        "detector_classes": int((~np.isnan(names)).sum()),
        "detector_ap50_unsaid": mean_of_defined(unsaid),
        "unsaid_classes": int((~np.isnan(unsaid)).sum()),
        "detector_ap50_with_cut": mean_of_defined(with_cut),
        "classes": {
            name: {head: float(column[k]) for head, column in columns.items()}
            for k, name in enumerate(NAMES)
            if not np.isnan([tagger[k], with_cut[k]]).all()
        },
    }


def tag_scores(tags: ScoredNames) -> F64:
    """(classes,) the best score of any word of each class; 0 for a class that is not named."""
    scores = np.zeros(len(NAMES))
    for name, score in zip(tags.names, tags.scores.tolist(), strict=True):
        k = CLASS_OF_WORD.get(normal_form(name))
        if k is not None:
            scores[k] = max(scores[k], score)
    return scores


def detected_boxes(boxes: NamedBoxes) -> DetectedBoxes:
    """Boxes by class; those whose name is no word of a class are left out."""
    classes = np.array([CLASS_OF_WORD.get(normal_form(name), -1) for name in boxes.names], np.int64)
    kept = classes >= 0
    return DetectedBoxes(boxes.boxes_px[kept].astype(np.float64), classes[kept], boxes.scores[kept].astype(np.float64))
