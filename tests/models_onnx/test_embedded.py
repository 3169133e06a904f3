"""The networks that travel in the package, on views of a house that no network was trained on. (smoke)"""

from pathlib import Path

import numpy as np
import pytest

from placegraph.models_onnx import Detector, Segmenter, Tagger
from placegraph.models_onnx.load import load
from placegraph.models_onnx.manifest import EMBEDDED_DIR
from placegraph.tools.evaluate.evaluation_views import EvaluationView, evaluation_views
from placegraph.tools.evaluate.network_metrics import mask_ious
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.training.data_augmentation import load_shards
from placegraph.tools.training.view_rendering import EVALUATION_SEEDS, render_house

MAX_BYTES = 4_000_000


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> list[EvaluationView]:
    folder: Path = tmp_path_factory.mktemp("views")
    render_house(EVALUATION_SEEDS[17], 10, folder)
    return list(evaluation_views(load_shards(folder)))


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    low, high = np.maximum(a[:2], b[:2]), np.minimum(a[2:], b[2:])
    shared = float(np.clip(high - low, 0, None).prod())
    return shared / float((a[2:] - a[:2]).prod() + (b[2:] - b[:2]).prod() - shared)


def test_each_file_is_small() -> None:
    assert {path.name for path in EMBEDDED_DIR.glob("*.onnx") if path.stat().st_size > MAX_BYTES} == set()


def test_the_tagger_says_most_of_what_is_there_and_not_much_else(views: list[EvaluationView]) -> None:
    tagger = load("house_tagger")
    assert isinstance(tagger, Tagger)
    right = wrong = shown = 0
    for view in views:
        said = set(tagger.tag(view.color).names)
        there = {NAMES[k] for k in np.flatnonzero(view.tags == 1)}
        unknown = {NAMES[k] for k in np.flatnonzero(np.isnan(view.tags))}
        right, wrong, shown = right + len(said & there), wrong + len(said - there - unknown), shown + len(there)
    # thresholds favour recall: what is not tagged is never looked for
    assert shown >= 20 and right >= 0.6 * shown and wrong <= 1.5 * right


def test_the_detector_finds_what_it_is_asked_for_also_by_words_it_never_heard(views: list[EvaluationView]) -> None:
    detector = load("house_detector")
    assert isinstance(detector, Detector)
    found = asked = 0
    for view in views:
        truth = view.true_boxes(with_cut=False)
        boxes = detector.detect(view.color, NAMES)
        for box, k, skip in zip(truth.boxes, truth.classes, truth.ignored, strict=True):
            asked += not skip
            found += not skip and any(
                name == NAMES[k] and overlap(box, one) >= 0.5
                for name, one in zip(boxes.names, boxes.boxes_px, strict=True)
            )
    assert asked >= 20 and found >= 0.4 * asked


def test_the_segmenter_fills_true_boxes(views: list[EvaluationView]) -> None:
    segmenter = load("house_segmenter")
    assert isinstance(segmenter, Segmenter)
    ious = [
        mask_ious(segmenter.segment(view.color, view.depth_m, view.prompt_boxes), view.prompt_masks())
        for view in views
        if len(view.prompt_boxes)
    ]
    assert np.nanmean(np.concatenate(ious)) >= 0.6
