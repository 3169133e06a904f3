"""Fixtures of the model tests: the tiny networks, and the real ones beside a development checkout."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from placegraph.models_onnx.manifest import MODELS_VARIABLE, Weights

SHARED = Path(__file__).parents[3] / "shared"


@pytest.fixture(autouse=True)
def no_models_of_this_machine(monkeypatch):
    """What the machine's own variable names must not decide a test."""
    monkeypatch.delenv(MODELS_VARIABLE, raising=False)


@pytest.fixture(scope="session")
def tiny():
    """The functions of make_tiny_models.py."""
    spec = importlib.util.spec_from_file_location("make_tiny_models", Path(__file__).parent / "make_tiny_models.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def weights():
    """Build Weights of files that are not in any manifest."""

    def build(family, labels=(), options=None, **files):
        return Weights("tiny", family, files, tuple(labels), options or {})

    return build


@pytest.fixture
def red():
    """Make an image of pure red, (height, width, 3)."""

    def make(height=64, width=64):
        image = np.zeros((height, width, 3), np.uint8)
        image[..., 0] = 255
        return image

    return make


@pytest.fixture(scope="session")
def real_models():
    """Folder of the real networks."""
    folder = SHARED / "models"
    if not folder.is_dir():
        pytest.skip(f"needs the real weights in {folder}")
    return folder


@pytest.fixture(scope="session")
def real_frame():
    """Read a colour frame of 7-Scenes by number, (480, 640, 3) sRGB."""
    folder = SHARED / "data" / "sevenscenes"
    if not folder.is_dir():
        pytest.skip(f"needs real frames in {folder}")
    import cv2

    def read(number):
        return np.ascontiguousarray(cv2.imread(str(folder / f"frame-{number:06d}.color.jpg"))[:, :, ::-1])

    return read
