"""Fits the network of the drawn scene and writes models_onnx/embedded/drawn_scene.onnx.

Chromaticity and brightness of a pixel go through one hidden layer of 1x1 convolutions to class logits, which are
averaged over 3x3 pixels. It is fitted in numpy within seconds, to frames with other noise and tints than those it is
measured on, and works for the colours of this scene only.
"""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from placegraph import models_onnx
from placegraph.models_onnx.manifest import Weights
from placegraph.models_onnx.semantic import FAMILY
from placegraph.nodes.camera._flat_scene import CLASSES
from placegraph.nodes.camera.flat import SOURCE
from placegraph.runtime.arrays import F32, U8

OUTPUT = Path(str(models_onnx.__file__)).parent / "embedded" / "drawn_scene.onnx"
TRAIN_SEEDS = range(100, 124)
TEST_SEEDS = (0, 1, 2)  # 0 is that of configs/flat.toml
HIDDEN = 24
DARK = 0.05  # added to the sum of the channels: keeps the chromaticity of black from being noise alone
STEPS, BATCH, RATE = 4000, 4096, 0.01
PER_CLASS = 16_000  # pixels; the building gets four times as many, for it covers most of an image
OPSET, IR_VERSION = 17, 9  # read by onnxruntime 1.20 and later


def main(argv: Sequence[str] | None = None) -> int:
    """Fit, write, measure."""
    parser = argparse.ArgumentParser(prog="placegraph drawn_scene_network", description=__doc__)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    arguments = parser.parse_args(argv)
    pixels, labels = training_pixels()
    layers = fit(features(pixels), labels)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_bytes(build(layers))
    data = arguments.output.read_bytes()
    print(f"{arguments.output}: {len(data)} bytes, sha256 {hashlib.sha256(data).hexdigest()}")
    for seed in TEST_SEEDS:
        accuracy, by_class = measure_accuracy(arguments.output, seed)
        weakest = min(by_class, key=lambda name: by_class[name])
        mean = sum(by_class.values()) / len(by_class)
        worst = f"{weakest} {by_class[weakest]:.4f}"
        print(f"seed {seed}: pixel accuracy {accuracy:.4f}, mean IoU {mean:.4f}, weakest {worst}")
    return 0


def training_pixels() -> tuple[U8, U8]:
    """Colours (N, 3) uint8 sRGB and classes (N,) of pixels from all training seeds, balanced between classes."""
    colors, labels = [], []
    for seed in TRAIN_SEEDS:
        source = SOURCE(Path(), {"seed": seed, "width": 160, "height": 120, "frames": 20})
        for frame_id in range(len(source.poses)):
            color, _, label = source.render(frame_id)
            colors.append(color.reshape(-1, 3))
            labels.append(label.ravel())
    color, label = np.concatenate(colors), np.concatenate(labels)
    random = np.random.default_rng(0)
    chosen = [
        random.choice(np.flatnonzero(label == index), PER_CLASS * (4 if index == 0 else 1))
        for index in range(len(CLASSES))
    ]
    index = np.concatenate(chosen)
    return color[index], label[index]


def features(pixels: U8) -> F32:
    """Colours (N, 3) uint8 to (N, 4): chromaticity and brightness, as the network's first nodes compute them."""
    rgb = pixels.astype(np.float32) / 255
    total = rgb.sum(axis=1, keepdims=True)
    return np.concatenate((rgb / (total + DARK), total), axis=1)


def fit(inputs: F32, labels: U8) -> list[F32]:
    """Weights and biases of both layers, by softmax regression with Adam (Kingma and Ba 2015, their constants)."""
    random = np.random.default_rng(1)
    mean, spread = inputs.mean(axis=0), inputs.std(axis=0)
    inputs = (inputs - mean) / spread
    layers: list[F32] = [
        random.normal(0, 1, (4, HIDDEN)).astype(np.float32),
        np.zeros(HIDDEN, np.float32),
        random.normal(0, HIDDEN**-0.5, (HIDDEN, len(CLASSES))).astype(np.float32),
        np.zeros(len(CLASSES), np.float32),
    ]
    first = [np.zeros_like(layer) for layer in layers]
    second = [np.zeros_like(layer) for layer in layers]
    for step in range(1, STEPS + 1):
        batch = random.integers(0, len(inputs), BATCH)
        gradients = _gradients(layers, inputs[batch], labels[batch])
        rate = RATE * (1 - step / STEPS)
        for layer, gradient, m, v in zip(layers, gradients, first, second, strict=True):
            m += 0.1 * (gradient - m)
            v += 0.001 * (gradient * gradient - v)
            layer -= rate * (m / (1 - 0.9**step)) / (np.sqrt(v / (1 - 0.999**step)) + 1e-8)
    # the standardisation goes into the first layer
    weight = layers[0] / spread[:, None]
    return [weight, layers[1] - mean @ weight, layers[2], layers[3]]


def _gradients(layers: list[F32], inputs: F32, labels: U8) -> list[F32]:
    """Of the mean cross entropy, in the order of the layers."""
    hidden = np.maximum(inputs @ layers[0] + layers[1], 0)
    logits = hidden @ layers[2] + layers[3]
    error = np.exp(logits - logits.max(axis=1, keepdims=True))
    error /= error.sum(axis=1, keepdims=True)
    error[np.arange(len(labels)), labels] -= 1
    error /= len(labels)
    back = (error @ layers[2].T) * (hidden > 0)
    return [inputs.T @ back, back.sum(axis=0), hidden.T @ error, error.sum(axis=0)]


def build(layers: list[F32]) -> bytes:
    """The ONNX file: image (1, 3, H, W) in 0..1 to logits (1, C, H, W)."""
    import onnx  # an extra of development: only this script writes networks
    from onnx import TensorProto, helper, numpy_helper

    def convolution(weight: F32) -> F32:
        return np.ascontiguousarray(weight.T, np.float32)[:, :, None, None]

    constants = {
        "ones": np.ones((1, 3, 1, 1), np.float32),
        "dark": np.array(DARK, np.float32),
        "w1": convolution(layers[0]),
        "b1": layers[1].astype(np.float32),
        "w2": convolution(layers[2]),
        "b2": layers[3].astype(np.float32),
    }
    nodes = [
        helper.make_node("Conv", ["image", "ones"], ["total"]),
        helper.make_node("Add", ["total", "dark"], ["divisor"]),
        helper.make_node("Div", ["image", "divisor"], ["chromaticity"]),
        helper.make_node("Concat", ["chromaticity", "total"], ["features"], axis=1),
        helper.make_node("Conv", ["features", "w1", "b1"], ["hidden"]),
        helper.make_node("Relu", ["hidden"], ["active"]),
        helper.make_node("Conv", ["active", "w2", "b2"], ["pixel_logits"]),
        helper.make_node("AveragePool", ["pixel_logits"], ["logits"], kernel_shape=[3, 3], pads=[1, 1, 1, 1]),
    ]
    graph = helper.make_graph(
        nodes,
        "drawn_scene",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, "height", "width"])],
        [helper.make_tensor_value_info("logits", TensorProto.FLOAT, [1, len(CLASSES), "height", "width"])],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="placegraph")
    model.ir_version = IR_VERSION
    onnx.checker.check_model(model, full_check=True)
    return bytes(model.SerializeToString(deterministic=True))


def measure_accuracy(file: Path, seed: int) -> tuple[float, dict[str, float]]:
    """Share of right pixels and IoU of each class, over the whole walk at its own size, by the family that runs it."""
    family = FAMILY(Weights("drawn_scene", "semantic", {"model": file}, CLASSES, {}), 1)
    source = SOURCE(Path(), {"seed": seed, "frames": 50})
    size = len(CLASSES)
    counts = np.zeros((size, size), np.int64)
    for frame_id in range(len(source.poses)):
        color, _, truth = source.render(frame_id)
        found, _ = family.classify(color)
        counts += np.bincount(truth.ravel() * size + found.ravel(), minlength=size * size).reshape(size, size)
    right = counts.diagonal()
    union = counts.sum(axis=0) + counts.sum(axis=1) - right
    return float(right.sum() / counts.sum()), dict(zip(CLASSES, (right / union).tolist(), strict=True))


if __name__ == "__main__":
    raise SystemExit(main())
