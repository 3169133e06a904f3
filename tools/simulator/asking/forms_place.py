"""Requests by a place or by a thing itself: unique, floor, room, location, size, height and colour."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.asking.names import Mention
from placegraph.tools.simulator.asking.relations import MAYBE, NO, YES, Answers, only
from placegraph.tools.simulator.asking.request import Request
from placegraph.tools.simulator.asking.scene import Scene
from placegraph.tools.simulator.asking.scopes import Scope
from placegraph.tools.simulator.model import Location
from placegraph.tools.simulator.space import inside

SIZE_RATIO, SIZE_M = 1.4, 1.12  # of volumes and of longest extents
HEIGHT_RATIO, HEIGHT_LEAD_M = 1.15, 0.1
LEVEL_LEAD_M = 0.25
WIDE_PLACES = ("cooking area", "bathing area", "washing area", "laundry area", "sleeping area", "entrance area")
LOOSE_M = 1.2  # around a location's outline: what stands there may be taken for a part of it
# Colours that people and lamps' light take for each other.
LIKE: tuple[tuple[str, ...], ...] = (
    ("white", "beige", "gray"), ("beige", "light brown", "yellow", "orange"), ("light brown", "brown", "orange"),
    ("gray", "black"), ("black", "brown"), ("red", "orange", "pink", "brown"), ("orange", "yellow"),
    ("pink", "purple"), ("blue", "purple"), ("yellow", "white"),
)  # fmt: skip


NO_COLOR = ("window", "mirror")  # their colour is that of a thin frame


def place_requests(scene: Scene, scopes: tuple[Scope, ...]) -> Iterator[Request]:
    """Requests of the forms unique, floor, room, superlative, size and color."""
    for scope in scopes:
        for one in np.flatnonzero(scene.askable & scope.mask).tolist():
            for naming in scene.namings[one]:
                peers = np.flatnonzero(scene.of(naming.kin) & scope.mask)
                mention = Mention(one, naming)
                if len(peers) == 1:
                    needed = np.count_nonzero(scene.of(naming.kin)) > 1
                    form = {"house": "unique", "floor": "floor", "room": "room"}[scope.kind]
                    if needed or scope.kind == "house":
                        yield Request(form, mention, scope)
                elif scene.has_twin(one, scope.mask):
                    yield from _by_color(scene, scope, mention, peers)
                    yield from _by_measure(scene, scope, mention, peers)


def alike(one: str, other: str) -> bool:
    """Whether one of two colour words may be said for the other; no word may be any."""
    return not one or not other or one == other or any(one in group and other in group for group in LIKE)


def _by_color(scene: Scene, scope: Scope, mention: Mention, peers: np.ndarray) -> Iterator[Request]:
    own = scene.colors[mention.id]
    if (
        own
        and scene.names[mention.id] not in NO_COLOR
        and not any(alike(own, scene.colors[one]) for one in peers.tolist() if one != mention.id)
    ):
        yield Request("color", mention, scope, adjective=own)


def _by_measure(scene: Scene, scope: Scope, mention: Mention, peers: np.ndarray) -> Iterator[Request]:
    others = peers[peers != mention.id]
    if _is_larger(scene, np.array([mention.id]), others):
        yield Request(
            "size" if len(others) == 1 else "superlative", mention, scope, "big" if len(others) == 1 else "largest"
        )
    if _is_larger(scene, others, np.array([mention.id])):
        yield Request(
            "size" if len(others) == 1 else "superlative", mention, scope, "small" if len(others) == 1 else "smallest"
        )
    tall = scene.size[:, 2]
    if tall[mention.id] >= max(tall[others].max() * HEIGHT_RATIO, tall[others].max() + HEIGHT_LEAD_M):
        yield Request("superlative", mention, scope, "tallest")
    if scope.kind == "house":
        return  # the highest of all floors may be the lowest on its own
    if (scene.low[mention.id, 2] >= scene.low[others, 2] + LEVEL_LEAD_M).all() and (
        scene.high[mention.id, 2] >= scene.high[others, 2] + LEVEL_LEAD_M
    ).all():
        yield Request("superlative", mention, scope, "highest")
    if (scene.low[mention.id, 2] <= scene.low[others, 2] - LEVEL_LEAD_M).all() and (
        scene.high[mention.id, 2] <= scene.high[others, 2] - LEVEL_LEAD_M
    ).all():
        yield Request("superlative", mention, scope, "lowest")


def _is_larger(scene: Scene, large: np.ndarray, small: np.ndarray) -> bool:
    """Whether all of some items are larger than all others, by volume as well as by the longest extent."""
    volume, box_volume = scene.size.prod(axis=1), (scene.high - scene.low).prod(axis=1)
    longest = scene.size.max(axis=1)
    return bool(
        volume[large].min() >= SIZE_RATIO * volume[small].max()
        and box_volume[large].min() >= SIZE_RATIO * box_volume[small].max()
        and longest[large].min() >= SIZE_M * longest[small].max()
    )


def location_requests(scene: Scene, scopes: tuple[Scope, ...]) -> Iterator[Request]:
    """Requests by a group of furniture: the plant in the seating area."""
    for place in scene.house.locations:
        answers = located(scene, place)
        for scope in scopes:
            if scope.kind == "room" or not _is_alone(scene, scope, place):
                continue
            for one in np.flatnonzero(scene.askable & scope.mask & (answers == YES)).tolist():
                for naming in scene.namings[one]:
                    peers = scene.of(naming.kin) & scope.mask
                    if only(answers, peers) == one:
                        needed = scene.has_twin(one, scope.mask)
                        yield Request(
                            "location", Mention(one, naming), scope, tails=(f"in the {place.kind}",),
                            means=(f"room ({place.kind})",), needed=needed,
                        )  # fmt: skip


def _is_alone(scene: Scene, scope: Scope, place: Location) -> bool:
    """Whether a location is in a scope and the only one of its kind there."""
    rooms = set(scene.room[scope.mask].tolist())
    return [one.id for one in scene.house.locations if one.kind == place.kind and one.room in rooms] == [place.id]


def located(scene: Scene, place: Location) -> Answers:
    """(N,) whether each item belongs to a location: members do; what stands around it in its room may."""
    answers = np.full(scene.count, NO, np.int8)
    near = (scene.room == place.room) & (_away_m(scene.center[:, :2], place.outline) <= LOOSE_M)
    answers[(scene.room == place.room) if place.kind in WIDE_PLACES else near] = MAYBE
    answers[list(place.members)] = YES
    return answers


def _away_m(points: F64, outline: F64) -> F64:
    """(N,) metres from points (N, 2) to a polygon (K, 2), 0 inside."""
    nearest = np.full(len(points), np.inf)
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        way = b - a
        share = np.clip((points - a) @ way / max(float(way @ way), 1e-12), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(points - a - share[:, None] * way, axis=1))
    return np.where(inside(outline, points), 0.0, nearest)
