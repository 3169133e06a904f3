"""Between two anchors: the target's position along the line that joins them, and its distance beside that line."""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import PairFits, Relation, RelationQuery


def evaluate(query: RelationQuery) -> PairFits:
    """All targets and pairs of anchors."""
    settings = query.settings.between
    first, second = query.anchors, query.second_anchors
    assert first is not None and second is not None
    a, b = first.center[:, :2], second.center[:, :2]
    line = b - a
    length = np.maximum(np.linalg.norm(line, axis=1), 1e-6)
    offset = query.targets.center[:, None, :2] - a[None]
    along = np.einsum("nmk,mk->nm", offset, line) / length**2
    aside = np.abs(offset[..., 0] * line[None, :, 1] - offset[..., 1] * line[None, :, 0]) / length
    # what is beside the middle of two long beds is still between them
    normal = np.abs(np.stack((-line[:, 1], line[:, 0]), axis=1)) / length[:, None]
    reach = [np.einsum("mk,mk->m", normal, anchor.size[:, :2]) / 2 for anchor in (first, second)]
    aside = np.maximum(aside - np.minimum(*reach), 0)
    widest = np.maximum(settings.aside_share * length, settings.min_aside_m)
    inner = np.clip((0.5 - np.abs(along - 0.5)) * 5, 0, 1)  # a half at a tenth of the way, whole from a fifth on
    rise = np.abs(query.targets.center[:, None, 2] - ((first.center + second.center) / 2)[None, :, 2])
    inner = inner * (1 - 1.2 * np.abs(along - 0.5))  # the nearer to the middle the better
    values = inner * np.power(0.5, (aside / widest) ** 2 + length / settings.length_m / 4 + np.maximum(rise - 1, 0))

    def sentence(i: int, j: int) -> str:
        ends = f"from {first.labels[j]} to {second.labels[j]}"
        return f"{query.targets.labels[i]} is {along[i, j]:.0%} of the way {ends}, {aside[i, j]:.2f} m beside that line"

    return PairFits(values, sentence)


RELATION = Relation(
    phrases={"between": ("between", "in between", "amid", "in the middle of the two", "in the middle of two")},
    evaluate=evaluate,
)
