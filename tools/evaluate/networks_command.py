"""Measure the embedded networks, through their families, on views of houses that they were never trained on."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import typer

from placegraph.tools.evaluate.evaluation_views import EvaluationView, evaluation_shards, evaluation_views
from placegraph.tools.evaluate.network_scores import NetworkNames, Networks, network_scores
from placegraph.tools.evaluate.report import number, plain, table
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.training.data_augmentation import Shard

TIMED_VIEWS = 24  # after one that warms up
THREADS = (1, 2)


def evaluate_networks(
    houses: Annotated[int, typer.Option(min=1, help="Evaluation houses.")] = 20,
    views: Annotated[int, typer.Option(min=1, help="Views of each.")] = 24,
    tagger: Annotated[str, typer.Option(help="Weights of the tagger.")] = "house_tagger",
    detector: Annotated[str, typer.Option(help="Weights of the detector.")] = "house_detector",
    segmenter: Annotated[str, typer.Option(help="Weights of the segmenter.")] = "house_segmenter",
    model_dirs: Annotated[
        list[Path] | None, typer.Option("--model-dir", help="Folder with a manifest.toml of more weights; repeatable.")
    ] = None,
    data: Annotated[Path, typer.Option(help="Folder where rendered views are kept.")] = Path("out/evaluation_views"),
    per_class: Annotated[bool, typer.Option("--per-class", help="Print average precisions by class.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Measure the networks on simulated houses that no training has seen.

    Average precision of tagger and detector, IoU of the segmenter, and ms of each.
    """
    names = NetworkNames(tagger, detector, segmenter, tuple(model_dirs or ()))
    loaded = Networks.load_without_thresholds(names)  # a wrong name is noticed before minutes of rendering
    shards = evaluation_shards(houses, views, data)
    scores = {"houses": houses} | network_scores(shards, loaded) | {"ms": network_times(shards, names)}
    print(json.dumps(plain(scores), sort_keys=True) if as_json else text(scores, per_class))


def network_times(shards: Sequence[Shard], names: NetworkNames) -> dict[str, dict[str, float]]:
    """Median ms of each network on a view, and their sum, by number of threads; the networks are those of a run.

    The detector gets all class names as prompts, the segmenter the true boxes. Raises ModelError, ConfigError.
    """
    views, times_by_threads = list(islice(evaluation_views(shards), TIMED_VIEWS + 1)), {}
    for threads in THREADS:
        times = _times(Networks.load(names, threads), views)
        times_by_threads[str(threads)] = times | {"sum": sum(times.values())}
    return times_by_threads


def _times(networks: Networks, views: Sequence[EvaluationView]) -> dict[str, float]:
    return {
        "tag": _median_ms(lambda view: networks.tagger.tag(view.color), views),
        "detect": _median_ms(lambda view: networks.detector.detect(view.color, NAMES), views),
        "segment": _median_ms(
            lambda view: networks.segmenter.segment(view.color, view.depth_m, view.prompt_boxes), views
        ),
    }


def _median_ms(action: Callable[[EvaluationView], object], views: Sequence[EvaluationView]) -> float:
    action(views[0])
    times = []
    for view in views[1:] or views:
        began = time.perf_counter()
        action(view)
        times.append((time.perf_counter() - began) * 1e3)
    return statistics.median(times)


def text(scores: dict[str, Any], per_class: bool) -> str:
    """The scores as lines; with `per_class` also a table of the classes."""
    synonyms = f"{number(scores['detector_ap50_unsaid'])} by untrained synonyms of {scores['unsaid_classes']} classes"
    lines = [
        f"{scores['views']} views of {scores['houses']} houses",
        f"tagger     mAP {number(scores['tagger_map'])} over {scores['tagger_classes']} classes",
        f"detector   AP50 {number(scores['detector_ap50'])} by name over {scores['detector_classes']} classes, "
        f"{synonyms}",
        f"           without cut objects; with them {number(scores['detector_ap50_with_cut'])}; of "
        f"{scores['objects']} objects {scores['small']} are too small to count, {scores['cut']} others are cut",
        f"segmenter  mIoU {number(scores['segmenter_miou'])} over {scores['masks']} objects",
    ]
    for threads, times in scores["ms"].items():
        each = ", ".join(f"{name} {number(ms, 1)}" for name, ms in times.items())
        lines.append(f"ms a frame, {threads} thread{'s' if threads != '1' else ' '}: {each}")
    if per_class:
        heads = ("tagger", "names", "unsaid", "with_cut")
        rows = [(name, *(number(row[head]) for head in heads)) for name, row in scores["classes"].items()]
        lines += ["", table([("class", *heads), *rows])]
    return "\n".join(lines)
