"""Requests that depend on where the asker stands: left, right, in front, behind, and places in a row."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.asking.names import Mention
from placegraph.tools.simulator.asking.relations import YES, only
from placegraph.tools.simulator.asking.request import Request, unique_mentions
from placegraph.tools.simulator.asking.scene import Scene
from placegraph.tools.simulator.asking.scopes import Scope
from placegraph.tools.simulator.asking.standpoints import AWAY_M, REACH_M, Standpoint, in_sight, row_from_left, viewed
from placegraph.tools.simulator.model import ON_FLOOR

# Things without a front of their own: before and behind them is told by the viewer alone.
NO_FRONT = (
    "table",
    "coffee table",
    "stool",
    "potted plant",
    "vase",
    "lamp",
    "coat rack",
    "trash can",
    "laundry basket",
)
FRONT_DEGREES = 45.0  # from an anchor's own front, where the viewer's and the anchor's front are one
SAID: dict[str, str] = {
    "left": "to the left of the {}", "right": "to the right of the {}",
    "front": "in front of the {}", "behind": "behind the {}",
}  # fmt: skip
MEANT: dict[str, str] = {"left": "left ({})", "right": "right ({})", "front": "front ({})", "behind": "behind ({})"}
COUNTED = ("first", "second", "third", "fourth")


def view_requests(scene: Scene, scope: Scope, stands: dict[int, tuple[Standpoint, ...]]) -> Iterator[Request]:
    """Requests left of, right of, in front of and behind an anchor, for one who stands in its room and looks at it."""
    for anchor in unique_mentions(scene, scope):
        room = int(scene.room[anchor.id])
        for stand in stands.get(room, ()):
            away = float(np.linalg.norm(scene.center[anchor.id, :2] - stand.eye[:2]))
            if AWAY_M <= away <= REACH_M and in_sight(scene.house.rooms[room], stand.eye, scene.center[anchor.id]):
                yield from _viewed_from(scene, scope, anchor, stand)


def _viewed_from(scene: Scene, scope: Scope, anchor: Mention, stand: Standpoint) -> Iterator[Request]:
    for form, answers in viewed(scene, stand.eye, anchor.id).items():
        if form in ("front", "behind") and not _is_faced(scene, stand, anchor.id):
            continue
        for one in np.flatnonzero(scene.askable & scope.mask & (answers == YES)).tolist():
            for naming in scene.namings[one]:
                peers = scene.of(naming.kin) & scope.mask & scene.same_room[:, anchor.id]
                if only(answers, peers) != one or not _fits(scene, form, one, anchor.id, peers):
                    continue
                needed = scene.has_twin(one, peers)
                tail = SAID[form] + (f" seen from the {stand.door}" if stand.door else "")
                means = (MEANT[form], *_from(stand))
                yield Request(form, Mention(one, naming), scope, "", (tail,), means, (anchor,), stand.eye, needed)


def _from(stand: Standpoint) -> tuple[str, ...]:
    """The view that is said; that of the asker is not."""
    return (f"from ({stand.door})",) if stand.door else ()


def _fits(scene: Scene, form: str, one: int, anchor: int, peers: np.ndarray) -> bool:
    """Whether nothing is carried by the other; before and behind, no peer is nearer: so people use these words."""
    if scene.support[one] == anchor or scene.support[anchor] == one:
        return False
    if form == "front" and scene.support[one] < ON_FLOOR:
        return False  # what hangs on a wall is before nothing
    rivals = np.flatnonzero(peers)
    rivals = rivals[(rivals != one) & (rivals != anchor)]
    return form in ("left", "right") or bool((scene.gap[rivals, anchor] > scene.gap[one, anchor] + 0.2).all())


def _is_faced(scene: Scene, stand: Standpoint, anchor: int) -> bool:
    """Whether the asker stands before the anchor's own front, or it has none."""
    if scene.names[anchor] in NO_FRONT:
        return True
    yaw = scene.house.items[anchor].yaw
    front = np.array([np.sin(yaw), -np.cos(yaw)])
    way = stand.eye[:2] - scene.center[anchor, :2]
    return bool(way @ front >= np.cos(np.radians(FRONT_DEGREES)) * np.linalg.norm(way))


def ordinal_requests(scene: Scene, scope: Scope, stands: dict[int, tuple[Standpoint, ...]]) -> Iterator[Request]:
    """Requests by the place in a row: the second chair from the left, for one who looks at all of them."""
    if scope.room is None:
        return
    kinds = sorted(
        {naming.kin for one in np.flatnonzero(scope.mask).tolist() for naming in scene.namings[one]}, key=sorted
    )
    for kin in kinds:
        ids = np.flatnonzero(scene.of(kin) & scope.mask).tolist()
        if len(ids) < 2:
            continue
        for stand in stands.get(scope.room, ()):
            row = row_from_left(scene, stand.eye, ids)
            room = scene.house.rooms[scope.room]
            if row is None or not all(in_sight(room, stand.eye, scene.center[one]) for one in ids):
                continue
            pure = len({scene.names[one] for one in ids}) == 1
            for place, one in enumerate(row):
                for naming in scene.namings[one]:
                    if naming.kin == kin and scene.askable[one] and scene.has_twin(one, scope.mask):
                        yield from _counted(scope, Mention(one, naming), place, len(row), pure, stand)


def _counted(scope: Scope, target: Mention, place: int, row: int, pure: bool, stand: Standpoint) -> Iterator[Request]:
    """Words for a place in a row of so many; of mixed classes only the ends are the same for every listener."""
    tail = f"as seen from the {stand.door}" if stand.door else "from where I stand"
    for index, end in ((place, "left"), (row - 1 - place, "right")):
        if index == 0:
            means = (f"{end}most", *_from(stand))
            yield Request("ordinal", target, scope, f"{end}most", (tail,), means, (), stand.eye)
        elif pure and index < len(COUNTED) and row > 2:
            means = (f"{end}most {index + 1}", *_from(stand))
            yield Request("ordinal", target, scope, COUNTED[index], (f"from the {end} {tail}",), means, (), stand.eye)
    if pure and row == 3 and place == 1:
        yield Request("ordinal", target, scope, "middle", (tail,), ("middle", *_from(stand)), (), stand.eye)
