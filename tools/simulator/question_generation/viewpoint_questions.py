"""Questions that depend on the position of the asker: left, right, in front, behind, and places in a row."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.house_model import ON_FLOOR
from placegraph.tools.simulator.question_generation import WORDS
from placegraph.tools.simulator.question_generation.asker_positions import (
    MAX_VIEW_M,
    MIN_VIEW_M,
    AskerPosition,
    in_sight,
    order_from_left,
    view_relations,
)
from placegraph.tools.simulator.question_generation.box_relations import YES, single_match
from placegraph.tools.simulator.question_generation.class_synonyms import ItemMention
from placegraph.tools.simulator.question_generation.item_table import ItemTable
from placegraph.tools.simulator.question_generation.question_spec import QuestionSpec, unique_mentions
from placegraph.tools.simulator.question_generation.search_scopes import SearchScope

FRONT_DEGREES = 45.0  # from an anchor's front; within it the viewer's and the anchor's front agree
PHRASES: dict[str, str] = {
    "left": "to the left of the {}", "right": "to the right of the {}",
    "front": "in front of the {}", "behind": "behind the {}",
}  # fmt: skip
PROGRAM_TEXTS: dict[str, str] = {
    "left": "left ({})",
    "right": "right ({})",
    "front": "front ({})",
    "behind": "behind ({})",
}
COUNTED = ("first", "second", "third", "fourth")


def viewpoint_questions(
    table: ItemTable, scope: SearchScope, positions: dict[int, tuple[AskerPosition, ...]]
) -> Iterator[QuestionSpec]:
    """Questions left of, right of, in front of and behind an anchor, for a viewer in its room who looks at it."""
    for anchor in unique_mentions(table, scope):
        room = int(table.room[anchor.id])
        for position in positions.get(room, ()):
            away = float(np.linalg.norm(table.center[anchor.id, :2] - position.eye[:2]))
            if MIN_VIEW_M <= away <= MAX_VIEW_M and in_sight(
                table.house.rooms[room], position.eye, table.center[anchor.id]
            ):
                yield from _questions_from(table, scope, anchor, position)


def _questions_from(
    table: ItemTable, scope: SearchScope, anchor: ItemMention, position: AskerPosition
) -> Iterator[QuestionSpec]:
    for form, answers in view_relations(table, position.eye, anchor.id).items():
        if form in ("front", "behind") and not _faces_front(table, position, anchor.id):
            continue
        for target in table.mentions(table.can_be_target & scope.mask & (answers == YES)):
            peers = table.peers(target, scope.mask & table.same_room[:, anchor.id])
            if single_match(answers, peers) != target.id or not _fits(table, form, target.id, anchor.id, peers):
                continue
            is_ambiguous = table.has_class_peer(target.id, peers)
            phrases = (PHRASES[form] + (f" seen from the {position.door}" if position.door else ""),)
            conditions = (PROGRAM_TEXTS[form], *_viewer_condition(position))
            yield QuestionSpec(form, target, scope, "", phrases, conditions, (anchor,), position.eye, is_ambiguous)


def _viewer_condition(position: AskerPosition) -> tuple[str, ...]:
    """The program condition of a viewpoint that is named; the asker's own is not."""
    return (f"from ({position.door})",) if position.door else ()


def _fits(table: ItemTable, form: str, target: int, anchor: int, peers: np.ndarray) -> bool:
    """Whether neither carries the other and, for front and behind, no peer is nearer to the anchor."""
    if table.support[target] == anchor or table.support[anchor] == target:
        return False
    if form == "front" and table.support[target] < ON_FLOOR:
        return False  # items on a wall are in front of nothing
    rivals = np.flatnonzero(peers)
    rivals = rivals[(rivals != target) & (rivals != anchor)]
    return form in ("left", "right") or bool((table.gap[rivals, anchor] > table.gap[target, anchor] + 0.2).all())


def _faces_front(table: ItemTable, position: AskerPosition, anchor: int) -> bool:
    """Whether the asker stands in front of the anchor's own front, or it has none."""
    if table.names[anchor] in WORDS["no_front"]:
        return True
    yaw = table.house.items[anchor].yaw
    front = np.array([np.sin(yaw), -np.cos(yaw)])
    way = position.eye[:2] - table.center[anchor, :2]
    return bool(way @ front >= np.cos(np.radians(FRONT_DEGREES)) * np.linalg.norm(way))


def ordinal_questions(
    table: ItemTable, scope: SearchScope, positions: dict[int, tuple[AskerPosition, ...]]
) -> Iterator[QuestionSpec]:
    """Questions by place in a row: the second chair from the left, for a viewer who sees all of them."""
    if scope.room is None:
        return
    kinds = sorted({mention.name_group.classes for mention in table.mentions(scope.mask)}, key=sorted)
    for classes in kinds:
        ids = np.flatnonzero(table.of(classes) & scope.mask).tolist()
        if len(ids) < 2:
            continue
        for position in positions.get(scope.room, ()):
            row = order_from_left(table, position.eye, ids)
            room = table.house.rooms[scope.room]
            if row is None or not all(in_sight(room, position.eye, table.center[item_id]) for item_id in ids):
                continue
            pure = len({table.names[item_id] for item_id in ids}) == 1
            for place, item_id in enumerate(row):
                for name_group in table.name_groups[item_id]:
                    if (
                        name_group.classes == classes
                        and table.can_be_target[item_id]
                        and table.has_class_peer(item_id, scope.mask)
                    ):
                        yield from _row_questions(
                            scope, ItemMention(item_id, name_group), place, len(row), pure, position
                        )


def _row_questions(
    scope: SearchScope, target: ItemMention, place: int, row: int, pure: bool, position: AskerPosition
) -> Iterator[QuestionSpec]:
    """Words for a place in a row; with mixed classes only the ends are unambiguous."""
    phrase = f"as seen from the {position.door}" if position.door else "from where I stand"
    for index, end in ((place, "left"), (row - 1 - place, "right")):
        if index == 0:
            conditions = (f"{end}most", *_viewer_condition(position))
            yield QuestionSpec("ordinal", target, scope, f"{end}most", (phrase,), conditions, (), position.eye)
        elif pure and index < len(COUNTED) and row > 2:
            conditions = (f"{end}most {index + 1}", *_viewer_condition(position))
            yield QuestionSpec(
                "ordinal", target, scope, COUNTED[index], (f"from the {end} {phrase}",), conditions, (), position.eye
            )
    if pure and row == 3 and place == 1:
        yield QuestionSpec(
            "ordinal", target, scope, "middle", (phrase,), ("middle", *_viewer_condition(position)), (), position.eye
        )
