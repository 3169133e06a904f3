import hashlib
import http.server
import runpy
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from placegraph.models_onnx.manifest import MODELS_VARIABLE, FileEntry, find_weights, known_weights
from placegraph.runtime.errors import ModelError
from placegraph.tools.models import app, fetch_file, import_files

MAKER = Path(__file__).parents[1] / "models_onnx" / "make_tiny_models.py"
CONTENT = bytes(range(256)) * 5000  # 1.28 MB: more than one block


@pytest.fixture(autouse=True)
def no_models_of_this_machine(monkeypatch):
    monkeypatch.delenv(MODELS_VARIABLE, raising=False)


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "tiny"
    path.mkdir()
    runpy.run_path(str(MAKER))["write_models"](path)
    return path


@pytest.fixture
def server():
    """A server of CONTENT; its `seen` lists the Range headers, `cut` ends replies after so many bytes."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            wanted = self.headers.get("Range")
            self.server.seen.append(wanted)
            if self.path != "/model.bin":
                self.send_error(404)
                return
            start = int(wanted.removeprefix("bytes=").removesuffix("-")) if wanted and self.server.resumes else 0
            body = CONTENT[start:]
            self.send_response(206 if start else 200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body[: self.server.cut])

        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as running:
        running.seen, running.cut, running.resumes = [], None, True
        running.url = f"http://127.0.0.1:{running.server_port}/model.bin"
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield running
        running.shutdown()
        thread.join()


def entry(url, content=CONTENT):
    return FileEntry(file="model.bin", sha256=hashlib.sha256(content).hexdigest(), size_bytes=len(content), url=url)


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_list_says_where_and_what_is_missing(folder):
    (folder / "decoder.onnx").unlink()
    lines = {line.split()[0]: line for line in run("list", "--models", folder).stdout.splitlines()}
    assert lines["tiny_boxes"].split()[1:] == ["yolo", "none", "0.0", "MB", str(folder)]
    assert lines["tiny_sam"].endswith("missing decoder.onnx")
    assert "missing yolox_nano.onnx" in lines["yolox_nano"]


def test_verify_builds_what_is_there(folder):
    done = run("verify", "--models", folder)
    assert done.exit_code == 0
    assert "tiny_sam             ok" in done.stdout and "yolox_nano           missing" in done.stdout


def test_verify_fails_on_damage_and_on_missing_files_asked_for(folder):
    (folder / "boxes.onnx").write_bytes(b"changed")
    done = run("verify", "--models", folder)
    assert done.exit_code == 1
    assert "tiny_boxes           FAILED: weights 'tiny_boxes': boxes.onnx should have sha256" in done.stdout
    assert run("verify", "tiny_sam", "--models", folder).exit_code == 0
    assert run("verify", "yolox_nano", "--models", folder).exit_code == 1


def test_import_copies_known_files_only(folder, tmp_path):
    target = tmp_path / "weights"
    (folder / "other.onnx").write_bytes(b"unknown")
    done = run("import", folder, "--to", target, "--models", folder)
    assert done.exit_code == 0
    names = ["boxes.onnx", "decoder.onnx", "encoder.onnx", "instances.onnx", "tags.onnx"]
    assert sorted(path.name for path in target.iterdir()) == names
    (target / "manifest.toml").write_bytes((folder / "manifest.toml").read_bytes())
    assert find_weights("tiny_sam", [target]).files["decoder"] == target / "decoder.onnx"


def test_import_of_a_damaged_file_copies_nothing(folder, tmp_path):
    (folder / "tags.onnx").write_bytes(b"changed")
    with pytest.raises(ModelError, match=r"tags\.onnx: sha256 is "):
        import_files(folder, tmp_path / "weights", known_weights([folder]))
    assert not (tmp_path / "weights").exists()


def test_import_of_nothing_is_an_error(tmp_path):
    with pytest.raises(ModelError, match="no such folder"):
        import_files(tmp_path / "no", tmp_path, known_weights())
    with pytest.raises(ModelError, match=r"holds none of the known files: .*yolox_nano\.onnx"):
        import_files(tmp_path, tmp_path, known_weights())


def test_fetch(server, tmp_path):
    path = fetch_file("mine", entry(server.url), tmp_path / "weights")
    assert path.read_bytes() == CONTENT
    assert [p.name for p in path.parent.iterdir()] == ["model.bin"]


@pytest.mark.parametrize("resumes", [True, False])
def test_a_broken_download_is_resumed(server, tmp_path, resumes):
    server.cut, server.resumes = 1000, resumes
    with pytest.raises(ModelError, match=r"ended after 1000 of 1280000 bytes; run the same again to resume"):
        fetch_file("mine", entry(server.url), tmp_path)
    assert not (tmp_path / "model.bin").exists()
    server.cut = None
    assert fetch_file("mine", entry(server.url), tmp_path).read_bytes() == CONTENT
    assert server.seen == [None, "bytes=1000-"]


def test_a_complete_part_needs_no_server(tmp_path):
    wanted = entry("http://127.0.0.1:9/model.bin")
    (tmp_path / f"model.bin.{wanted.sha256[:8]}.part").write_bytes(CONTENT)
    assert fetch_file("mine", wanted, tmp_path).read_bytes() == CONTENT


def test_another_file_is_refused_and_removed(server, tmp_path):
    wanted = entry(server.url, b"x" * len(CONTENT))
    with pytest.raises(ModelError, match=r"gave a file of sha256 .* expected"):
        fetch_file("mine", wanted, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_too_long_a_file_is_refused(server, tmp_path):
    with pytest.raises(ModelError, match="more than the 3 bytes expected"):
        fetch_file("mine", entry(server.url, b"abc"), tmp_path)
    assert not (tmp_path / "model.bin").exists()


@pytest.mark.parametrize(
    ("url", "text"),
    [("", "has no address"), ("file:///etc/hostname", "only http and https"), ("http://127.0.0.1:9/x", "refused")],
)
def test_addresses_that_cannot_be_fetched(tmp_path, url, text):
    with pytest.raises(ModelError, match=text):
        fetch_file("mine", entry(url), tmp_path)


def test_an_absent_page_is_named(server, tmp_path):
    with pytest.raises(ModelError, match=r"/gone: HTTP Error 404"):
        fetch_file("mine", entry(server.url.replace("model.bin", "gone")), tmp_path)


def test_fetch_command_skips_what_is_there(server, folder, tmp_path):
    (folder / "model.bin").write_bytes(CONTENT)
    text = (folder / "manifest.toml").read_text()
    digest = hashlib.sha256((folder / "tags.onnx").read_bytes()).hexdigest()
    row = f'file = "tags.onnx", sha256 = "{digest}"'
    assert row in text
    wanted = entry(server.url)
    text = text.replace(row, f'file = "far.bin", url = "{server.url}", sha256 = "{wanted.sha256}"')
    size = (folder / "tags.onnx").stat().st_size
    (folder / "manifest.toml").write_text(text.replace(f"size_bytes = {size}", f"size_bytes = {len(CONTENT)}"))
    for word in ("fetched", "present"):
        done = run("fetch", "tiny_tags", "--to", tmp_path / "w", "--models", folder)
        assert done.stdout.split() == [word, str(tmp_path / "w" / "far.bin")]
    assert server.seen == [None]
    assert isinstance(run("fetch", "nothing").exception, ModelError)
