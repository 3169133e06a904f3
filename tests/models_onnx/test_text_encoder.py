import logging
import subprocess
import sys

import numpy as np

from placegraph.models_onnx import text_encoder as text
from placegraph.models_onnx.text_encoder import DIMENSIONS, TextEncoder


def test_no_texts():
    assert TextEncoder().encode([]).shape == (0, DIMENSIONS)


def test_empty_text_gives_a_zero_row():
    rows = TextEncoder().encode(["", "  \n", "...", "cup"])
    assert not rows[:3].any()
    assert rows.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(rows[3]), 1, atol=1e-6)


def test_couch_meets_sofa():
    couch, sofa, cup = TextEncoder().encode(["couch", "sofa", "cup"])
    assert couch @ sofa > 0.4 > couch @ cup


def test_case_and_spaces_do_not_matter():
    rows = TextEncoder().encode(["Table  Lamp", " table lamp "])
    np.testing.assert_array_equal(rows[0], rows[1])


def test_rows_do_not_depend_on_the_other_texts():
    alone = TextEncoder().encode(["cup"])[0]
    among = TextEncoder().encode(["a very long text about a kitchen table", "cup", "cup"])
    np.testing.assert_array_equal(alone, among[1])
    np.testing.assert_array_equal(alone, among[2])


def test_a_caller_cannot_change_the_cache():
    encoder = TextEncoder()
    encoder.encode(["cup"])[:] = 0
    assert encoder.encode(["cup"]).any()


def test_the_texts_used_last_are_kept_and_no_more(monkeypatch):
    encoded = []
    one = text._encode_text
    monkeypatch.setattr(text, "_encode_text", lambda words: encoded.append(words) or one(words))
    encoder = TextEncoder(max_texts=2)
    first = encoder.encode(["cup", "sofa", "cup", "vase", "cup"])  # vase takes the place of sofa
    assert encoded == ["cup", "sofa", "vase"]
    again = encoder.encode(["sofa", "cup", "vase"])
    assert encoded == ["cup", "sofa", "vase", "sofa", "vase"]
    np.testing.assert_array_equal(again, first[[1, 0, 3]])


def test_loading_leaves_logging_alone():
    code = (
        "import logging; from placegraph.models_onnx.text_encoder import TextEncoder; TextEncoder().encode(['cup']);"
        "root = logging.getLogger(); print(len(root.handlers), root.level)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["0", str(logging.WARNING)]
