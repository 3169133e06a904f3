"""Everything packed from untrained networks at 64 px: the files fit the families that read them."""

from __future__ import annotations

import hashlib
import re
import shutil

import numpy as np
import onnx
import onnxruntime
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.models_onnx.box_masks import FAMILY as BoxMasks  # noqa: E402
from placegraph.models_onnx.manifest import Weights  # noqa: E402
from placegraph.models_onnx.ram import FAMILY as Ram  # noqa: E402
from placegraph.models_onnx.text_encoder import TextEncoder  # noqa: E402
from placegraph.models_onnx.yolo import FAMILY as Yolo  # noqa: E402
from placegraph.runtime.errors import ConfigError  # noqa: E402
from placegraph.tools.simulator.object_classes import NAMES  # noqa: E402
from placegraph.tools.training import network_packaging as pack_module  # noqa: E402
from placegraph.tools.training.batch_norm_folding import fold_batch_norm  # noqa: E402
from placegraph.tools.training.mask_networks import MaskDecoder, MaskEncoder  # noqa: E402
from placegraph.tools.training.network_packaging import KEEP_FLOAT, package_networks  # noqa: E402
from placegraph.tools.training.networks import ObjectNetwork, TaggerNetwork  # noqa: E402
from placegraph.tools.training.segmenter_training import MaskNetwork  # noqa: E402
from placegraph.tools.training.view_rendering import visible_boxes  # noqa: E402

# the exporter is the older one on purpose, see onnx_export.py
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")
torch.set_num_threads(1)
NETWORKS = ("house_detector", "house_tagger", "house_mask_encoder", "house_mask_decoder")


def write_shard(folder):
    """Two views of 48 x 64 px: one shows an object, the other nothing."""
    folder.mkdir(parents=True)
    instance = np.zeros((2, 48, 64), np.uint16)
    instance[0, 5:40, 10:50] = 1
    np.save(folder / "color.npy", np.random.default_rng(1).integers(0, 256, (2, 48, 64, 3)).astype(np.uint8))
    np.save(folder / "depth.npy", np.full(instance.shape, 1500, np.uint16))
    np.save(folder / "instance.npy", instance)
    np.save(folder / "item_class.npy", np.array([3], np.uint8))
    np.save(folder / "boxes.npy", np.insert(visible_boxes(instance[0], np.array([3], np.uint8)), 0, 0, axis=1))


def write_checkpoints(work):
    torch.manual_seed(0)
    objects = fold_batch_norm(ObjectNetwork())
    text = torch.from_numpy(TextEncoder().encode(NAMES))
    work.mkdir()
    for name, network in (("refined", objects), ("tags", TaggerNetwork(objects, text)), ("masks", MaskNetwork())):
        torch.save({"average": network.state_dict()}, work / f"{name}.pt")


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    """Folder, lines said and feeds by network; quantising, tested in test_onnx_export.py, only copies here."""
    folder = tmp_path_factory.mktemp("pack")
    write_shard(folder / "calibration" / "10000")
    write_checkpoints(folder / "work")
    feeds, kept = {}, {}

    def quantize(float_file, file, given, keep):
        feeds[file.stem], kept[file.stem] = list(given), keep
        shutil.copy(float_file, file)
        return file

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pack_module, "SIZES", ((64, 64),))
        patch.setattr(pack_module, "MASK_SIZE", (64, 64))
        patch.setattr(pack_module, "TAG_SIZE", 64)
        patch.setattr(pack_module, "CALIBRATION_VIEWS", 4)
        patch.setattr(pack_module, "quantize", quantize)
        lines = list(package_networks(folder / "work", folder / "calibration"))
    return folder / "work" / "onnx", lines, feeds, kept


def test_what_is_trained_is_packed_alone(packed, tmp_path, monkeypatch):
    with pytest.raises(ConfigError, match=r"refined\.pt, tags\.pt, masks\.pt: nothing is trained yet"):
        next(package_networks(tmp_path, tmp_path))
    folder, _, _, _ = packed
    shutil.copy(folder.parent / "refined.pt", tmp_path)
    monkeypatch.setattr(pack_module, "SIZES", ((64, 64),))
    monkeypatch.setattr(pack_module, "quantize", lambda float_file, file, feeds, keep: shutil.copy(float_file, file))
    lines = list(package_networks(tmp_path, folder.parent.parent / "calibration"))
    assert [line.split(":")[0] for line in lines] == ["float/house_detector.onnx", "house_detector.onnx"]


def test_all_files_are_written_and_said_with_their_sums(packed):
    folder, lines, _, _ = packed
    for name in NETWORKS:
        assert (folder / f"{name}.onnx").is_file() and (folder / "float" / f"{name}.onnx").is_file()
        data = (folder / f"{name}.onnx").read_bytes()
        said = f"{name}.onnx: size_bytes = {len(data)}, sha256 = {hashlib.sha256(data).hexdigest()}"
        assert any(line.endswith(said) for line in lines), name
    assert (folder / "house_tags.txt").read_text().splitlines() == list(NAMES)


def test_layers_kept_float_exist(packed):
    """A part that names nothing would quantise silently what must stay exact."""
    folder, _, _, kept = packed
    for name, parts in kept.items():
        nodes = [node.name for node in onnx.load(folder / "float" / f"{name}.onnx").graph.node]
        for part in parts:
            assert any(re.fullmatch(part, node) for node in nodes), f"{name}: {part}"
    assert kept["house_detector"] == KEEP_FLOAT["detector"]
    assert kept["house_tagger"] == KEEP_FLOAT["tagger"]
    assert kept["house_mask_encoder"] == KEEP_FLOAT["mask_encoder"]
    assert kept["house_mask_decoder"] == KEEP_FLOAT["mask_decoder"]


def test_feeds_are_what_the_networks_take(packed):
    folder, _, feeds, _ = packed
    assert {name: len(given) for name, given in feeds.items()} == {
        "house_detector": 4, "house_tagger": 4, "house_mask_encoder": 4, "house_mask_decoder": 2,
    }  # fmt: skip
    for name, given in feeds.items():
        session = open_session(folder / f"{name}.onnx")
        for feed in given:
            assert all(array.dtype == np.float32 for array in feed.values())
            assert all(np.isfinite(one).all() for one in session.run(None, feed))
    image = feeds["house_detector"][0]["images"]
    assert image.shape == (1, 3, 64, 64) and image.min() >= 0 and image.max() <= 1
    assert abs(feeds["house_tagger"][0]["images"].mean()) < 0.6 and feeds["house_tagger"][0]["images"].min() < -1
    assert feeds["house_mask_encoder"][0]["depth"].max() == pytest.approx(1.5)
    # 5..40 of 48 rows, letterboxed by 8 rows into 64
    np.testing.assert_allclose(feeds["house_mask_decoder"][0]["boxes"], [[10 / 64, 13 / 64, 50 / 64, 48 / 64]])


def open_session(file):
    return onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])


def test_the_families_read_the_files(packed, tmp_path):
    folder, _, _, _ = packed
    image, depth = np.full((48, 64, 3), 90, np.uint8), np.full((48, 64), 2, np.float32)
    yolo = Yolo(Weights("d", "yolo", {"model": folder / "house_detector.onnx"}, (), {"min_score": 0.0}))
    found = yolo.detect(image, ("chair", "sofa"))
    assert len(found.boxes_px) > 0 and np.isfinite(found.boxes_px).all()
    files = {"encoder": folder / "house_mask_encoder.onnx", "decoder": folder / "house_mask_decoder.onnx"}
    segmenter = BoxMasks(Weights("m", "box_masks", files, (), {}))
    masks = segmenter.segment(image, depth, np.array([[5, 5, 30, 30], [0, 0, 64, 48]], np.float32))
    assert [mask.shape for mask in masks] == [(48, 64)] * 2
    (tmp_path / "thresholds.txt").write_text("0.0\n" * len(NAMES))
    files = {"model": folder / "house_tagger.onnx", "labels": folder / "house_tags.txt"}
    tagger = Ram(Weights("t", "ram", files | {"thresholds": tmp_path / "thresholds.txt"}, NAMES, {}))
    assert set(tagger.tag(image).names) == set(NAMES)


def test_the_float_decoder_equals_the_network(packed):
    folder, _, _, _ = packed
    network = MaskNetwork().eval()
    network.load_state_dict(torch.load(folder.parent / "masks.pt", weights_only=True)["average"])
    embedding, boxes = torch.rand(1, MaskEncoder.CHANNELS, 32, 32), torch.tensor([[0.1, 0.2, 0.6, 0.9]] * 3)
    boxes[1] = torch.tensor([0, 0, 1.0, 1.0])
    with torch.no_grad():
        masks, quality = network.decoder(embedding, boxes)
    session = open_session(folder / "house_mask_decoder.onnx")
    got = session.run(["masks", "iou_predictions"], {"image_embeddings": embedding.numpy(), "boxes": boxes.numpy()})
    assert got[0].shape == (3, 1, MaskDecoder.GRID, MaskDecoder.GRID)
    np.testing.assert_allclose(got[0], masks.numpy(), atol=1e-4)
    np.testing.assert_allclose(got[1], quality.numpy(), atol=1e-4)


def test_every_line_says_another_file(packed):
    _, lines, _, _ = packed
    names = [line.split(":")[0] for line in lines]
    assert len(set(names)) == len(names)
