import json

import numpy as np
import pytest
import typer

from placegraph.models_onnx import NamedBoxes, ScoredNames
from placegraph.runtime.errors import ConfigError, ModelError
from placegraph.tools.evaluate.evaluation_views import (
    evaluation_shards,
    evaluation_view,
    evaluation_views,
    shard_folder,
)
from placegraph.tools.evaluate.network_scores import (
    HAS_UNTRAINED_SYNONYM,
    UNTRAINED_SYNONYMS,
    NetworkNames,
    Networks,
    detected_boxes,
    network_scores,
    tag_scores,
)
from placegraph.tools.evaluate.networks_command import evaluate_networks, network_times
from placegraph.tools.simulator.object_classes import CLASSES, NAMES
from placegraph.tools.training.data_augmentation import MIN_SHARE
from placegraph.tools.training.view_rendering import EVALUATION_SEEDS, visible_boxes

CUP, LAMP, SOFA = NAMES.index("cup"), NAMES.index("lamp"), NAMES.index("sofa")
ITEM_CLASS = np.array([CUP, LAMP, SOFA, CUP], np.uint8)
SIZE = 64


def instance():
    """Where tiny_boxes finds things, and what it misses: cup 0, lamp 1, sofa 2 at the border, cup 3 of one pixel."""
    image = np.zeros((SIZE, SIZE), np.uint16)
    image[8:24, 8:24], image[8:56, 32:56] = 1, 2
    image[60:64, 0:20] = 3
    image[30, 4] = 4
    return image


def write_shard(folder, seed, views=2):
    shard = folder / str(seed)
    shard.mkdir(parents=True)
    color = np.zeros((views, SIZE, SIZE, 3), np.uint8)
    color[..., 0] = 255
    image = instance()
    arrays = {
        "color": color,
        "depth": np.full((views, SIZE, SIZE), 1500, np.uint16),
        "instance": np.stack([image] * views),
        "item_class": ITEM_CLASS,
        "boxes": np.concatenate([np.insert(visible_boxes(image, ITEM_CLASS), 0, k, axis=1) for k in range(views)]),
    }
    for name, array in arrays.items():
        np.save(shard / f"{name}.npy", array)


@pytest.fixture
def data(tmp_path):
    folder = tmp_path / "data"
    for seed in EVALUATION_SEEDS[:2]:
        write_shard(shard_folder(2, folder), seed)
    return folder


@pytest.fixture(scope="session")
def models(tmp_path_factory, tiny_models):
    """The tiny networks, and a RAM tagger whose thresholds are never reached."""
    folder = tmp_path_factory.mktemp("models")
    tiny_models.write_models(folder)
    tiny_models.channel_means(folder / "ram.onnx", [[1, 0, 0], [3, 0, 0]], 8)
    (folder / "ram.txt").write_text("cup\nsofa\n")
    (folder / "thresholds.txt").write_text("0.999\n0.999\n")
    files = {"model": "ram.onnx", "labels": "ram.txt", "thresholds": "thresholds.txt"}
    table = tiny_models.manifest_table("tiny_ram", "ram", folder, files).replace("labels = []\n", "")
    with (folder / "manifest.toml").open("a") as manifest:
        manifest.write(table)
    return folder


@pytest.fixture
def chosen(models):
    return NetworkNames("tiny_ram", "tiny_boxes", "tiny_sam", (models,))


def the_view():
    color = np.zeros((SIZE, SIZE, 3), np.uint8)
    rows = visible_boxes(instance(), ITEM_CLASS)
    return evaluation_view(color, np.full((SIZE, SIZE), 1500, np.uint16), instance(), rows)


def test_every_class_is_prompted_once_by_a_word_of_its_own() -> None:
    assert len(set(UNTRAINED_SYNONYMS)) == len(CLASSES) == len(HAS_UNTRAINED_SYNONYM)
    names = tuple(UNTRAINED_SYNONYMS[::-1])
    boxes = np.tile(np.array([[0, 0, 9, 9]], np.float32), (len(names), 1))
    found = detected_boxes(NamedBoxes(names, boxes, np.ones(len(names), np.float32)))
    assert found.classes.tolist() == list(range(len(CLASSES)))[::-1]


def test_words_of_no_class_are_left_out() -> None:
    scores = np.array([0.9, 0.5, 0.7], np.float32)
    found = detected_boxes(NamedBoxes(("zebra", "couch", "mugs"), np.eye(3, 4, dtype=np.float32), scores))
    assert found.classes.tolist() == [SOFA, CUP] and found.scores == pytest.approx([0.5, 0.7])
    assert detected_boxes(NamedBoxes((), np.zeros((0, 4), np.float32), np.zeros(0, np.float32))).boxes.shape == (0, 4)
    tags = tag_scores(ScoredNames(("sofa", "couch", "zebra"), np.array([0.3, 0.6, 0.9], np.float32)))
    assert tags[SOFA] == pytest.approx(0.6) and tags.sum() == pytest.approx(0.6)


def test_what_a_view_asks_for() -> None:
    view = the_view()
    assert view.items.tolist() == [0, 1, 2, 3]
    assert (view.small.tolist(), view.cut.tolist()) == ([False] * 3 + [True], [False, False, True, False])
    assert view.true_boxes(with_cut=False).ignored.tolist() == [False, False, True, True]
    assert view.true_boxes(with_cut=True).ignored.tolist() == [False, False, False, True]
    assert view.depth_m[0, 0] == pytest.approx(1.5)
    assert view.prompt_boxes.shape == (3, 4) and [mask.sum() for mask in view.prompt_masks()] == [256, 1152, 80]
    assert (view.tags[CUP], view.tags[SOFA], np.nansum(view.tags)) == (1, 1, 3)


def test_a_class_of_which_only_a_speck_is_seen_is_unknown() -> None:
    image = np.zeros((100, 100), np.uint16)
    least = int(MIN_SHARE * 100 * 100)
    image[50, 10 : 10 + least], image[70, 10 : 10 + least - 1] = 1, 2
    view = evaluation_view(
        np.zeros((100, 100, 3), np.uint8), np.zeros((100, 100), np.uint16), image, visible_boxes(image, ITEM_CLASS)
    )
    assert view.small.tolist() == [False, True]
    assert view.tags[CUP] == 1 and np.isnan(view.tags[LAMP]) and view.tags[SOFA] == 0


def test_a_view_of_the_bare_building() -> None:
    image = np.zeros((20, 30), np.uint16)
    view = evaluation_view(
        np.zeros((20, 30, 3), np.uint8), np.zeros((20, 30), np.uint16), image, visible_boxes(image, ITEM_CLASS)
    )
    assert view.tags.sum() == 0 and view.prompt_boxes.shape == (0, 4) and view.prompt_masks() == []


def test_shards_that_are_there_are_not_rendered_and_only_those_asked_for_are_read(data) -> None:
    shards = evaluation_shards(1, 2, data)
    assert len(shards) == 1 and len(list(evaluation_views(shards))) == 2
    assert len(evaluation_shards(2, 2, data)) == 2
    with pytest.raises(ConfigError, match="at most 1000"):
        evaluation_shards(1001, 2, data)


def test_absent_houses_are_rendered(tmp_path, monkeypatch) -> None:
    asked = []

    def render(seeds, views, folder):
        asked.append((seeds, views))
        for seed in seeds:
            write_shard(folder, seed)

    monkeypatch.setattr("placegraph.tools.evaluate.evaluation_views.render_houses", render)
    evaluation_shards(1, 3, tmp_path)
    assert len(evaluation_shards(3, 3, tmp_path)) == 3
    assert asked == [([9000], 3), ([9001, 9002], 3)]


def test_scores_by_hand(data, chosen) -> None:
    scores = network_scores(evaluation_shards(2, 2, data), Networks.load_without_thresholds(chosen))
    # cup and lamp are found exactly; a second cup, surer than none, comes last and costs nothing; no sofa is found
    assert (scores["detector_ap50"], scores["detector_classes"]) == (pytest.approx(1), 2)
    assert scores["detector_ap50_with_cut"] == pytest.approx(2 / 3)
    assert scores["detector_ap50_unsaid"] == pytest.approx(1) and scores["unsaid_classes"] == 2
    assert scores["classes"]["sofa"]["with_cut"] == 0 and np.isnan(scores["classes"]["sofa"]["names"])
    assert list(scores["classes"]) == ["sofa", "lamp", "cup"]
    assert scores["tagger_classes"] == 3 and scores["tagger_map"] == pytest.approx(1)
    assert (scores["views"], scores["objects"], scores["small"], scores["cut"], scores["masks"]) == (4, 16, 4, 4, 12)
    assert 0 <= scores["segmenter_miou"] <= 1


def test_thresholds_and_floors_are_taken_away(data, chosen) -> None:
    color = next(evaluation_views(evaluation_shards(1, 2, data))).color
    assert Networks.load(chosen, 1).tagger.tag(color).names == ()
    assert Networks.load_without_thresholds(chosen).tagger.tag(color).names == ("sofa", "cup")
    dim = (color * 0.06).astype(np.uint8)  # the second cup's score falls to .012, below the floor of .1
    assert len(Networks.load(chosen, 1).detector.detect(dim, NAMES).names) == 0
    assert len(Networks.load_without_thresholds(chosen).detector.detect(dim, NAMES).names) == 3


def test_times_are_given_by_threads(data, chosen) -> None:
    times = network_times(evaluation_shards(1, 2, data), chosen)
    assert list(times) == ["1", "2"]
    for row in times.values():
        assert row["sum"] == pytest.approx(row["tag"] + row["detect"] + row["segment"])
        assert min(row.values()) > 0


@pytest.mark.parametrize("role", ["tagger", "detector", "segmenter"])
def test_a_network_of_another_task_is_refused(models, role) -> None:
    right = {"tagger": "tiny_ram", "detector": "tiny_boxes", "segmenter": "tiny_sam"}
    wrong = {"tagger": "tiny_boxes", "detector": "tiny_tags", "segmenter": "tiny_tags"}
    with pytest.raises(ConfigError, match=f"--{role}: '{wrong[role]}' cannot"):
        Networks.load_without_thresholds(NetworkNames(**(right | {role: wrong[role]}), model_dirs=(models,)))


def test_an_unknown_name_is_noticed_before_anything_is_rendered(tmp_path, models, monkeypatch) -> None:
    monkeypatch.setattr(
        "placegraph.tools.evaluate.networks_command.evaluation_shards", lambda *_: pytest.fail("rendered")
    )
    with pytest.raises(ModelError, match="no weights named 'absent'"):
        evaluate_networks(tagger="absent", data=tmp_path)


@pytest.fixture
def command(data, models):
    """The command as it will be mounted, on two houses of two views."""
    from typer.testing import CliRunner

    app = typer.Typer()
    app.command("networks")(evaluate_networks)
    names = ["--tagger", "tiny_ram", "--detector", "tiny_boxes", "--segmenter", "tiny_sam"]
    where = ["--model-dir", str(models), "--data", str(data), "--houses", "2", "--views", "2"]

    def run(*more):
        done = CliRunner().invoke(app, [*names, *where, *more])
        assert done.exit_code == 0, done.output
        return done.output

    return run


def test_the_command_in_json(command) -> None:
    found = json.loads(command("--json"))
    assert (found["houses"], found["views"], found["detector_ap50"]) == (2, 4, 1.0)
    assert found["classes"]["sofa"]["names"] is None and found["ms"]["2"]["sum"] > 0


def test_the_command_in_words(command) -> None:
    lines = command("--per-class").splitlines()
    assert lines[0] == "4 views of 2 houses" and "mAP 1.000 over 3 classes" in lines[1]
    assert any(line.startswith("sofa") and line.split()[1:] == ["1.000", "-", "-", "0.000"] for line in lines)
    assert "sofa" not in command()
