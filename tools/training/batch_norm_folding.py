"""Folds batch norm into convolutions, and reads the packaged weights back into a PyTorch network.

Batch norm takes half of a training step on a CPU. After the first training it is folded into the convolutions, which is
exact, and training continues without it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnx import numpy_helper
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.runtime.arrays import F32
from placegraph.runtime.errors import ModelError
from placegraph.tools.training.networks import Conv, ObjectNetwork, TextHead
from placegraph.tools.training.word_projection import KNOWN_WORDS, WordProjection, WordTable


def fold_batch_norm(network: ObjectNetwork) -> ObjectNetwork:
    """The network with every batch norm folded into its convolution, and a WordTable in place of WordProjection.

    Changes and returns `network` itself; its outputs stay the same for every word of the training.
    """
    assert isinstance(network.words, WordProjection), "already folded"
    network.eval()
    network.words = WordTable(network.words, torch.from_numpy(TextEncoder().encode(KNOWN_WORDS)))
    for module in list(network.modules()):
        if isinstance(module, Conv):
            module[0], module[1] = fuse_conv_bn_eval(module[0], module[1]), nn.Identity()
        elif isinstance(module, TextHead):
            module.embed[1], module.norm = fuse_conv_bn_eval(module.embed[1], module.norm), nn.Identity()
    return network.train()


def packaged_start(detector: Path, tagger: Path) -> ObjectNetwork:
    """A folded network with the weights of the packaged INT8 files: the detector, and the tagger's dense head.

    Where the network has more steps in a Csp than the files, the new ones start by adding nothing. Raises ModelError
    when weights are missing.
    """
    network = fold_batch_norm(ObjectNetwork())
    packaged = {name.removeprefix("network."): weights for name, weights in _weights_by_module(detector).items()}
    packaged |= {name: weights for name, weights in _weights_by_module(tagger).items() if name.startswith("dense.")}
    state = network.state_dict()
    known = {name: weights for name, weights in packaged.items() if name in state}
    grown = {name.rsplit(".", 1)[0] for name in state if ".steps." in name and name not in known}
    lost = [name for name in state if name not in known and name.rsplit(".", 1)[0] not in grown]
    if lost:
        raise ModelError(f"{detector}, {tagger}: no weights for {', '.join(lost[:3])} of {len(lost)}")
    network.load_state_dict(state | {name: _pad_inputs(weights, state[name], name) for name, weights in known.items()})
    return network


def _pad_inputs(weights: F32, place: Tensor, name: str) -> Tensor:
    """Weights with zero columns for new input channels."""
    start = torch.from_numpy(weights.copy())
    if start.shape == place.shape:
        return start
    if start.ndim != 4 or start.shape[0] != place.shape[0] or start.shape[1] > place.shape[1]:
        raise ModelError(f"{name}: weights of shape {tuple(start.shape)} do not fit {tuple(place.shape)}")
    wide = torch.zeros_like(place)
    wide[:, : start.shape[1]] = start
    return wide


def _weights_by_module(file: Path) -> dict[str, F32]:
    """Float weights of an ONNX file by PyTorch module name, read from the names of its nodes."""
    graph = onnx.load(str(file)).graph
    plain = {weights.name: numpy_helper.to_array(weights) for weights in graph.initializer}
    for node in graph.node:
        if node.op_type == "DequantizeLinear" and node.input[0] in plain:
            plain[node.output[0]] = _dequantized(*(plain[name] for name in node.input))
    by_module = {name: weights for name, weights in plain.items() if weights.dtype == np.float32}
    for node in graph.node:
        if node.op_type == "Conv":
            module = _module_name(node.name)
            by_module[f"{module}.weight"], by_module[f"{module}.bias"] = plain[node.input[1]], plain[node.input[2]]
        elif node.op_type == "MatMul" and node.input[1] in plain:
            by_module[f"{_module_name(node.name)}.weight"] = plain[node.input[1]].T
    return by_module


def _dequantized(values: NDArray[np.int8], scale: F32, zero: NDArray[np.int8]) -> F32:
    by_channel = (-1,) + (1,) * (values.ndim - 1)
    off = values.astype(np.float32) - zero.astype(np.float32).reshape(by_channel if zero.size > 1 else ())
    return np.asarray(off * scale.reshape(by_channel if scale.size > 1 else ()), np.float32)


def _module_name(node: str) -> str:
    """`/stem/stem.0/stem.0.0/Conv` is the node of the module stem.0.0."""
    parts: list[str] = []
    for part in node.split("/")[1:-1]:
        if parts and part.startswith(f"{parts[-1]}."):
            parts.pop()
        parts.append(part)
    return ".".join(parts)
