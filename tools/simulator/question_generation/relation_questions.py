"""Questions by relations without a viewer: on, under, above, below, next to, near, closest, between, two relations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.runtime.arrays import Bool
from placegraph.tools.simulator.question_generation.box_relations import (
    NO,
    YES,
    TernaryArray,
    between,
    closest,
    farthest,
    single_match,
)
from placegraph.tools.simulator.question_generation.class_synonyms import ItemMention, NameGroup
from placegraph.tools.simulator.question_generation.item_table import ItemTable
from placegraph.tools.simulator.question_generation.question_spec import QuestionSpec, unique_mentions
from placegraph.tools.simulator.question_generation.search_scopes import SearchScope

PHRASES: dict[str, str] = {
    "on": "on the {}", "under": "under the {}", "above": "above the {}", "below": "below the {}",
    "next to": "next to the {}", "near": "near the {}", "closest": "closest to the {}",
    "farthest": "farthest from the {}", "between": "between the {} and the {}",
}  # fmt: skip
PROGRAM_TEXTS: dict[str, str] = {
    "on": "on ({})", "under": "under ({})", "above": "above ({})", "below": "under ({})", "next to": "near ({})",
    "near": "near ({})", "closest": "closest ({})", "farthest": "farthest ({})", "between": "between ({}, {})",
}  # fmt: skip
MAX_ANCHOR_DISTANCE_M = 4.5  # between two anchors
MIN_ANCHOR_SIZE_RATIO = 0.3  # smallest size of an anchor relative to the target


def relation_questions(
    table: ItemTable, scope: SearchScope, answers: dict[str, TernaryArray]
) -> Iterator[QuestionSpec]:
    """Questions by one anchor: on, under, above, below, next to, near, closest, farthest."""
    for anchor in unique_mentions(table, scope):
        for form, relation in answers.items():
            column = relation[:, anchor.id]
            for target in _targets(table, scope, anchor, column == YES):
                if single_match(column, table.peers(target, scope.mask)) == target.id:
                    yield _question(table, form, target, scope, (anchor,))
        yield from _by_distance(table, scope, anchor)


def _targets(table: ItemTable, scope: SearchScope, anchor: ItemMention, fit: Bool) -> Iterator[ItemMention]:
    """Items that may be asked for by an anchor, with all words that also mean another item of the house."""
    longest = table.size.max(axis=1)
    fit = fit & table.can_be_target & scope.mask & (longest[anchor.id] >= MIN_ANCHOR_SIZE_RATIO * longest)
    for target in table.mentions(fit):
        if target.id != anchor.id and np.count_nonzero(table.of(target.name_group.classes)) > 1:
            yield target


def _question(
    table: ItemTable, form: str, target: ItemMention, scope: SearchScope, anchors: tuple[ItemMention, ...]
) -> QuestionSpec:
    is_ambiguous = table.has_class_peer(target.id, scope.mask)
    return QuestionSpec(form, target, scope, "", (PHRASES[form],), (PROGRAM_TEXTS[form],), anchors, None, is_ambiguous)


def _by_distance(table: ItemTable, scope: SearchScope, anchor: ItemMention) -> Iterator[QuestionSpec]:
    """The item of a scope closest to an anchor, and the farthest in a room; not where they touch."""
    done: set[frozenset[str]] = set()
    for target in _targets(table, scope, anchor, table.same_room[:, anchor.id]):
        if target.name_group.classes in done:
            continue  # one search covers all items that share a word
        done.add(target.name_group.classes)
        peers = table.peers(target, scope.mask)
        peers[anchor.id] = False
        for form, winner in (
            ("closest", closest(table, anchor.id, peers)),
            ("farthest", farthest(table, anchor.id, peers) if scope.kind == "room" else None),
        ):
            if winner is None or not _is_told_by_distance(table, winner, anchor.id):
                continue
            for name_group in table.name_groups[winner]:
                if name_group.classes == target.name_group.classes:
                    yield _question(table, form, ItemMention(winner, name_group), scope, (anchor,))


def _is_told_by_distance(table: ItemTable, target: int, anchor: int) -> bool:
    """Whether a distance to the anchor may single an item out: same room, neither carries the other."""
    carried = table.support[target] == anchor or table.support[anchor] == target
    return bool(table.can_be_target[target] and table.same_room[target, anchor] and not carried)


def between_questions(table: ItemTable, scope: SearchScope) -> Iterator[QuestionSpec]:
    """Questions by two anchors of one room between which the target is."""
    anchors = unique_mentions(table, scope)
    for k, first in enumerate(anchors):
        for second in anchors[k + 1 :]:
            apart = first.id != second.id and table.same_room[first.id, second.id]
            if not apart or table.distance[first.id, second.id] > MAX_ANCHOR_DISTANCE_M:
                continue
            answers = between(table, first.id, second.id)
            for target in _targets(table, scope, first, answers == YES):
                if single_match(answers, table.peers(target, scope.mask)) == target.id:
                    yield _question(table, "between", target, scope, (first, second))


def two_relation_questions(
    table: ItemTable, scope: SearchScope, answers: dict[str, TernaryArray], random: np.random.Generator
) -> Iterator[QuestionSpec]:
    """Questions by two relations of the target: the lamp next to the bed and near the window."""
    anchors = unique_mentions(table, scope)
    for first in anchors:
        for second in anchors:
            if table.names[first.id] == table.names[second.id] or not table.same_room[first.id, second.id]:
                continue
            form, second_form = [("on", "near"), ("next to", "near"), ("above", "near"), ("near", "next to")][
                random.integers(4)
            ]
            joint = np.minimum(answers[form][:, first.id], answers[second_form][:, second.id])
            for target in _targets(table, scope, first, joint == YES):
                peers = table.peers(target, scope.mask)
                is_ambiguous = table.has_class_peer(target.id, scope.mask)
                if target.id != second.id and is_ambiguous and single_match(joint, peers) == target.id:
                    phrase = (" and " if form != "on" else " ").join((PHRASES[form], PHRASES[second_form]))
                    conditions = (PROGRAM_TEXTS[form], PROGRAM_TEXTS[second_form])
                    yield QuestionSpec("two anchors", target, scope, "", (phrase,), conditions, (first, second))


def chain_questions(table: ItemTable, scope: SearchScope, answers: dict[str, TernaryArray]) -> Iterator[QuestionSpec]:
    """Questions by an anchor that needs an anchor itself: the book on the nightstand next to the bed."""
    for last in unique_mentions(table, scope):
        for link in ("next to", "near", "below"):
            linked = answers[link][:, last.id]
            for middle in table.mentions(table.can_be_anchor & scope.mask & (linked == YES)):
                group = table.peers(middle, scope.mask)
                if np.count_nonzero(group) > 1 and single_match(linked, group) == middle.id:
                    yield from _chain_targets(table, scope, answers, middle, last, link)


def _chain_targets(
    table: ItemTable,
    scope: SearchScope,
    answers: dict[str, TernaryArray],
    middle: ItemMention,
    last: ItemMention,
    link: str,
) -> Iterator[QuestionSpec]:
    for form in ("on", "next to", "above"):
        column = answers[form][:, middle.id]
        for target in _targets(table, scope, middle, column == YES):
            peers = table.peers(target, scope.mask)
            if (
                target.id == last.id
                or not table.has_class_peer(target.id, scope.mask)
                or single_match(column, peers) != target.id
            ):
                continue
            if _has_one_reading(table, answers, target, middle.name_group, peers, form, last, link):
                phrase = f"{PHRASES[form]} {PHRASES[link]}"
                conditions = PROGRAM_TEXTS[form].replace("{}", "{{}}; {}").format(PROGRAM_TEXTS[link])
                yield QuestionSpec("chain", target, scope, "", (phrase,), (conditions,), (middle, last))


def _has_one_reading(
    table: ItemTable,
    answers: dict[str, TernaryArray],
    target: ItemMention,
    middle: NameGroup,
    peers: Bool,
    form: str,
    last: ItemMention,
    link: str,
) -> bool:
    """Whether no other item fits when the second relation is attached to the target instead of the anchor."""
    group = table.of(middle.classes)
    at_some = answers[form][:, group].max(axis=1)
    also_fits = np.minimum(at_some, answers[link][:, last.id]) > NO
    also_fits[target.id] = False
    return not (also_fits & peers).any()
