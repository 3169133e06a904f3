"""Left of, right of, in front of, behind and across from an anchor, as seen along the line of sight to it.

Left and right of a thing with a front are those of a viewer who faces its front, as in Sr3D. Margins leave what is
straight ahead neither left nor right, and nearness counts, as people use these words. Without a named viewpoint "in
front of" and "behind" mostly mean nearness (the best reading of 2,206 human sentences), and left and right count less.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import PairFits, Relation, RelationQuery, axis_gaps_m, decay, distance_m
from placegraph.nodes.grounding.settings import DirectionSettings
from placegraph.runtime.arrays import F64

DEGREES_45 = 0.7


def evaluate(query: RelationQuery) -> PairFits:
    """All pairs."""
    anchors = query.anchors
    assert anchors is not None
    settings = query.settings.directions
    sights = query.viewpoints.lines_of_sight(anchors)
    offset = (query.targets.center[:, None] - anchors.center[None])[..., :2]
    left = np.einsum("nmk,mk->nm", offset, sights.left)
    ahead = np.einsum("nmk,mk->nm", offset, sights.forward)
    gap = distance_m(axis_gaps_m(query.targets, anchors))
    half = anchors.size[:, :2] / 2
    deep = np.einsum("mk,mk->m", np.abs(sights.forward), half)
    wide = np.einsum("mk,mk->m", np.abs(sights.left), half)
    blind = np.asarray(~sights.forward.any(axis=1))
    if query.relation in ("left", "right"):
        main = left if query.relation == "left" else -left
        share = _direction_fit(main, wide, np.abs(ahead) - deep, settings)
        values = np.where(blind, 0.5, share) * decay(gap, settings.half_side_m)
    elif query.relation in ("front", "behind"):
        main = ahead if query.relation == "behind" else -ahead
        share = _direction_fit(main, deep, np.abs(left) - wide, settings)
        unsaid = sights.trust < 1
        mild = settings.unstated_fit + (1 - settings.unstated_fit) * share
        values = np.where(unsaid | blind, np.where(blind, settings.unstated_fit, mild), share) * decay(
            gap, settings.half_front_m
        )
    else:
        share = -ahead / np.maximum(np.linalg.norm(offset, axis=2), 1e-9)
        straight = decay(np.maximum(np.abs(left) - wide, 0), 2.0)
        values = np.clip(0.5 + (share - DEGREES_45), 0, 1) * np.clip(gap / (2 * settings.across_m), 0, 1) * straight

    def sentence(i: int, j: int) -> str:
        a, b = query.targets.labels[i], anchors.labels[j]
        seen = f"seen from the {sights.sources[j]}"
        if blind[j]:
            return f"{b} is at the {sights.sources[j]}, from where it has no sides; {a} is {gap[i, j]:.2f} m from it"
        if query.relation in ("left", "right"):
            side = "left" if left[i, j] > 0 else "right"
            return f"{a} is {abs(left[i, j]):.2f} m to the {side} of {b}, {seen}"
        side = "farther than" if ahead[i, j] > 0 else "nearer than"
        return f"{a} is {abs(ahead[i, j]):.2f} m {side} {b} {seen} and {gap[i, j]:.2f} m from it"

    trust = float(sights.trust.max()) if len(anchors) and query.relation in ("left", "right") else 1.0
    return PairFits(values, sentence, trust=trust)


def _direction_fit(main: F64, half: F64, cross: F64, settings: DirectionSettings) -> F64:
    """Fit 0..1 of a direction: 1 from 45 degrees off the other axis on, 0.5 at 15 degrees, 0 on the other side.

    main (n, m): metres from the anchor's centre in the direction, of which half (m,) lie within the anchor.
    cross (n, m): metres beyond the anchor's edge across the direction, so that what stands before the left end of a
    sofa is before it and hardly to its left.
    """
    beyond = np.maximum(main - half, 0) + settings.within_share * np.maximum(main, 0)
    share = np.where(main > 0, beyond / np.maximum(np.hypot(beyond, np.maximum(cross, 0)), 1e-9), -1.0)
    fit = np.clip(0.5 + (share - settings.min_share) * 0.5 / (DEGREES_45 - settings.min_share), 0.0, 1.0)
    return np.asarray(fit * np.clip(main / settings.margin_m - 0.5, 0, 1))


RELATION = Relation(
    phrases={
        "left": (
            "left of", "to the left of", "on the left of", "on the left side of", "left side of",
            "to the left side of", "at the left of", "on the left hand side of", "left from",
        ),
        "right": (
            "right of", "to the right of", "on the right of", "on the right side of", "right side of",
            "to the right side of", "at the right of", "on the right hand side of", "right from",
        ),
        "front": ("in front of", "in the front of", "before", "directly in front of", "right in front of"),
        "behind": ("behind", "in back of", "at the back of", "in the back of", "to the rear of", "directly behind"),
        "across": (
            "facing", "opposite", "opposite to", "across from", "opposite of", "across the room from",
            "directly across from",
        ),
    },
    evaluate=evaluate,
)  # fmt: skip
