"""A question before it is put into words: target, scope, and the relations that single the target out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.question_generation.class_synonyms import ItemMention
from placegraph.tools.simulator.question_generation.item_table import ItemTable
from placegraph.tools.simulator.question_generation.search_scopes import SearchScope


@dataclass(frozen=True, eq=False)
class QuestionSpec:
    """One question with one right answer; every `{}` of the phrases is a word for the next anchor."""

    form: str
    target: ItemMention
    scope: SearchScope
    adjective: str = ""  # before the noun: red, largest, second
    phrases: tuple[str, ...] = ()  # after the noun: "next to the {}"
    conditions: tuple[str, ...] = ()  # the same as program conditions, `{}` for the anchors in order
    anchors: tuple[ItemMention, ...] = ()
    eye: F64 | None = None  # (3,) where the asker stands
    is_ambiguous: bool = True  # without the relation, the noun and the scope alone fit other items, too


def unique_mentions(table: ItemTable, scope: SearchScope) -> list[ItemMention]:
    """All anchors of a scope with the words that mean nothing else there."""
    mentions = table.mentions(table.can_be_anchor & scope.mask)
    return [mention for mention in mentions if np.count_nonzero(table.peers(mention, scope.mask)) == 1]
