"""Largest, smallest, tallest, highest, lowest among the targets.

Source: METHOD section 9. Departs: by box volume, box height, and height of the centre.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Relation, Verdict, label, ranked
from placegraph.runtime.scene_graph import Node

SIZE_MARGIN = 0.05  # departs: log of volume; 5 % is below what boxes from a depth camera can tell
HEIGHT_MARGIN_M = 0.05  # departs: as above, in metres


def _measure(relation: str, node: Node) -> tuple[float, float, str]:
    """Value (greatest first), margin in its unit, and words."""
    size = np.maximum(np.ptp(node.box, axis=0), 0.01)
    if relation in ("largest", "smallest"):
        volume = float(np.prod(size))
        value = float(np.log(volume))
        return (
            (value if relation == "largest" else -value),
            SIZE_MARGIN,
            f"{label(node)} fills a box of {volume:.3f} m3",
        )
    if relation in ("tallest", "shortest"):
        value = float(size[2])
        words = f"{label(node)} is {value:.2f} m tall"
        return (value if relation == "tallest" else -value), HEIGHT_MARGIN_M, words
    if relation in ("longest", "longer"):
        value = float(size[:2].max())
        return value, HEIGHT_MARGIN_M, f"{label(node)} is {value:.2f} m long"
    value = float(node.center[2])
    words = f"the middle of {label(node)} is at a height of {value:.2f} m"
    return (value if relation == "highest" else -value), HEIGHT_MARGIN_M, words


def judge(case: Case) -> list[Verdict]:
    """One verdict a target."""
    found = [_measure(case.relation, target) for target in case.targets]
    margin = found[0][1] if found else 0.0
    return ranked(case, [value for value, _, _ in found], margin, [words for _, _, words in found])


RELATION = Relation(
    phrases={
        "largest": ("largest", "biggest", "widest", "most spacious", "bigger", "larger"),
        "smallest": ("smallest", "tiniest", "littlest", "narrowest", "smaller"),
        "tallest": ("tallest", "taller"),
        "shortest": ("shortest", "shorter"),
        "longest": ("longest", "longer"),
        "highest": ("highest", "topmost", "uppermost", "higher"),
        "lowest": ("lowest", "bottommost", "lower"),
    },
    anchors=dict.fromkeys(("largest", "smallest", "tallest", "shortest", "longest", "highest", "lowest"), (0, 0)),
    judge=judge,
)
