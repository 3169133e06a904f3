"""A camera's motion, continued."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from placegraph.runtime.arrays import F64

SAME_SPAN = 0.05  # stamps of an even rate differ by rounding
LONGEST_STRETCH = 3.0  # nobody keeps a motion up for longer


def stretched(delta: F64, span_ns: int, old_span_ns: int) -> F64:
    """The motion (4, 4) of `old_span_ns` continued for `span_ns`: live, frames are dropped and the spans differ."""
    if span_ns <= 0 or old_span_ns <= 0 or abs(span_ns / old_span_ns - 1) < SAME_SPAN:
        return delta
    ratio = min(span_ns / old_span_ns, LONGEST_STRETCH)
    made = np.eye(4)
    made[:3, :3] = Rotation.from_rotvec(Rotation.from_matrix(delta[:3, :3]).as_rotvec() * ratio).as_matrix()
    made[:3, 3] = delta[:3, 3] * ratio
    return made
