"""Tiny ONNX networks with the published inputs and outputs of each family, whose results are known by hand.

Each depends on a few pixels of its input, so that a wrong channel order, scale or place of the image shows. Tests call
these functions; `write_models` puts one of each into a folder, with its manifest. By hand:

    python tests/models_onnx/make_tiny_models.py FOLDER
"""

import hashlib
import sys
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

FLOAT = TensorProto.FLOAT


def _save(path, nodes, inputs, outputs, constants):
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info(name, FLOAT, shape) for name, shape in inputs.items()],
        [helper.make_tensor_value_info(name, FLOAT, shape) for name, shape in outputs.items()],
        [
            numpy_helper.from_array(np.asarray(v, np.int64 if np.asarray(v).dtype.kind == "i" else np.float32), k)
            for k, v in constants.items()
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    onnx.checker.check_model(model)
    onnx.save(model, path)
    return path


def _pixel(channel, row, column):
    """Nodes and constants that put one number of `images` (1, 3, S, S) into `pixel` (1, 1, 1)."""
    nodes = [
        helper.make_node("Slice", ["images", "from", "to", "axes"], ["pixel4"]),
        helper.make_node("Reshape", ["pixel4", "one"], ["pixel"]),
    ]
    at = np.array([channel, row, column], np.int64)
    return nodes, {"from": at, "to": at + 1, "axes": np.array([1, 2, 3]), "one": np.array([1, 1, 1])}


def yolox(path, rows, classes=2, size=64):
    """YOLOX: `rows` {anchor: (5 + C) raw numbers}; objectness is scaled by the first pixel's blue of 0..255 / 255."""
    anchors = sum((size // stride) ** 2 for stride in (8, 16, 32))
    fixed = np.zeros((1, anchors, 5 + classes), np.float32)
    scaled = np.zeros_like(fixed)
    for anchor, row in rows.items():
        fixed[0, anchor] = row
    scaled[0, :, 4] = fixed[0, :, 4] / 255
    fixed[0, :, 4] = 0
    nodes, constants = _pixel(0, 0, 0)
    nodes += [
        helper.make_node("Mul", ["scaled", "pixel"], ["lit"]),
        helper.make_node("Add", ["fixed", "lit"], ["output"]),
    ]
    return _save(
        path,
        nodes,
        {"images": [1, 3, size, size]},
        {"output": [1, anchors, 5 + classes]},
        {**constants, "fixed": fixed, "scaled": scaled},
    )


def _yolo_head(rows, classes, size):
    """Boxes fixed, scores and coefficients too, class scores scaled by the middle pixel's red of 0..1."""
    table = np.asarray(rows, np.float32).T[None]
    gain = np.zeros_like(table)
    gain[:, 4 : 4 + classes] = table[:, 4 : 4 + classes]
    table = table - gain
    nodes, constants = _pixel(0, size // 2, size // 2)
    nodes += [
        helper.make_node("Mul", ["gain", "pixel"], ["lit"]),
        helper.make_node("Add", ["table", "lit"], ["output0"]),
    ]
    return nodes, {**constants, "table": table, "gain": gain}, list(table.shape)


def yolo(path, rows, classes=2, size=64):
    """YOLOv8 export: `rows` (A, 4 + C)."""
    nodes, constants, shape = _yolo_head(rows, classes, size)
    return _save(path, nodes, {"images": [1, 3, size, size]}, {"output0": shape}, constants)


def yolo_seg(path, rows, prototypes, classes=2, size=64):
    """YOLOv8-seg export: `rows` (A, 4 + C + 32), `prototypes` (32, h, w)."""
    nodes, constants, shape = _yolo_head(rows, classes, size)
    nodes.append(helper.make_node("Identity", ["prototypes"], ["output1"]))
    constants["prototypes"] = np.asarray(prototypes, np.float32)[None]
    outputs = {"output0": shape, "output1": list(constants["prototypes"].shape)}
    return _save(path, nodes, {"images": [1, 3, size, size]}, outputs, constants)


def yolo_prompted(path, centers, features, slots="N", size=64):
    """YOLO-World export: anchor i at `centers` (A, 4) scores a text by its product with `features` (A, D) row i."""
    features = np.asarray(features, np.float32)
    nodes, constants = _pixel(0, size // 2, size // 2)
    nodes += [
        helper.make_node("MatMul", ["txt_feats", "features"], ["likeness"]),
        helper.make_node("Mul", ["likeness", "pixel"], ["scores"]),
        helper.make_node("Concat", ["centers", "scores"], ["output0"], axis=1),
    ]
    constants |= {"features": features.T, "centers": np.asarray(centers, np.float32).T[None]}
    rows = 4 + slots if isinstance(slots, int) else "rows"
    inputs = {"images": [1, 3, size, size], "txt_feats": [1, slots, features.shape[1]]}
    return _save(path, nodes, inputs, {"output0": [1, rows, len(features)]}, constants)


def channel_means(path, weights, size, name="input", output="logits"):
    """Classifier and RAM layout: logits = `weights` (C, 3) times the mean of each channel of (1, 3, size, size)."""
    nodes = [
        helper.make_node("GlobalAveragePool", [name], ["pooled"]),
        helper.make_node("Flatten", ["pooled"], ["means"]),
        helper.make_node("MatMul", ["means", "weights"], [output]),
    ]
    weights = np.asarray(weights, np.float32)
    return _save(path, nodes, {name: [1, 3, size, size]}, {output: [1, len(weights)]}, {"weights": weights.T})


def sam_encoder(path, raw=False):
    """SAM encoder: channel 0 of the embedding is the brightness (mean over channels) averaged over 16 x 16 px.

    `raw`: the export with its preprocessing inside, input (H, W, 3), here only for images of 1024 x 1024.
    """
    name = "input_image"
    nodes, source = [], name
    if raw:
        nodes = [
            helper.make_node("Transpose", [name], ["chw"], perm=[2, 0, 1]),
            helper.make_node("Unsqueeze", ["chw", "axis"], ["nchw"]),
        ]
        source = "nchw"
    nodes += [
        helper.make_node("ReduceMean", [source], ["grey"], axes=[1], keepdims=1),
        helper.make_node("AveragePool", ["grey"], ["small"], kernel_shape=[16, 16], strides=[16, 16]),
        helper.make_node("Tile", ["small", "times"], ["image_embeddings"]),
    ]
    shape = ["image_height", "image_width", 3] if raw else [1, 3, 1024, 1024]
    constants = {"times": np.array([1, 256, 1, 1])} | ({"axis": np.array([0])} if raw else {})
    return _save(path, nodes, {name: shape}, {"image_embeddings": [1, 256, 64, 64]}, constants)


def sam_decoder(path):
    """SAM decoder of three masks: nothing (IoU .5); the box where the embedding is positive (.9); everything (.2).

    Prompts whose labels are not 2, 3, -1 give no mask at all.
    """
    step = (np.arange(256) + 0.5) * 4
    constants = {
        "gx": step.reshape(1, 1, 1, 256),
        "gy": step.reshape(1, 1, 256, 1),
        "labels": np.array([[2.0, 3.0, -1.0]]),
        "zero": np.array([0]),
        "first": np.array([1]),
        "channel": np.array([1]),
        "scales": np.array([1.0, 1.0, 4.0, 4.0]),
        "harsh": np.array(1e6),
        "nothing": np.full((1, 1, 256, 256), -1.0),
        "all": np.full((1, 1, 256, 256), 1.0),
        "iou": np.array([[0.5, 0.9, 0.2]]),
        **{f"i{k}": np.array(k) for k in range(2)},
    }
    node = helper.make_node
    nodes = []
    for corner in range(2):
        nodes.append(node("Gather", ["point_coords", f"i{corner}"], [f"corner{corner}"], axis=1))
        for axis, letter in enumerate("xy"):
            nodes.append(node("Gather", [f"corner{corner}", f"i{axis}"], [f"{letter}{corner}"], axis=1))
    nodes += [
        *(node("Sub", [f"g{a}", f"{a}0"], [f"{a}low"]) for a in "xy"),
        *(node("Sub", [f"{a}1", f"g{a}"], [f"{a}high"]) for a in "xy"),
        node("Slice", ["image_embeddings", "zero", "first", "channel"], ["bright64"]),
        node("Resize", ["bright64", "", "scales"], ["bright"], mode="nearest"),
        node("Min", ["xlow", "xhigh", "ylow", "yhigh", "bright"], ["inside"]),
        node("Sub", ["point_labels", "labels"], ["off"]),
        node("Abs", ["off"], ["wrong"]),
        node("ReduceSum", ["wrong"], ["sum"], keepdims=0),
        node("Mul", ["sum", "harsh"], ["penalty"]),
        node("Sub", ["inside", "penalty"], ["box"]),
        node("Concat", ["nothing", "box", "all"], ["low_res_masks"], axis=1),
        node("Identity", ["low_res_masks"], ["masks"]),
        node("Identity", ["iou"], ["iou_predictions"]),
    ]
    inputs = {
        "image_embeddings": [1, 256, 64, 64],
        "point_coords": [1, "num_points", 2],
        "point_labels": [1, "num_points"],
        "mask_input": [1, 1, 256, 256],
        "has_mask_input": [1],
        "orig_im_size": [2],
    }
    outputs = {"masks": [1, 3, "h", "w"], "iou_predictions": [1, 3], "low_res_masks": [1, 3, 256, 256]}
    return _save(path, nodes, inputs, outputs, constants)


def quadrants(size=16):
    """Prototypes (32, size, size): 0 is 1 on the left and -1 on the right, 1 the same above and below, 2 is 1."""
    prototypes = np.zeros((32, size, size), np.float32)
    prototypes[0] = np.where(np.arange(size) < size // 2, 1, -1)
    prototypes[1] = prototypes[0].T
    prototypes[2] = 1
    return prototypes


def seg_row(center, scores, **coefficients):
    """One row of `yolo_seg`: cx cy w h, class scores, and coefficients by prototype as p0=..., p1=..."""
    values = np.zeros(32, np.float32)
    for name, value in coefficients.items():
        values[int(name[1:])] = value
    return [*center, *scores, *values.tolist()]


def manifest_table(name, family, folder, files, labels=(), options=""):
    """The manifest's table of some weights whose files, by role, lie in `folder`."""
    rows = "".join(
        f'{role} = {{ file = "{file}", sha256 = "{hashlib.sha256((folder / file).read_bytes()).hexdigest()}", '
        f"size_bytes = {(folder / file).stat().st_size} }}\n"
        for role, file in files.items()
    )
    return (
        f'[weights.{name}]\nfamily = "{family}"\nlicence = "none"\nsource = "make_tiny_models.py"\n'
        f"labels = {list(labels)}\n[weights.{name}.files]\n{rows}[weights.{name}.options]\n{options}\n"
    )


def write_models(folder):
    """One network of each task with a manifest: tiny_tags, tiny_boxes, tiny_instances, tiny_sam.

    On a 64 x 64 image of pure red: the tag red .953 (logits 3, 0, -9); boxes and instances cup (8, 8)-(24, 24) .9,
    lamp (32, 8)-(56, 56) .6 and cup (40, 40)-(48, 48) .2; the lamp's mask is empty, the cups' are full. tiny_sam fills
    boxes in white images and finds nothing in black ones.
    """
    folder = Path(folder)
    channel_means(folder / "tags.onnx", [[3, 0, 0], [0, 0, 0.0], [-9, 0, 0]], 8)
    rows = [
        seg_row((16, 16, 16, 16), (0.9, 0), p2=1),
        seg_row((44, 32, 24, 48), (0, 0.6), p2=-1),
        seg_row((44, 44, 8, 8), (0.2, 0), p2=1),
    ]
    yolo(folder / "boxes.onnx", [row[:6] for row in rows])
    yolo_seg(folder / "instances.onnx", rows, quadrants())
    sam_encoder(folder / "encoder.onnx")
    sam_decoder(folder / "decoder.onnx")
    plain = "mean = [0.0, 0.0, 0.0]\nstd = [255.0, 255.0, 255.0]"
    names = ("cup", "lamp")
    (folder / "manifest.toml").write_text(
        manifest_table("tiny_tags", "classifier", folder, {"model": "tags.onnx"}, ("red", "grey", "blue"), plain)
        + manifest_table("tiny_boxes", "yolo", folder, {"model": "boxes.onnx"}, names)
        + manifest_table("tiny_instances", "yolo_seg", folder, {"model": "instances.onnx"}, names)
        + manifest_table("tiny_sam", "sam", folder, {"encoder": "encoder.onnx", "decoder": "decoder.onnx"}),
        "utf-8",
    )


if __name__ == "__main__":
    write_models(sys.argv[1])
