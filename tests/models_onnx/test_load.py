import pytest

from placegraph.models_onnx import Detector, InstanceSegmenter, Segmenter, Tagger
from placegraph.models_onnx.load import load, load_for_node
from placegraph.runtime.errors import ConfigError, ModelError
from placegraph.runtime.node import Context


def test_each_family_implements_its_tasks(tiny, tmp_path):
    tiny.write_models(tmp_path)
    tasks = (Tagger, Detector, Segmenter, InstanceSegmenter)
    found = {
        name: [task for task in tasks if isinstance(load(name, [tmp_path]), task)]
        for name in ("tiny_tags", "tiny_boxes", "tiny_instances", "tiny_sam")
    }
    assert found == {
        "tiny_tags": [Tagger],
        "tiny_boxes": [Detector],
        "tiny_instances": [Detector, Segmenter, InstanceSegmenter],
        "tiny_sam": [Segmenter],
    }


def test_an_unknown_family_or_name_is_an_error(tiny, tmp_path):
    tiny.write_models(tmp_path)
    path = tmp_path / "manifest.toml"
    path.write_text(path.read_text().replace('"classifier"', '"clasifier"'))
    with pytest.raises(ConfigError, match="no model family named 'clasifier'; there are: ") as error:
        load("tiny_tags", [tmp_path])
    families = str(error.value).rpartition(": ")[2].split(", ")
    assert {"classifier", "sam", "yolox"} < set(families) and not {"boxes", "load", "session"} & set(families)
    with pytest.raises(ModelError, match="no weights named 'tiny'"):
        load("tiny", [tmp_path])


def test_a_network_for_another_task_is_named(tiny, tmp_path):
    tiny.write_models(tmp_path)
    context = Context(model_dirs=(str(tmp_path),))
    with pytest.raises(ConfigError, match=r"^\[nodes.tagger\] model: 'tiny_sam' is of family 'sam', which cannot tag"):
        load_for_node(Tagger, "tiny_sam", "tagger", context)
    assert isinstance(load_for_node(Segmenter, "tiny_sam", "segmenter", context), Segmenter)
