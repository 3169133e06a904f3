"""The tiny networks of the model tests."""

import importlib.util
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def tiny_models():
    """The functions of tests/models_onnx/make_tiny_models.py."""
    file = Path(__file__).parents[2] / "models_onnx" / "make_tiny_models.py"
    spec = importlib.util.spec_from_file_location("make_tiny_models", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
