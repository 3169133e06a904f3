"""Places in a row as seen by a viewer: leftmost, rightmost, frontmost, backmost, the middle one, the n-th.

Source: METHOD section 9. Departs: who looks at several things sees them in order of bearing from where they stand, or
along the line square to the line of sight.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Fits, Relation, apart_m, gaps_m
from placegraph.nodes.grounding.viewpoint import MIDDLE_TRUST, View
from placegraph.runtime.arrays import F64

MARGIN_M = 0.1  # departs: peers have no margin; about the error of a box centre from a depth camera
DOORS = ("door", "doorway", "doorframe", "entrance", "door frame")


def _across_sight(case: Case, view: View) -> F64:
    """(n,) metres to the left of the line of sight."""
    assert view.forward is not None
    offset = case.targets.center[:, :2] - view.eye
    ahead, left = offset @ view.forward, offset @ np.array([-view.forward[1], view.forward[0]])
    # what one looks at along a fixed line is ordered along the line across it; from a place by bearing
    if not len(left) or view.source.startswith("place before") or not (ahead > 0.3).all():
        return np.asarray(left)
    return np.asarray(np.arctan2(left, ahead) * float(np.linalg.norm(offset, axis=1).mean()))


def _entrance_view(case: Case) -> View | None:
    """Who speaks of the back of a room without a viewer sees it from its door."""
    doors = [i for i, one in enumerate(case.layout.all.labels) if one.rsplit(" ", 1)[0] in DOORS]
    rooms = set(case.targets.room.tolist())
    doors = [i for i in doors if int(case.layout.all.room[i]) in rooms]
    if len(doors) != 1 or len(rooms) != 1:
        return None
    door = case.layout.all.take(doors)
    forward = -case.views.square_on(door, 0)
    return View(door.labels[0], door.center[0, :2], forward, MIDDLE_TRUST) if forward.any() else None


def judge(case: Case) -> Fits:
    """One value a target, greatest first; of `middle` and `nth` the order along the row, from the left."""
    targets = case.targets
    if case.relation == "nth" and bool(targets.is_place.all()):  # the second bedroom: in the order of their ids
        values = -np.arange(len(targets), dtype=float)
        return Fits(values[:, None], lambda i, _: f"{targets.labels[i]} by its id", 0.0)
    if case.relation == "nth" and case.views.named is None and case.hint is not None:
        gap = apart_m(gaps_m(targets, case.hint)).min(axis=1)
        return Fits(-gap[:, None], lambda i, _: f"{targets.labels[i]} is {gap[i]:.2f} m from there", MARGIN_M)
    view = case.views.over(targets, case.hint)
    if case.relation == "nth" and case.views.said is not None and case.views.said.forward is None:
        # the first bed as one comes in: of those who stand at a place, the nearest comes first
        away = np.linalg.norm(targets.center[:, :2] - view.eye, axis=1)
        told = f"m from the {view.source}"
        return Fits(-away[:, None], lambda i, _: f"{targets.labels[i]} is {away[i]:.2f} {told}", MARGIN_M)
    if case.relation in ("frontmost", "backmost"):
        if view.source == "room centre":
            view = _entrance_view(case) or view
        assert view.forward is not None
        ahead = (targets.center[:, :2] - view.eye) @ view.forward
        sign = 1.0 if case.relation == "backmost" else -1.0
        words, values = "m along the line of sight", sign * ahead
    else:
        left = _across_sight(case, view)
        if case.relation == "middle":
            left = _along_row(case, left)
        ahead = left - left.mean() if len(left) else left
        values = -left if case.relation == "rightmost" else left
        words = "m to the left of their middle"
    sentence = f"{words}, seen from the {view.source}"
    return Fits(
        values[:, None], lambda i, _: f"{targets.labels[i]} is {ahead[i]:+.2f} {sentence}", MARGIN_M, view.trust
    )  # fmt: skip


def _along_row(case: Case, left: F64) -> F64:
    """The order of a row that runs along the line of sight is that of its own direction."""
    if len(left) < 3 or case.views.named is not None:
        return left
    flat = case.targets.center - case.targets.center.mean(axis=0)
    axis = int(np.argmax(np.ptp(flat, axis=0)))
    return np.asarray(flat[:, axis])


RELATION = Relation(
    phrases={
        "leftmost": (
            "leftmost", "left-most", "furthest left", "farthest left", "on the left", "from the left",
            "on the far left", "on the left side", "from left", "to the left",
        ),
        "rightmost": (
            "rightmost", "right-most", "furthest right", "farthest right", "on the right", "from the right",
            "on the far right", "on the right side", "from right", "to the right",
        ),
        "frontmost": ("frontmost", "foremost", "in the front", "at the front"),
        "backmost": ("backmost", "rearmost", "in the back", "at the back", "at the very back"),
        "middle": (),
        "nth": (),
    },
    judge=judge,
)  # fmt: skip
