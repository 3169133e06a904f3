"""Exports the trained location network to float and INT8 ONNX in the layout of models_onnx/yolo_locations.py."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from placegraph.nodes.hierarchy.birds_eye_view import SIZE_PX
from placegraph.tools.training.location_network import LocationExport, LocationNetwork
from placegraph.tools.training.location_training import LocationSamples
from placegraph.tools.training.onnx_export import Feeds, export_onnx, image_feed, quantize
from placegraph.tools.training.training_loop import read_average

NAME = "house_locations"
CALIBRATION_IMAGES = 200
CALIBRATION_SEED = 7
# last layers, and what joins distances, scores and coefficients
KEEP_FLOAT = (
    r"/network/heads\.\d/heads\.\d\.2/.*",
    r"/network/prototypes/.*",
    r"/network/Concat_[5-8]",
    r"/(Concat|Add)\w*",
)


def export_locations(checkpoint: Path, data: Path, folder: Path) -> tuple[Path, Path]:
    """Write FOLDER/float/house_locations.onnx and FOLDER/house_locations.onnx (INT8, ranges from scans of `data`)."""
    trained = read_average(checkpoint, LocationNetwork())
    assert isinstance(trained, LocationNetwork)
    float_file = export_onnx(
        LocationExport(trained, SIZE_PX, SIZE_PX),
        {"images": torch.rand(1, 3, SIZE_PX, SIZE_PX)},
        ["output0", "output1"],
        folder / "float" / f"{NAME}.onnx",
    )
    return float_file, quantize(float_file, folder / f"{NAME}.onnx", _feeds(data), KEEP_FLOAT)


def _feeds(data: Path) -> Iterator[Feeds]:
    samples = LocationSamples(data, CALIBRATION_SEED)
    for _ in range(CALIBRATION_IMAGES):
        image, _ = samples.sample()
        yield {"images": np.ascontiguousarray(image_feed(image))}
