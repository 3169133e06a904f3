"""Packages trained networks: float and INT8 ONNX files, and the tagger's labels and thresholds."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from placegraph.models_onnx.session import Session
from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.training.batch_norm_folding import fold_batch_norm
from placegraph.tools.training.data_augmentation import Augmentation, TrainingSample, load_shards
from placegraph.tools.training.detection_losses import tag_targets
from placegraph.tools.training.detector_training import SIZES, read_refined
from placegraph.tools.training.mask_networks import MaskEncoder
from placegraph.tools.training.networks import DetectorExport, ObjectNetwork, TaggerNetwork
from placegraph.tools.training.onnx_export import Feeds, export_onnx, image_feed, quantize
from placegraph.tools.training.segmenter_training import SIZE as MASK_SIZE
from placegraph.tools.training.segmenter_training import MaskNetwork
from placegraph.tools.training.tagger_training import SIZE as TAG_SIZE
from placegraph.tools.training.training_loop import read_average

CALIBRATION_VIEWS = 160
MIN_SHOWN = 12
CALIBRATION_SEED = 5
MEAN = np.array([0.485, 0.456, 0.406], np.float32)[:, None, None]
STD = np.array([0.229, 0.224, 0.225], np.float32)[:, None, None]
# last layers, whose small differences matter, and nodes that join pixels and scores
KEEP_FLOAT = {
    "detector": (
        r"/network/boxes\.\d/boxes\.\d\.1/.*",
        r"/network/(words|texts\.\d)/(?!embed).*",
        r"(/network)?/(Concat|Add)\w*",
    ),
    "tagger": (r"/words/.*", r"/(dense|texts\.\d)/(?!embed).*", r"/(Concat|Add|Mul)\w*"),
    "mask_encoder": ("/Concat", "/Concat_4", r"/to2/to2\.0/.*"),
    "mask_decoder": ("/mask/Conv", r"/Add\w*", r"/Concat(_1|_2)?", "/enter/.*"),
}


def package_networks(work: Path, calibration: Path) -> Iterator[str]:
    """Writes WORK/onnx: each trained network as float and INT8, tags and thresholds; yields a line per file.

    Raises ConfigError when nothing is trained yet.
    """
    trained = [part for name, part in PARTS.items() if (work / name).exists()]
    if not trained:
        raise ConfigError(f"{work}: no {', '.join(PARTS)}: nothing is trained yet, see `placegraph train`")
    for part in trained:
        yield from part(work, calibration, work / "onnx")


def _pack_detector(work: Path, calibration: Path, folder: Path) -> Iterator[str]:
    views = _views(calibration, *SIZES[-1], squash=False)
    yield from _quantize_and_list(
        _export_detector(work, folder), folder, "house_detector", _detector_feeds(views), KEEP_FLOAT["detector"]
    )


def _pack_tagger(work: Path, calibration: Path, folder: Path) -> Iterator[str]:
    views = _views(calibration, TAG_SIZE, TAG_SIZE, squash=True)
    yield from _quantize_and_list(
        _export_tagger(work, folder), folder, "house_tagger", _tagger_feeds(views), KEEP_FLOAT["tagger"]
    )
    (folder / "house_tags.txt").write_text("".join(f"{name}\n" for name in NAMES))
    chosen = thresholds(_scores(folder / "house_tagger.onnx", views), tag_targets(views).numpy())
    (folder / "house_tag_thresholds.txt").write_text("".join(f"{value:.3f}\n" for value in chosen))


def _pack_masks(work: Path, calibration: Path, folder: Path) -> Iterator[str]:
    views = _views(calibration, *MASK_SIZE, squash=False)
    encoder, decoder = _export_masks(work, folder)
    yield from _quantize_and_list(
        encoder, folder, "house_mask_encoder", _encoder_feeds(views), KEEP_FLOAT["mask_encoder"]
    )
    yield from _quantize_and_list(
        decoder, folder, "house_mask_decoder", _decoder_feeds(work, views), KEEP_FLOAT["mask_decoder"]
    )


PARTS = {"refined.pt": _pack_detector, "tags.pt": _pack_tagger, "masks.pt": _pack_masks}


def _quantize_and_list(
    float_file: Path, folder: Path, name: str, feeds: Iterator[Feeds], keep: tuple[str, ...]
) -> Iterator[str]:
    quantized = quantize(float_file, folder / f"{name}.onnx", feeds, keep)
    for file in (float_file, quantized):
        data = file.read_bytes()
        yield f"{file.relative_to(folder)}: size_bytes = {len(data)}, sha256 = {hashlib.sha256(data).hexdigest()}"


def _views(calibration: Path, height: int, width: int, squash: bool) -> list[TrainingSample]:
    augment = Augmentation(load_shards(calibration), height, width, CALIBRATION_SEED, squash, varied=False)
    return [augment.sample() for _ in range(CALIBRATION_VIEWS)]


def _export_detector(work: Path, folder: Path) -> Path:
    network = read_refined(work / "refined.pt")
    height, width = SIZES[-1]
    return export_onnx(
        DetectorExport(network, height, width),
        {"images": torch.rand(1, 3, height, width), "text": torch.rand(1, 3, 256)},
        ["output"],
        folder / "float" / "house_detector.onnx",
        {"text": {1: "N"}, "output": {1: "4+N"}},
    )


def _detector_feeds(views: list[TrainingSample]) -> Iterator[Feeds]:
    text = TextEncoder().encode(NAMES)[None]
    return ({"images": image_feed(view.color), "text": text} for view in views)


def _export_tagger(work: Path, folder: Path) -> Path:
    text = torch.from_numpy(TextEncoder().encode(NAMES))
    network = read_average(work / "tags.pt", TaggerNetwork(fold_batch_norm(ObjectNetwork()), text))
    return export_onnx(
        network, {"images": torch.rand(1, 3, TAG_SIZE, TAG_SIZE)}, ["logits"], folder / "float" / "house_tagger.onnx"
    )


def _tagger_feeds(views: list[TrainingSample]) -> Iterator[Feeds]:
    return ({"images": ((image_feed(view.color)[0] - MEAN) / STD)[None]} for view in views)


def _scores(tagger: Path, views: list[TrainingSample]) -> F64:
    session = Session(tagger)
    logits = np.concatenate([session.run(feeds)["logits"] for feeds in _tagger_feeds(views)])
    return np.asarray(1 / (1 + np.exp(-logits.astype(float))))


def thresholds(scores: F64, shown: F32) -> list[float]:
    """The threshold of each tag with the best F2, which favours recall: what is not tagged is never detected.

    scores and shown: (views, tags); shown is 1, 0 or nan (unknown). Tags shown less than `MIN_SHOWN` times take the
    threshold that is best for all tags together.
    """
    common = _best_f2(scores.ravel(), shown.ravel())
    return [
        _best_f2(scores[:, k], shown[:, k]) if np.nansum(shown[:, k]) >= MIN_SHOWN else common
        for k in range(scores.shape[1])
    ]


def _best_f2(scores: F64, shown: F32) -> float:
    known = ~np.isnan(shown)
    scores, true = scores[known], shown[known] > 0
    best = (-1.0, 0.5)
    for value in np.arange(0.05, 0.65, 0.025).tolist():
        predicted = scores > value
        hits = float((predicted & true).sum())
        f2 = 5 * hits / max(4 * float(true.sum()) + float(predicted.sum()), 1.0)
        best = max(best, (f2, value))
    return best[1]


def _export_masks(work: Path, folder: Path) -> tuple[Path, Path]:
    network = read_average(work / "masks.pt", MaskNetwork())
    height, width = MASK_SIZE
    encoder = export_onnx(
        network.encoder,
        {"images": torch.rand(1, 3, height, width), "depth": torch.rand(1, 1, height, width)},
        ["image_embeddings"],
        folder / "float" / "house_mask_encoder.onnx",
    )
    decoder = export_onnx(
        network.decoder,
        {
            "image_embeddings": torch.rand(1, MaskEncoder.CHANNELS, height // 2, width // 2),
            "boxes": torch.tensor([[0.1, 0.1, 0.5, 0.6], [0.2, 0.2, 0.9, 0.8]]),
        },
        ["masks", "iou_predictions"],
        folder / "float" / "house_mask_decoder.onnx",
        {"boxes": {0: "N"}, "masks": {0: "N"}, "iou_predictions": {0: "N"}},
    )
    return encoder, decoder


def _encoder_feeds(views: list[TrainingSample]) -> Iterator[Feeds]:
    return ({"images": image_feed(view.color), "depth": view.depth[None, None]} for view in views)


def _decoder_feeds(work: Path, views: list[TrainingSample]) -> Iterator[Feeds]:
    encoder = read_average(work / "masks.pt", MaskNetwork()).encoder
    height, width = MASK_SIZE
    for view in views:
        boxes = view.boxes[view.counts] / np.array([width, height, width, height], np.float32)
        if not len(boxes):
            continue
        with torch.no_grad():
            embedding = encoder(torch.from_numpy(image_feed(view.color)), torch.from_numpy(view.depth[None, None]))
        yield {"image_embeddings": embedding.numpy(), "boxes": boxes.astype(np.float32)}
