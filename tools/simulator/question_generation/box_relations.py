"""Relations between boxes with three values: NO, MAYBE and YES; a MAYBE makes a question unfit.

Rows are targets, columns are anchors. The margins between NO and YES are wide, so that the truth does not depend on how
a relation is measured. Metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.arrays import F64, Bool
from placegraph.tools.simulator.house_model import ON_FLOOR
from placegraph.tools.simulator.question_generation.item_table import ItemTable

NO, MAYBE, YES = 0, 1, 2
TernaryArray = NDArray[np.int8]

NEXT_TO_M, NOT_NEXT_TO_M = 0.4, 1.0  # between surfaces
NEAR_M, NOT_NEAR_M = 0.8, 1.8
TABLES = ("table", "coffee table", "desk", "kitchen counter", "piano", "bench", "chair", "ironing board", "nightstand")
CLOSER_RATIO, CLOSER_M = 1.3, 0.3  # factor and offset by which the closest is nearer than the second


def ternary(yes: Bool, maybe: Bool) -> TernaryArray:
    """YES where both hold, MAYBE where only the second holds, else NO."""
    return np.where(yes & maybe, YES, np.where(maybe, MAYBE, NO)).astype(np.int8)


def single_match(answers: TernaryArray, mask: Bool) -> int | None:
    """The id of the only item in the mask that is not NO, if it is YES; else None."""
    left = np.flatnonzero(mask & (answers > NO))
    return int(left[0]) if len(left) == 1 and answers[left[0]] == YES else None


def relations(table: ItemTable) -> dict[str, TernaryArray]:
    """(N, N) relations without a viewer by name: on, under, above, below, next to, near."""
    above = _above(table)
    relations_by_name = {
        "on": _on(table),
        "under": _under(table),
        "above": above,
        "below": np.ascontiguousarray(above.T),
        "next to": _within(table, NEXT_TO_M, NOT_NEXT_TO_M),
        "near": _within(table, NEAR_M, NOT_NEAR_M),
    }
    for relation in relations_by_name.values():
        np.fill_diagonal(relation, NO)
    return relations_by_name


def _overlap_share(table: ItemTable) -> F64:
    """(N, N) share of the target's footprint that lies over or under the anchor's."""
    sides = np.clip(-table.axis_gap[..., :2], 0, None)
    area = np.prod((table.high - table.low)[:, :2], axis=1)
    return np.asarray(np.minimum(sides.prod(axis=2) / np.maximum(area, 1e-9)[:, None], 1.0))


def _rests_on(table: ItemTable) -> Bool:
    """(N, N) whether the target stands on the anchor itself."""
    return np.asarray(table.support[:, None] == np.arange(table.count)[None])


def _on(table: ItemTable) -> TernaryArray:
    bottom, top = table.low[:, None, 2], table.high[None, :, 2]
    resting = _rests_on(table)
    carried = resting | ((resting.astype(np.int64) @ resting.astype(np.int64)) > 0)
    over = (_overlap_share(table) > 0.1) & (bottom > table.low[None, :, 2] + 0.1) & (bottom < top + 0.15)
    return ternary(resting, carried | over)


def _under(table: ItemTable) -> TernaryArray:
    """Below furniture, on the floor: entirely or nearly so for YES, partly for MAYBE."""
    share, lower = _overlap_share(table), table.high[:, None, 2] < table.high[None, :, 2] - 0.02
    floored = (table.support[:, None] == ON_FLOOR) & (table.support[None] == ON_FLOOR)
    roofs = np.array([name in TABLES for name in table.names], bool)[None]
    return ternary(
        (share > 0.6) & lower & floored & roofs, (share > 0.05) & (table.low[:, None, 2] < table.high[None, :, 2])
    )


def _above(table: ItemTable) -> TernaryArray:
    """Items on walls and ceilings above furniture, aligned with it and with nothing else of that kind near."""
    width = (table.high - table.low)[:, :2]
    lined = -table.axis_gap[..., :2] >= 0.5 * np.minimum(width[:, None], width[None])
    rise = table.low[:, None, 2] - table.high[None, :, 2]
    hangs = (table.support < ON_FLOOR)[:, None] & (table.support == ON_FLOOR)[None]
    windows = np.array([name == "window" for name in table.names], bool)
    hangs |= windows[:, None] & np.array([name == "radiator" for name in table.names], bool)[None]
    yes = hangs & table.same_room & (table.plan_gap <= 0.25) & lined.any(axis=2) & (rise > -0.02) & (rise < 1.6)
    return ternary(yes, table.same_floor & (table.plan_gap <= 0.8) & (rise > -0.3))


def _within(table: ItemTable, yes_m: float, no_m: float) -> TernaryArray:
    """Beside each other with surfaces at most `yes_m` apart; NO beyond `no_m`."""
    level = table.axis_gap[..., 2] < 0
    resting = _rests_on(table)
    apart = ~(resting | resting.T) & (_overlap_share(table) < 0.25) & (_overlap_share(table).T < 0.25)
    yes = table.same_room & level & apart & (table.gap <= yes_m)
    return ternary(yes, table.same_floor & (table.gap <= no_m))


def between(table: ItemTable, a: int, b: int) -> TernaryArray:
    """(N,) whether each item is between two others in plan, none of them on or over another."""
    start, way = table.center[a, :2], table.center[b, :2] - table.center[a, :2]
    length = max(float(np.linalg.norm(way)), 1e-6)
    offset = table.center[:, :2] - start
    along = offset @ way / length**2
    aside = np.abs(offset @ np.array([-way[1], way[0]])) / length
    low = min(table.low[a, 2], table.low[b, 2]) - 0.2
    high = max(table.high[a, 2], table.high[b, 2]) + 0.2
    free = (table.plan_gap[:, a] > 0) & (table.plan_gap[:, b] > 0) & table.same_room[:, a]
    level = (table.center[:, 2] > low) & (table.center[:, 2] < high)
    yes = free & level & (along > 0.22) & (along < 0.78) & (aside <= min(0.22 * length, 0.45))
    loose = (along > -0.05) & (along < 1.05) & (aside <= max(0.6 * length, 0.8)) & table.same_floor[:, a]
    loose[[a, b]] = False
    return ternary(yes, loose)


def closest(table: ItemTable, anchor: int, mask: Bool) -> int | None:
    """The item of the mask that is nearest to the anchor by surfaces and by centres, by a margin, or None."""
    ids = np.flatnonzero(mask)
    if len(ids) < 2:
        return None
    order = ids[np.argsort(table.gap[ids, anchor], kind="stable")]
    first, rivals = int(order[0]), order[1:]
    led = table.gap[rivals[0], anchor] >= table.gap[first, anchor] * CLOSER_RATIO + CLOSER_M
    return first if led and (table.distance[rivals, anchor] >= table.distance[first, anchor] + 0.2).all() else None


def farthest(table: ItemTable, anchor: int, mask: Bool) -> int | None:
    """The item of the mask that is farthest from the anchor by surfaces and by centres, by a margin, or None."""
    ids = np.flatnonzero(mask)
    if len(ids) < 2:
        return None
    order = ids[np.argsort(-table.gap[ids, anchor], kind="stable")]
    first, rivals = int(order[0]), order[1:]
    led = table.gap[first, anchor] >= table.gap[rivals[0], anchor] * CLOSER_RATIO + CLOSER_M
    return first if led and (table.distance[rivals, anchor] <= table.distance[first, anchor] - 0.2).all() else None
