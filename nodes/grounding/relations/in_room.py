"""Where in its room a thing is: in a corner, in the middle, against a wall. Walls are those of the room's box.

Source: METHOD section 9. Departs: the room's box stands for its walls, which is right for rectangular rooms only.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Relation, Verdict, label

WALL_M = 0.4  # departs: largest gap to a wall; furniture stands off a little and room boxes end inside the wall
CORNER_M = 0.6  # departs: largest gap to each of the two walls
MIDDLE_SHARE = 0.25  # departs: distance from the room's centre as a share of its half size, at most this
MIDDLE_LEAST_M = 0.3


def judge(case: Case) -> list[Verdict]:
    """One verdict a target; a target in no room never holds."""
    verdicts = []
    for target in case.targets:
        room = case.room_boxes.get(target.id)
        if room is None:
            verdicts.append(Verdict(0.0, False, f"{label(target)} is in no room"))
            continue
        gaps = np.minimum(target.box[0] - room[0], room[1] - target.box[1])[:2]
        if case.relation == "in the middle":
            half = np.ptp(room, axis=0)[:2] / 2
            aside = np.abs(target.center - room.mean(axis=0))[:2]
            share = float((aside / np.maximum(half, 1e-6)).max())
            holds = share <= MIDDLE_SHARE or float(np.linalg.norm(aside)) <= MIDDLE_LEAST_M
            words = f"{label(target)} is {float(np.linalg.norm(aside)):.2f} m from the middle of its room"
            verdicts.append(Verdict(max(1 - share, 0.0), holds, words))
            continue
        corner = case.relation == "in the corner"
        gap, limit = (float(gaps.max()), CORNER_M) if corner else (float(gaps.min()), WALL_M)
        what = "the farther of the two nearest walls" if corner else "the nearest wall"
        words = f"{label(target)} is {max(gap, 0):.2f} m from {what} of its room"
        verdicts.append(Verdict(float(np.exp(-max(gap, 0))), gap <= limit, words))
    return verdicts


RELATION = Relation(
    phrases={
        "in the corner": ("in the corner", "in a corner", "at the corner", "in the corner of the room"),
        "in the middle": (
            "in the middle of the room",
            "in the center of the room",
            "in the centre of the room",
            "in the middle",
            "in the center",
            "in the centre",
        ),
        "against the wall": (
            "against the wall",
            "against a wall",
            "by the wall",
            "at the wall",
            "along the wall",
            "on the wall",
            "near the wall",
            "next to the wall",
        ),
    },
    anchors=dict.fromkeys(("in the corner", "in the middle", "against the wall"), (0, 0)),
    judge=judge,
)
