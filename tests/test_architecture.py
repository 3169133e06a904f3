"""The shape of the code: rings, one importer for each outside library, packages. (structure)"""

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from placegraph.runtime.config import read
from placegraph.tools.graph import node_types

ROOT = Path(__file__).parents[1]
FOLDERS = ("configs", "models_onnx", "nodes", "runtime", "tools")
RING_OF_RUNTIME = {  # a file or a folder of files
    **dict.fromkeys(("errors", "arrays", "validation", "messages", "vision", "scene_graph"), 0),
    **dict.fromkeys(("language", "query.request", "query.reply"), 1),
    **dict.fromkeys(("health", "recording", "node", "renamed_settings", "setting_errors", "bus.flow_control"), 1),
    **dict.fromkeys(("config", "bus", "query", "process", "launcher", "inline", "log"), 3),
}
RING_OF_FOLDER = {"models_onnx": 1, "nodes": 2, "tools": 4, "configs": 4}
PACKAGES = {
    f"placegraph.runtime.{path.parent.relative_to(ROOT / 'runtime').as_posix().replace('/', '.')}"
    for path in (ROOT / "runtime").glob("*/__init__.py")
}
ONLY_IMPORTERS = {
    "zenoh": ("runtime/bus/session.py",),
    "rerun": ("runtime/recording.py", "nodes/recorder/"),
    "onnxruntime": ("models_onnx/session.py", "tools/training/onnx_export.py"),
    "kiss_icp": ("nodes/pose/kiss_icp.py",),
    "llama_cpp": ("runtime/language/llama_library.py", "runtime/language/language_model.py"),
    "wordllama": ("models_onnx/text_encoder.py",),
    "depthai": ("nodes/camera/oak.py",),
    "onnx": (
        "tools/training/drawn_scene_network.py",
        "tools/training/onnx_export.py",
        "tools/training/batch_norm_folding.py",
    ),
    "torch": ("tools/training/",),
    "embreex": ("tools/simulator/",),
    "trimesh": ("tools/export/glb.py",),
    "typer": ("tools/",),
    "rich": ("tools/",),
}


def sources() -> list[Path]:
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))


def imports(path: Path) -> Iterator[str]:
    """Every imported module; `from package import name` also as package.name, which may be a module."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module or ""
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def ring(module: str) -> int:
    """Ring of placegraph.<folder>.<file>; a package itself counts as its folder's ring."""
    _, folder, *rest = module.split(".")
    if folder != "runtime":
        return RING_OF_FOLDER[folder]
    if not rest or module in PACKAGES:  # only docstrings and re-exports
        return 0
    known = [".".join(rest[:n]) for n in (2, 1) if ".".join(rest[:n]) in RING_OF_RUNTIME]
    assert known, f"{module} has no ring"
    return RING_OF_RUNTIME[known[0]]


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(("placegraph", *(parts[:-1] if parts[-1] == "__init__" else parts)))


@pytest.mark.parametrize("path", sources(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_to_the_same_or_a_lower_ring_and_no_node_imports_another(path: Path) -> None:
    own = module_of(path)
    for name in imports(path):
        if not name.startswith("placegraph."):
            continue
        assert ring(name) <= ring(own), f"{own} (ring {ring(own)}) imports {name} (ring {ring(name)})"
        if own.startswith("placegraph.nodes.") and name.startswith("placegraph.nodes."):
            assert name.split(".")[2] == own.split(".")[2], f"{own} imports another node: {name}"


def test_every_runtime_file_has_a_ring_and_every_ring_a_file() -> None:
    for path in (ROOT / "runtime").rglob("*.py"):
        ring(module_of(path))
    for name in RING_OF_RUNTIME:
        path = ROOT / "runtime" / name.replace(".", "/")
        assert path.is_dir() or path.with_suffix(".py").is_file(), name


@pytest.mark.parametrize("library", ONLY_IMPORTERS)
def test_each_outside_library_has_one_home(library: str) -> None:
    importers = [
        str(path.relative_to(ROOT)) for path in sources() if library in {name.split(".")[0] for name in imports(path)}
    ]
    strangers = [name for name in importers if not name.startswith(ONLY_IMPORTERS[library])]
    assert strangers == [] and importers, f"{library} is imported by {strangers or 'nobody'}"


def test_the_package_list_equals_the_tree() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    tree = {f"placegraph.{'.'.join(p.parent.relative_to(ROOT).parts)}" for p in sources() if p.name == "__init__.py"}
    folders = {f"placegraph.{'.'.join(p.parent.relative_to(ROOT).parts)}" for p in sources()}
    assert set(settings["packages"]) == tree == folders
    assert all((ROOT / folder / "py.typed").exists() for folder in FOLDERS)


def test_files_stay_short() -> None:
    lengths = {str(p.relative_to(ROOT)): len(p.read_text().splitlines()) for p in sources()}
    assert {name: count for name, count in lengths.items() if count > 300} == {}


@pytest.mark.parametrize("path", sorted((ROOT / "configs").glob("*.toml")), ids=lambda path: path.name)
def test_packaged_dataflows_name_known_nodes_and_settings(path: Path) -> None:
    types = node_types()
    for name, settings in read(path).nodes.items():
        validated = types[name].config_type.model_validate(settings)
        assert set(settings) <= set(validated.model_dump())
