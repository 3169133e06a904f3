"""The constant-velocity motion model: a camera's last motion, continued."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from placegraph.runtime.arrays import F64

MIN_SPAN_CHANGE = 0.05  # share; the stamps of an even frame rate differ by rounding
MAX_EXTRAPOLATION = 3.0  # times the last motion; chosen by hand, a hand-held camera does not keep a motion for longer


def extrapolate_motion(delta: F64, span_ns: int, delta_span_ns: int) -> F64:
    """The motion (4, 4) of `delta_span_ns` continued for `span_ns`: the spans differ where live frames are dropped."""
    if span_ns <= 0 or delta_span_ns <= 0 or abs(span_ns / delta_span_ns - 1) < MIN_SPAN_CHANGE:
        return delta
    ratio = min(span_ns / delta_span_ns, MAX_EXTRAPOLATION)
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(Rotation.from_matrix(delta[:3, :3]).as_rotvec() * ratio).as_matrix()
    motion[:3, 3] = delta[:3, 3] * ratio
    return motion
