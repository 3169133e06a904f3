"""Relations between boxes with three answers: NO, MAYBE and YES; what is merely MAYBE makes a question unfit.

An array's row is the target, its column the anchor. The margins between NO and YES are wide on purpose: the truth must
hold for every sensible way to measure. Metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.arrays import F64, Bool
from placegraph.tools.simulator.asking.scene import Scene
from placegraph.tools.simulator.model import ON_FLOOR

NO, MAYBE, YES = 0, 1, 2
Answers = NDArray[np.int8]

NEXT_TO_M, NOT_NEXT_TO_M = 0.4, 1.0  # between surfaces
NEAR_M, NOT_NEAR_M = 0.8, 1.8
TABLES = ("table", "coffee table", "desk", "kitchen counter", "piano", "bench", "chair", "ironing board", "nightstand")
LEAD_RATIO, LEAD_M = 1.3, 0.3  # how much nearer the closest is than the second


def graded(yes: Bool, maybe: Bool) -> Answers:
    """YES where both hold, MAYBE where only the second does, else NO."""
    return np.where(yes & maybe, YES, np.where(maybe, MAYBE, NO)).astype(np.int8)


def only(answers: Answers, mask: Bool) -> int | None:
    """The id of the one item in the mask that is not NO, if that is YES; None otherwise."""
    left = np.flatnonzero(mask & (answers > NO))
    return int(left[0]) if len(left) == 1 and answers[left[0]] == YES else None


def relations(scene: Scene) -> dict[str, Answers]:
    """(N, N) answers of the relations that need no viewer, by name: on, under, above, below, next to, near."""
    above = _above(scene)
    tables = {
        "on": _on(scene),
        "under": _under(scene),
        "above": above,
        "below": np.ascontiguousarray(above.T),
        "next to": _beside(scene, NEXT_TO_M, NOT_NEXT_TO_M),
        "near": _beside(scene, NEAR_M, NOT_NEAR_M),
    }
    for table in tables.values():
        np.fill_diagonal(table, NO)
    return tables


def _share_over(scene: Scene) -> F64:
    """(N, N) share of the target's footprint that lies over or under the anchor's."""
    sides = np.clip(-scene.axis_gap[..., :2], 0, None)
    area = np.prod((scene.high - scene.low)[:, :2], axis=1)
    return np.asarray(np.minimum(sides.prod(axis=2) / np.maximum(area, 1e-9)[:, None], 1.0))


def _resting(scene: Scene) -> Bool:
    """(N, N) whether the target stands on the anchor itself."""
    return np.asarray(scene.support[:, None] == np.arange(scene.count)[None])


def _on(scene: Scene) -> Answers:
    bottom, top = scene.low[:, None, 2], scene.high[None, :, 2]
    resting = _resting(scene)
    carried = resting | ((resting.astype(np.int64) @ resting.astype(np.int64)) > 0)
    over = (_share_over(scene) > 0.1) & (bottom > scene.low[None, :, 2] + 0.1) & (bottom < top + 0.15)
    return graded(resting, carried | over)


def _under(scene: Scene) -> Answers:
    """Below furniture, on the floor: wholly or nearly so for YES, by any part of it for MAYBE."""
    share, lower = _share_over(scene), scene.high[:, None, 2] < scene.high[None, :, 2] - 0.02
    floored = (scene.support[:, None] == ON_FLOOR) & (scene.support[None] == ON_FLOOR)
    roofs = np.array([name in TABLES for name in scene.names], bool)[None]
    return graded(
        (share > 0.6) & lower & floored & roofs, (share > 0.05) & (scene.low[:, None, 2] < scene.high[None, :, 2])
    )


def _above(scene: Scene) -> Answers:
    """Of things on walls and ceilings over furniture: they are in line, and nothing else of that kind is near it."""
    width = (scene.high - scene.low)[:, :2]
    lined = -scene.axis_gap[..., :2] >= 0.5 * np.minimum(width[:, None], width[None])
    rise = scene.low[:, None, 2] - scene.high[None, :, 2]
    hangs = (scene.support < ON_FLOOR)[:, None] & (scene.support == ON_FLOOR)[None]
    windows = np.array([name == "window" for name in scene.names], bool)
    hangs |= windows[:, None] & np.array([name == "radiator" for name in scene.names], bool)[None]
    yes = hangs & scene.same_room & (scene.flat_gap <= 0.25) & lined.any(axis=2) & (rise > -0.02) & (rise < 1.6)
    return graded(yes, scene.same_floor & (scene.flat_gap <= 0.8) & (rise > -0.3))


def _beside(scene: Scene, yes_m: float, no_m: float) -> Answers:
    level = scene.axis_gap[..., 2] < 0
    resting = _resting(scene)
    apart = ~(resting | resting.T) & (_share_over(scene) < 0.25) & (_share_over(scene).T < 0.25)
    yes = scene.same_room & level & apart & (scene.gap <= yes_m)
    return graded(yes, scene.same_floor & (scene.gap <= no_m))


def between(scene: Scene, a: int, b: int) -> Answers:
    """(N,) whether each item lies between two others, as seen from above, none of them on or over another."""
    start, way = scene.center[a, :2], scene.center[b, :2] - scene.center[a, :2]
    length = max(float(np.linalg.norm(way)), 1e-6)
    offset = scene.center[:, :2] - start
    along = offset @ way / length**2
    aside = np.abs(offset @ np.array([-way[1], way[0]])) / length
    low = min(scene.low[a, 2], scene.low[b, 2]) - 0.2
    high = max(scene.high[a, 2], scene.high[b, 2]) + 0.2
    free = (scene.flat_gap[:, a] > 0) & (scene.flat_gap[:, b] > 0) & scene.same_room[:, a]
    level = (scene.center[:, 2] > low) & (scene.center[:, 2] < high)
    yes = free & level & (along > 0.22) & (along < 0.78) & (aside <= min(0.22 * length, 0.45))
    loose = (along > -0.05) & (along < 1.05) & (aside <= max(0.6 * length, 0.8)) & scene.same_floor[:, a]
    loose[[a, b]] = False
    return graded(yes, loose)


def closest(scene: Scene, anchor: int, mask: Bool) -> int | None:
    """The item of the mask that is nearest to the anchor by surfaces and by middles, with a lead, or None."""
    ids = np.flatnonzero(mask)
    if len(ids) < 2:
        return None
    order = ids[np.argsort(scene.gap[ids, anchor], kind="stable")]
    first, others = int(order[0]), order[1:]
    led = scene.gap[others[0], anchor] >= scene.gap[first, anchor] * LEAD_RATIO + LEAD_M
    return first if led and (scene.distance[others, anchor] >= scene.distance[first, anchor] + 0.2).all() else None


def farthest(scene: Scene, anchor: int, mask: Bool) -> int | None:
    """The item of the mask that is farthest from the anchor by surfaces and by middles, with a lead, or None."""
    ids = np.flatnonzero(mask)
    if len(ids) < 2:
        return None
    order = ids[np.argsort(-scene.gap[ids, anchor], kind="stable")]
    first, others = int(order[0]), order[1:]
    led = scene.gap[first, anchor] >= scene.gap[others[0], anchor] * LEAD_RATIO + LEAD_M
    return first if led and (scene.distance[others, anchor] <= scene.distance[first, anchor] - 0.2).all() else None
