import hashlib
import tomllib
from pathlib import Path

import pytest

from placegraph.models_onnx import manifest
from placegraph.models_onnx.manifest import (
    ModelOptions,
    Weights,
    find_weights,
    known_weights,
    model_folders,
    read_lines,
)
from placegraph.runtime.errors import ModelError


def write(folder, name="mine", content=b"model", labels="", **changes):
    """A folder with one file and the manifest that describes it."""
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.bin").write_bytes(content)
    values = {
        "file": f"{name}.bin",
        "sha256": hashlib.sha256(content).hexdigest(),
        "size_bytes": len(content) or 1,
    } | changes
    row = ", ".join(f"{key} = {value!r}" for key, value in values.items())
    text = f"[weights.{name}]\nfamily = 'yolo'\nlicence = 'none'\nsource = 'here'\n{labels}\n"
    (folder / "manifest.toml").write_text(text + f"files = {{ model = {{ {row} }} }}\n")
    return folder


def test_our_manifest_reads_and_names_known_families():
    families = {path.stem for path in manifest.PACKAGE_DIR.glob("*.py")}
    ours = known_weights()
    assert {"yolox_nano", "yolov8n_seg_320", "mobilenet_v2"} <= set(ours)
    assert {listed.entry.family for listed in ours.values()} <= families


def test_find_gives_verified_files(tmp_path):
    folder = write(tmp_path / "a", labels="labels = ['cup', 'lamp']\noptions = { min_score = 0.5 }")
    found = find_weights("mine", [folder])
    assert found == Weights("mine", "yolo", {"model": folder / "mine.bin"}, ("cup", "lamp"), {"min_score": 0.5})


def test_an_unknown_name_lists_the_known_ones(tmp_path):
    with pytest.raises(ModelError, match=r"no weights named 'yolo9'; there are: .*mine.*yolox_nano"):
        find_weights("yolo9", [write(tmp_path / "a")])


def test_a_missing_file_lists_every_folder_and_the_command(tmp_path):
    folder = write(tmp_path / "a")
    (folder / "mine.bin").unlink()
    with pytest.raises(ModelError) as caught:
        find_weights("mine", [folder, tmp_path / "b"])
    text = str(caught.value)
    places = [folder, tmp_path / "b", manifest.EMBEDDED_DIR, manifest.WEIGHTS_DIR]
    assert all(str(place) in text for place in places)
    assert "mine.bin (model)" in text and "placegraph models import DIR" in text


def test_a_damaged_file_is_named_with_both_checksums(tmp_path):
    folder = write(tmp_path / "a")
    (folder / "mine.bin").write_bytes(b"changed")
    with pytest.raises(ModelError) as caught:
        find_weights("mine", [folder])
    for content in (b"model", b"changed"):
        assert hashlib.sha256(content).hexdigest() in str(caught.value)


def test_a_file_of_the_same_name_elsewhere_is_passed_over(tmp_path):
    folder, other = write(tmp_path / "a"), tmp_path / "b"
    other.mkdir()
    (folder / "mine.bin").rename(other / "mine.bin")
    (folder / "mine.bin").write_bytes(b"of another network")
    assert find_weights("mine", [folder, other]).files["model"] == other / "mine.bin"


def test_the_environment_names_folders(tmp_path, monkeypatch):
    one, two = write(tmp_path / "a"), write(tmp_path / "b", name="other")
    monkeypatch.setenv(manifest.MODELS_VARIABLE, f"{one}:{two}")
    assert model_folders([two])[2:] == [one, two]
    assert find_weights("other").files["model"] == two / "other.bin"


def test_one_name_in_two_manifests_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"'mine' are described twice: .*a/manifest\.toml and .*b/manifest\.toml"):
        known_weights([write(tmp_path / "a"), write(tmp_path / "b")])


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"sha256": "abc"}, r"\[weights\.mine\] files\.model\.sha256"),
        ({"file": "../up.bin"}, r"files\.model\.file"),
        ({"size_bytes": 0}, r"files\.model\.size_bytes"),
        ({"colour": "red"}, r"files\.model\.colour: Extra inputs"),
    ],
)
def test_a_wrong_row_is_named(tmp_path, changes, text):
    with pytest.raises(ModelError, match=text):
        known_weights([write(tmp_path / "a", **changes)])


@pytest.mark.parametrize("content", ["[weights", "x = 1", "weights = 3", "[weights]\na = 3"])
def test_a_broken_manifest_is_named(tmp_path, content):
    (tmp_path / "manifest.toml").write_text(content)
    with pytest.raises(ModelError, match=r"manifest\.toml: "):
        known_weights([tmp_path])


def test_labels_come_from_a_file(tmp_path):
    names = b"cup\n\n lamp \n"
    folder = write(tmp_path / "a", content=names)
    text = (folder / "manifest.toml").read_text()
    (folder / "manifest.toml").write_text(text.replace("model =", "labels ="))
    assert find_weights("mine", [folder]).labels == ("cup", "lamp")
    (folder / "manifest.toml").write_text(text.replace("model =", "labels =").replace("files", "labels = ['a']\nfiles"))
    with pytest.raises(ModelError, match="given both"):
        find_weights("mine", [folder])


def test_read_lines_refuses_nothing_and_nonsense(tmp_path):
    path = tmp_path / "labels.txt"
    for content in (b"", b" \n\n", b"\xff\xfe"):
        path.write_bytes(content)
        with pytest.raises(ModelError, match=r"labels\.txt"):
            read_lines(path)


def test_missing_roles_labels_and_wrong_options_are_named():
    class Options(ModelOptions):
        min_score: float = 0.1

    weights = Weights("mine", "yolo", {"model": Path("x")}, (), {"min_scor": 0.5})
    with pytest.raises(ModelError, match="'mine': family 'yolo' needs a file of role 'encoder'"):
        weights.file("encoder")
    with pytest.raises(ModelError, match="'mine': family 'yolo' needs labels"):
        weights.class_names()
    with pytest.raises(ModelError, match="'mine', options: min_scor: Extra inputs"):
        weights.parse_options(Options)


@pytest.mark.weights
def test_the_real_weights_are_those_of_the_manifest(real_models):
    for name in ("yolox_nano", "yolov8n_seg_320", "mobilenet_v2"):
        found = find_weights(name, [real_models])
        table = tomllib.loads((manifest.PACKAGE_DIR / "manifest.toml").read_text())["weights"][name]
        assert {role: path.stat().st_size for role, path in found.files.items()} == {
            role: row["size_bytes"] for role, row in table["files"].items()
        }
