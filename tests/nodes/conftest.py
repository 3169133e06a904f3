import runpy
from pathlib import Path

import pytest

MAKER = Path(__file__).parents[1] / "models_onnx" / "make_tiny_models.py"


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model folder with a tiny network of each kind, and its manifest."""
    path = tmp_path_factory.mktemp("tiny")
    runpy.run_path(str(MAKER))["write_models"](path)
    return path
