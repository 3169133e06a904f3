"""Run an ONNX file (the only onnxruntime import). Names and shapes are checked before anything is run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime as ort
from numpy.typing import NDArray
from onnxruntime.capi import onnxruntime_pybind11_state as ort_state

from placegraph.runtime.errors import ModelError

Shape = tuple[int | str, ...]


def _ort_errors() -> tuple[type[Exception], ...]:
    """Every exception of onnxruntime; they have no common parent besides Exception."""
    kinds = (getattr(ort_state, name) for name in dir(ort_state))
    return tuple(kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Exception))


_ORT_ERRORS = _ort_errors()
_RUN_ERRORS: tuple[type[Exception], ...] = (*_ORT_ERRORS, ValueError)  # ValueError: an input is absent


class Session:
    """One ONNX file, loaded for the CPU: sequential, `threads` threads, no spinning.

    A pool of spinning threads starves the other processes of a small machine: 10.0 instead of 2.1 ms on a loaded one.

    `inputs` and `outputs` map names to shapes; a dimension left open in the file is a string.
    """

    def __init__(self, path: Path, threads: int = 1) -> None:
        """Load `path`; raises ModelError when it is missing or is not an ONNX model that this runtime can run."""
        self.path = path
        options = ort.SessionOptions()
        options.intra_op_num_threads = threads
        options.inter_op_num_threads = 1
        options.execution_mode = ort.ExecutionMode.ORT_SEQUENTIAL
        options.graph_optimization_level = ort.GraphOptimizationLevel.ORT_ENABLE_ALL
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        options.log_severity_level = 3  # errors; they also come as exceptions
        if not path.is_file():
            raise ModelError(f"{path}: no such file")
        try:
            self._session = ort.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        except _ORT_ERRORS as error:
            raise ModelError(f"{path}: not a model that onnxruntime can run: {error}") from error
        self.inputs: dict[str, Shape] = {i.name: _shape(i.shape) for i in self._session.get_inputs()}
        self.outputs: dict[str, Shape] = {o.name: _shape(o.shape) for o in self._session.get_outputs()}

    def expect(
        self, inputs: Mapping[str, Shape] | None = None, outputs: Mapping[str, Shape] | None = None
    ) -> dict[str, int]:
        """Check the file's layout against shape patterns by name; returns the size found for each letter.

        In a pattern an integer is that size and a letter any size, the same wherever it appears. A dimension that the
        file leaves open fits everything and gives no size.

        Raises:
            ModelError: a name is absent or a shape does not fit; names the file, the tensor and both shapes.
        """
        sizes: dict[str, int] = {}
        for kind, shapes, patterns in (("input", self.inputs, inputs or {}), ("output", self.outputs, outputs or {})):
            for name, pattern in patterns.items():
                if name not in shapes:
                    raise ModelError(f"{self.path}: no {kind} named {name!r}; there are: {_listing(shapes)}")
                if not _fits(shapes[name], pattern, sizes):
                    known = f" with {sizes}" if sizes else ""
                    raise ModelError(
                        f"{self.path}: {kind} {name!r} has shape {list(shapes[name])}, expected {list(pattern)}{known}"
                    )
        return sizes

    def only_input(self) -> str:
        """Name of the single input; raises ModelError when the file has more or none."""
        return self._only("input", self.inputs)

    def only_output(self) -> str:
        """Name of the single output; raises ModelError when the file has more or none."""
        return self._only("output", self.outputs)

    def _only(self, kind: str, shapes: dict[str, Shape]) -> str:
        if len(shapes) != 1:
            raise ModelError(f"{self.path}: expected one {kind}, there are: {_listing(shapes)}")
        return next(iter(shapes))

    def run(self, feeds: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Feed arrays by input name; returns every output by name.

        Raises:
            ModelError: an input is absent or of the wrong shape or dtype, or an output holds NaN.
        """
        try:
            results = self._session.run(list(self.outputs), dict(feeds))
        except _RUN_ERRORS as error:
            raise ModelError(f"{self.path}: cannot be run on these inputs: {error}") from error
        values = {name: np.asarray(value) for name, value in zip(self.outputs, results, strict=True)}
        for name, value in values.items():
            if value.dtype.kind == "f" and np.isnan(value).any():
                raise ModelError(f"{self.path}: output {name!r} holds NaN")
        return values


def _shape(dims: list[Any]) -> Shape:
    return tuple(dim if isinstance(dim, int) else str(dim) for dim in dims)


def _listing(shapes: Mapping[str, Shape]) -> str:
    return ", ".join(f"{name} {list(shape)}" for name, shape in shapes.items()) or "none"


def _fits(shape: Shape, pattern: Shape, sizes: dict[str, int]) -> bool:
    if len(shape) != len(pattern):
        return False
    for size, expected in zip(shape, pattern, strict=True):
        if isinstance(size, str):
            continue
        if (sizes.setdefault(expected, size) if isinstance(expected, str) else expected) != size:
            return False
    return True
