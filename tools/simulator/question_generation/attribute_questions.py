"""Questions by place or by attribute: unique, floor, room, location, size, height and colour."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.house_model import FurnitureLocation
from placegraph.tools.simulator.occupancy_grid import points_in_polygon
from placegraph.tools.simulator.question_generation import WORDS
from placegraph.tools.simulator.question_generation.box_relations import MAYBE, NO, YES, TernaryArray, single_match
from placegraph.tools.simulator.question_generation.class_synonyms import ItemMention
from placegraph.tools.simulator.question_generation.item_table import ItemTable
from placegraph.tools.simulator.question_generation.question_spec import QuestionSpec
from placegraph.tools.simulator.question_generation.search_scopes import SearchScope

SIZE_RATIO, SIZE_M = 1.4, 1.12  # of volumes and of longest extents
HEIGHT_RATIO, HEIGHT_LEAD_M = 1.15, 0.1
LEVEL_LEAD_M = 0.25
ROOM_WIDE_LOCATIONS = ("cooking area", "bathing area", "washing area", "laundry area", "sleeping area", "entrance area")
NEAR_LOCATION_M = 1.2  # items this near to an outline may count as part of the location


NO_COLOR = ("window", "mirror")  # only their thin frame has a colour


def attribute_questions(table: ItemTable, search_scopes: tuple[SearchScope, ...]) -> Iterator[QuestionSpec]:
    """Questions of the forms unique, floor, room, superlative, size and color."""
    for scope in search_scopes:
        for mention in table.mentions(table.can_be_target & scope.mask):
            peers = np.flatnonzero(table.peers(mention, scope.mask))
            if len(peers) == 1:
                is_ambiguous = np.count_nonzero(table.of(mention.name_group.classes)) > 1
                form = {"house": "unique", "floor": "floor", "room": "room"}[scope.kind]
                if is_ambiguous or scope.kind == "house":
                    yield QuestionSpec(form, mention, scope)
            elif table.has_class_peer(mention.id, scope.mask):
                yield from _by_color(table, scope, mention, peers)
                yield from _by_measure(table, scope, mention, peers)


def may_be_confused(first: str, second: str) -> bool:
    """Whether people may use one colour word for the other; an empty word may be any colour."""
    return (
        not first
        or not second
        or first == second
        or any(first in group and second in group for group in WORDS["similar_colors"])
    )


def _by_color(table: ItemTable, scope: SearchScope, mention: ItemMention, peers: np.ndarray) -> Iterator[QuestionSpec]:
    color = table.colors[mention.id]
    if (
        color
        and table.names[mention.id] not in NO_COLOR
        and not any(may_be_confused(color, table.colors[peer]) for peer in peers.tolist() if peer != mention.id)
    ):
        yield QuestionSpec("color", mention, scope, adjective=color)


def _by_measure(
    table: ItemTable, scope: SearchScope, mention: ItemMention, peers: np.ndarray
) -> Iterator[QuestionSpec]:
    peer_ids = peers[peers != mention.id]
    if _is_larger(table, np.array([mention.id]), peer_ids):
        yield QuestionSpec(
            "size" if len(peer_ids) == 1 else "superlative", mention, scope, "big" if len(peer_ids) == 1 else "largest"
        )
    if _is_larger(table, peer_ids, np.array([mention.id])):
        yield QuestionSpec(
            "size" if len(peer_ids) == 1 else "superlative",
            mention,
            scope,
            "small" if len(peer_ids) == 1 else "smallest",
        )
    tall = table.size[:, 2]
    if tall[mention.id] >= max(tall[peer_ids].max() * HEIGHT_RATIO, tall[peer_ids].max() + HEIGHT_LEAD_M):
        yield QuestionSpec("superlative", mention, scope, "tallest")
    if scope.kind == "house":
        return  # heights on different floors are not compared
    if (table.low[mention.id, 2] >= table.low[peer_ids, 2] + LEVEL_LEAD_M).all() and (
        table.high[mention.id, 2] >= table.high[peer_ids, 2] + LEVEL_LEAD_M
    ).all():
        yield QuestionSpec("superlative", mention, scope, "highest")
    if (table.low[mention.id, 2] <= table.low[peer_ids, 2] - LEVEL_LEAD_M).all() and (
        table.high[mention.id, 2] <= table.high[peer_ids, 2] - LEVEL_LEAD_M
    ).all():
        yield QuestionSpec("superlative", mention, scope, "lowest")


def _is_larger(table: ItemTable, large: np.ndarray, small: np.ndarray) -> bool:
    """Whether all items `large` are larger than all items `small`, by volume and by the longest extent."""
    volume, box_volume = table.size.prod(axis=1), (table.high - table.low).prod(axis=1)
    longest = table.size.max(axis=1)
    return bool(
        volume[large].min() >= SIZE_RATIO * volume[small].max()
        and box_volume[large].min() >= SIZE_RATIO * box_volume[small].max()
        and longest[large].min() >= SIZE_M * longest[small].max()
    )


def location_questions(table: ItemTable, search_scopes: tuple[SearchScope, ...]) -> Iterator[QuestionSpec]:
    """Questions by a furniture location: the plant in the seating area."""
    for place in table.house.locations:
        answers = location_membership(table, place)
        for scope in search_scopes:
            if scope.kind == "room" or not _is_alone(table, scope, place):
                continue
            for mention in table.mentions(table.can_be_target & scope.mask & (answers == YES)):
                if single_match(answers, table.peers(mention, scope.mask)) == mention.id:
                    is_ambiguous = table.has_class_peer(mention.id, scope.mask)
                    phrases, conditions = (f"in the {place.kind}",), (f"room ({place.kind})",)
                    yield QuestionSpec("location", mention, scope, "", phrases, conditions, is_ambiguous=is_ambiguous)


def _is_alone(table: ItemTable, scope: SearchScope, place: FurnitureLocation) -> bool:
    """Whether a location is in a scope and the only one of its kind there."""
    rooms = set(table.room[scope.mask].tolist())
    return [
        location.id for location in table.house.locations if location.kind == place.kind and location.room in rooms
    ] == [place.id]


def location_membership(table: ItemTable, place: FurnitureLocation) -> TernaryArray:
    """(N,) whether each item belongs to a location: members do, items around it in its room may."""
    answers = np.full(table.count, NO, np.int8)
    near = (table.room == place.room) & (_distances_to_polygon_m(table.center[:, :2], place.outline) <= NEAR_LOCATION_M)
    answers[(table.room == place.room) if place.kind in ROOM_WIDE_LOCATIONS else near] = MAYBE
    answers[list(place.members)] = YES
    return answers


def _distances_to_polygon_m(points: F64, outline: F64) -> F64:
    """(N,) metres from points (N, 2) to a polygon (K, 2), 0 inside."""
    nearest = np.full(len(points), np.inf)
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        way = b - a
        share = np.clip((points - a) @ way / max(float(way @ way), 1e-12), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(points - a - share[:, None] * way, axis=1))
    return np.where(points_in_polygon(outline, points), 0.0, nearest)
