"""The words for each class, and all the classes that a listener may understand by a word."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from placegraph.tools.simulator.house_model import ON_FLOOR, House, PlacedItem
from placegraph.tools.simulator.object_classes import CLASSES
from placegraph.tools.simulator.question_generation import WORDS

ClassSet = frozenset[str]  # names of classes


def _height_m(placed: PlacedItem) -> float:
    low, high = placed.item.extent
    return float(high[2] - low[2])


# Words that are true for some items of their class only, besides those that depend on the room or location.
_TRUE_OF: dict[str, Callable[[PlacedItem], bool]] = {
    "floor lamp": lambda placed: placed.support == ON_FLOOR,
    "standing lamp": lambda placed: placed.support == ON_FLOOR,
    "table lamp": lambda placed: placed.support >= 0,
    "bar stool": lambda placed: _height_m(placed) > 0.6,
    "barstool": lambda placed: _height_m(placed) > 0.6,
    "footstool": lambda placed: _height_m(placed) < 0.46,
    "cardboard box": lambda placed: placed.item.color_name in ("brown", "light brown", "beige"),
    "carton": lambda placed: placed.item.color_name in ("brown", "light brown", "beige"),
}


@dataclass(frozen=True)
class NameGroup:
    """Words for one item that a listener understands as the same classes, by whether training uses them."""

    classes: ClassSet
    training_words: tuple[str, ...]
    held_out_words: tuple[str, ...]


@dataclass(frozen=True)
class ItemMention:
    """An item and the words it is referred to by."""

    id: int
    name_group: NameGroup


@cache
def classes_meant_by(word: str, class_name: str) -> ClassSet:
    """The names of all classes that a listener may understand by a word of a class."""
    return frozenset(WORDS["understood_by_word"].get(word, WORDS["understood_by_class"].get(class_name, (class_name,))))


def _is_true(word: str, house: House, placed: PlacedItem) -> bool:
    """Whether a word of the item's class is true for the item."""
    if word in WORDS["only_in_rooms"]:
        return house.rooms[placed.room].type in WORDS["only_in_rooms"][word]
    if word in WORDS["only_in_location"]:
        return placed.location >= 0 and house.locations[placed.location].kind == WORDS["only_in_location"][word]
    return word not in WORDS["never_used"] and (word not in _TRUE_OF or _TRUE_OF[word](placed))


def name_groups(house: House, placed: PlacedItem) -> tuple[NameGroup, ...]:
    """All true names of an item, in the order of its class's words."""
    object_class = next(object_class for object_class in CLASSES if object_class.name == placed.item.name)
    grouped: dict[ClassSet, tuple[list[str], list[str]]] = {}
    for words, column in ((object_class.training_words, 0), (object_class.held_out_words, 1)):
        for word in words:
            if _is_true(word, house, placed):
                grouped.setdefault(classes_meant_by(word, object_class.name), ([], []))[column].append(word)
    return tuple(
        NameGroup(classes, tuple(training_words), tuple(held_out_words))
        for classes, (training_words, held_out_words) in grouped.items()
    )
