import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from placegraph.models_onnx.session import Session
from placegraph.runtime.errors import ModelError


@pytest.fixture
def double(tmp_path):
    """y = x + x for x (1, N, 4), and z = log x."""
    graph = helper.make_graph(
        [helper.make_node("Add", ["x", "x"], ["y"]), helper.make_node("Log", ["x"], ["z"])],
        "double",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, "N", 4])],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, "N", 4]) for name in "yz"],
    )
    path = tmp_path / "double.onnx"
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), path)
    return path


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ModelError, match=r"nothing\.onnx: no such file"):
        Session(tmp_path / "nothing.onnx")


@pytest.mark.parametrize("content", [b"", b"not a model", b"\x08\x09\x12\x00" * 10])
def test_a_file_that_is_no_model_is_named(tmp_path, content):
    path = tmp_path / "bad.onnx"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"bad\.onnx: not a model"):
        Session(path)


def test_shapes_and_run(double):
    session = Session(double, threads=2)
    assert session.inputs == {"x": (1, "N", 4)}
    assert session.outputs == {"y": (1, "N", 4), "z": (1, "N", 4)}
    x = np.ones((1, 3, 4), np.float32)
    np.testing.assert_array_equal(session.run({"x": x})["y"], 2 * x)


def test_run_with_nothing_in_it(double):
    assert Session(double).run({"x": np.zeros((1, 0, 4), np.float32)})["y"].shape == (1, 0, 4)


@pytest.mark.parametrize(
    "feeds",
    [
        {},
        {"x": np.ones((1, 3, 5), np.float32)},
        {"x": np.ones((1, 3, 4), np.float64)},
        {"other": np.ones((1, 3, 4), np.float32)},
    ],
)
def test_wrong_feeds_are_refused(double, feeds):
    with pytest.raises(ModelError, match=r"double\.onnx: cannot be run"):
        Session(double).run(feeds)


def test_nan_is_refused_and_named(double):
    with pytest.raises(ModelError, match=r"double\.onnx: output 'z' holds NaN"):
        Session(double).run({"x": np.full((1, 1, 4), -1, np.float32)})


def test_expect_binds_letters(double):
    assert Session(double).expect({"x": (1, "N", "D")}, {"y": ("B", 7, "D")}) == {"D": 4, "B": 1}


@pytest.mark.parametrize(
    ("inputs", "outputs", "text"),
    [
        ({"image": (1,)}, {}, r"no input named 'image'; there are: x \[1, 'N', 4\]"),
        ({}, {"w": (1,)}, r"no output named 'w'"),
        ({"x": (1, "N")}, {}, r"input 'x' has shape \[1, 'N', 4\], expected \[1, 'N'\]"),
        ({"x": (1, "N", 5)}, {}, r"expected \[1, 'N', 5\]"),
        ({"x": ("D", "N", "D")}, {}, r"expected \['D', 'N', 'D'\]"),
    ],
)
def test_expect_names_what_does_not_fit(double, inputs, outputs, text):
    with pytest.raises(ModelError, match=text):
        Session(double).expect(inputs, outputs)


def test_only_one(double):
    session = Session(double)
    assert session.only_input() == "x"
    with pytest.raises(ModelError, match=r"expected one output, there are: y .*, z"):
        session.only_output()
