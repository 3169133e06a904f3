from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.models_onnx.manifest import Weights  # noqa: E402
from placegraph.models_onnx.yolo_locations import FAMILY  # noqa: E402
from placegraph.nodes.hierarchy.birds_eye_view import SIZE_PX  # noqa: E402
from placegraph.runtime.errors import SourceError  # noqa: E402
from placegraph.tools.training.location_network import LocationExport, LocationNetwork, LocationTargets, losses  # noqa: E402
from placegraph.tools.training.location_training import LocationSamples, birds_eye_sample, random_transform  # noqa: E402
from placegraph.tools.training.onnx_export import export_onnx  # noqa: E402
from placegraph.tools.training.room_scans import RoomScan, write_scans  # noqa: E402


def scan(count=2):
    random = np.random.default_rng(1)
    objects = tuple((random.random((900, 3)) * 0.6 + (0.8 * i, 0, 0)).astype(np.float32) for i in range(count))
    outline = np.array([[0, 0], [1.4, 0], [1.4, 0.6], [0, 0.6]])
    return RoomScan(0, 0.0, 2.5, np.array([0, 0, 3.0, 2.0]), objects, (0,) * count, (outline,))


def test_true_boxes_and_masks_lie_where_the_objects_are():
    image, shown = birds_eye_sample(scan())
    (box,), (mask,) = shown.boxes.numpy(), shown.masks.numpy()
    rows, columns = np.nonzero(image[..., 0])
    np.testing.assert_allclose(box, [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1], atol=1.5)
    assert mask.sum() * 16 == pytest.approx(1.4 * 0.6 / 0.05**2, rel=0.15)


def test_a_location_of_which_nothing_was_mapped_is_no_truth():
    image, shown = birds_eye_sample(scan(0))
    assert not image.any() and shown.boxes.shape == (0, 4) and len(shown.masks) == 0


def test_objects_and_outlines_turn_together():
    moved = random_transform(scan(), np.random.default_rng(4))
    points = np.concatenate(moved.objects)[:, :2]
    np.testing.assert_allclose(points.mean(axis=0), moved.outlines[0].mean(axis=0), atol=0.05)
    assert np.concatenate(moved.objects)[:, 2].max() == pytest.approx(0.6, abs=0.01)


def test_samples_are_those_of_the_seed(tmp_path):
    write_scans([scan(), scan(1)], tmp_path / "7_0.npz")
    a, b, other = (LocationSamples(tmp_path, seed).sample()[0] for seed in (1, 1, 2))
    assert np.array_equal(a, b) and not np.array_equal(a, other)


def test_a_folder_without_scans(tmp_path: Path):
    with pytest.raises(SourceError, match="no scans"):
        LocationSamples(tmp_path, 0)


def test_the_losses_fall_and_bear_images_without_locations():
    torch.manual_seed(0)
    torch.set_num_threads(1)
    network = LocationNetwork()
    optimizer = torch.optim.AdamW(network.parameters(), lr=2e-3)
    image, shown = birds_eye_sample(scan())
    empty = LocationTargets(torch.zeros(0, 4), torch.zeros(0, SIZE_PX // 4, SIZE_PX // 4))
    batch = torch.from_numpy(np.stack((image, np.zeros_like(image)))).permute(0, 3, 1, 2).float() / 255
    course = []
    for _ in range(8):
        loss = sum(losses(network(batch), [shown, empty], SIZE_PX).values())
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        course.append(float(loss.detach()))
    assert course[-1] < 0.8 * course[0]
    assert float(losses(network(batch), [empty, empty], SIZE_PX)["mask"]) == 0


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_export_is_read_by_the_family_and_gives_what_the_network_gives(tmp_path):
    torch.manual_seed(0)
    network = LocationNetwork().eval()
    for head in network.heads:
        torch.nn.init.constant_(head[-1].bias[4:5], 1.0)  # so that something is found
    exported = LocationExport(network, SIZE_PX, SIZE_PX)
    file = export_onnx(
        exported, {"images": torch.rand(1, 3, SIZE_PX, SIZE_PX)}, ["output0", "output1"], tmp_path / "m.onnx"
    )
    image = np.random.default_rng(0).integers(0, 255, (SIZE_PX, SIZE_PX, 3), dtype=np.uint8)
    found = FAMILY(Weights("m", "yolo_locations", {"model": file}, (), {"max_objects": 3})).locate(image)
    with torch.no_grad():
        output, _ = exported(torch.from_numpy(image.transpose(2, 0, 1)[None]).float() / 255)
    assert found.scores[0] == pytest.approx(float(output[0, 4].max()), abs=1e-3)
    assert len(found.masks) == len(found.scores) <= 3
