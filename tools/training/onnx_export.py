"""Exports networks to ONNX in the layouts that models_onnx reads, and quantises them to INT8."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
from onnxruntime.quantization.shape_inference import quant_pre_process
from torch import Tensor, nn

from placegraph.runtime.arrays import F32, U8

OPSET = 17  # read by onnxruntime 1.20 and later
# convolutions and data movement; the arithmetic of the last layers stays float
QUANTIZED = ("Conv", "Add", "Concat", "MaxPool", "Resize", "Relu")

Feeds = dict[str, NDArray[Any]]


def export_onnx(
    network: nn.Module,
    inputs: Mapping[str, Tensor],
    outputs: Sequence[str],
    file: Path,
    open_axes: Mapping[str, Mapping[int, str]] | None = None,
) -> Path:
    """Writes `network` as a float ONNX file; `inputs` are examples by name, in order."""
    file.parent.mkdir(parents=True, exist_ok=True)
    network = network.float().eval().to(memory_format=torch.contiguous_format)
    torch.onnx.export(
        network,
        tuple(inputs.values()),
        str(file),
        input_names=list(inputs),
        output_names=list(outputs),
        dynamic_axes={name: dict(axes) for name, axes in (open_axes or {}).items()},
        opset_version=OPSET,
        dynamo=False,  # the newer exporter needs onnxscript and gives the same graph
    )
    return file


class _FeedReader(CalibrationDataReader):
    def __init__(self, feeds: Iterator[Feeds]) -> None:
        self._feeds = feeds

    def get_next(self) -> Feeds | None:
        return next(self._feeds, None)


def quantize(float_file: Path, file: Path, feeds: Iterator[Feeds], keep_float: Sequence[str] = ()) -> Path:
    """Writes `float_file` as static INT8 (QDQ, weights by channel) with ranges from `feeds`.

    keep_float: patterns of the names of nodes that stay float. Nodes that join numbers of different kinds (px and
    scores) must, because one INT8 range cannot hold both.
    """
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared.onnx"
        quant_pre_process(str(float_file), str(prepared), skip_symbolic_shape=True)
        nodes = [node.name for node in onnx.load(prepared).graph.node]
        quantize_static(
            str(prepared),
            str(file),
            _FeedReader(feeds),
            quant_format=QuantFormat.QDQ,
            per_channel=True,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            op_types_to_quantize=list(QUANTIZED),
            nodes_to_exclude=[name for name in nodes if any(re.fullmatch(pattern, name) for pattern in keep_float)],
        )
    return file


def image_feed(color: U8) -> F32:
    """(H, W, 3) uint8 to (1, 3, H, W) in 0..1."""
    return np.ascontiguousarray(color.transpose(2, 0, 1)[None].astype(np.float32) / np.float32(255))
