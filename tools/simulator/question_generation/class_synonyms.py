"""The words for each class, and all the classes that a listener may understand by a word."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from placegraph.tools.simulator.house_model import ON_FLOOR, House, PlacedItem
from placegraph.tools.simulator.object_classes import CLASSES

ClassSet = frozenset[str]  # names of classes

PLURAL = ("curtains", "drapes", "stairs")
# Words that state a material, size or use that the ground truth does not contain.
NEVER_SAID = (
    "wooden chair", "wooden bench", "double bed", "single bed", "wine bottle", "water bottle", "books", "mattress",
    "living room table", "range", "workstation",
)  # fmt: skip

# The classes that a listener may understand by the words of a class; default: the class itself.
_CONFUSED_WITH_CLASS: dict[str, tuple[str, ...]] = {
    "chair": ("chair", "armchair", "office chair", "stool"),
    "armchair": ("armchair", "office chair"),
    "bench": ("bench", "stool"),
    "table": ("table", "coffee table", "desk", "nightstand"),
    "dresser": ("dresser", "cabinet"),
    "cabinet": ("cabinet", "dresser", "kitchen counter"),
    "tv": ("tv", "monitor"),
    "monitor": ("monitor", "tv"),
    "lamp": ("lamp", "ceiling lamp"),
    "potted plant": ("potted plant", "vase"),
    "picture": ("picture", "mirror"),
}
# Words with a narrower or wider meaning than their class.
_CONFUSED_WITH_WORD: dict[str, tuple[str, ...]] = {
    "seat": ("chair", "armchair", "office chair", "stool", "bench", "sofa"),
    "dining chair": ("chair", "stool"),
    "kitchen chair": ("chair", "stool"),
    "desk chair": ("office chair", "chair", "armchair"),
    "computer chair": ("office chair", "chair", "armchair"),
    "lounge chair": ("armchair", "office chair", "sofa"),
    "settee": ("sofa", "bench", "armchair"),
    "loveseat": ("sofa", "armchair"),
    "dining table": ("table",),
    "kitchen table": ("table",),
    "dinner table": ("table",),
    "low table": ("coffee table", "nightstand", "table"),
    "tea table": ("coffee table", "table"),
    "bedside cabinet": ("nightstand", "cabinet", "dresser"),
    "closet": ("wardrobe", "cabinet"),
    "shelf": ("bookshelf", "shoe rack"),
    "shelving unit": ("bookshelf", "shoe rack"),
    "chest of drawers": ("dresser", "cabinet", "nightstand"),
    "cupboard": ("cabinet", "dresser", "wardrobe", "kitchen counter"),
    "tv screen": ("tv", "monitor", "laptop"),
    "display": ("monitor", "tv", "laptop"),
    "computer screen": ("monitor", "tv", "laptop"),
    "oven": ("stove", "microwave"),
    "cooker": ("stove", "microwave"),
    "floor lamp": ("lamp",),
    "table lamp": ("lamp",),
    "standing lamp": ("lamp",),
    "flowerpot": ("vase", "potted plant"),
    "painting": ("picture",),
    "artwork": ("picture",),
    "luggage": ("suitcase", "backpack"),
    "travel bag": ("suitcase", "backpack"),
    "dish": ("bowl", "cup"),
}


def _in_room(*types: str) -> Callable[[House, PlacedItem], bool]:
    return lambda house, placed: house.rooms[placed.room].type in types


def _in_location(kind: str) -> Callable[[House, PlacedItem], bool]:
    return lambda house, placed: placed.location >= 0 and house.locations[placed.location].kind == kind


def _height_m(placed: PlacedItem) -> float:
    low, high = placed.item.extent
    return float(high[2] - low[2])


# Words that are true for some members of their class only.
_TRUE_OF: dict[str, Callable[[House, PlacedItem], bool]] = {
    "kitchen chair": _in_room("kitchen"),
    "kitchen table": _in_room("kitchen"),
    "kitchen sink": _in_room("kitchen"),
    "washbasin": _in_room("bathroom", "laundry"),
    "hallway bench": _in_room("hallway"),
    "bath towel": _in_room("bathroom"),
    "hand towel": _in_room("bathroom", "laundry"),
    "dining chair": _in_location("dining area"),
    "dining table": _in_location("dining area"),
    "dinner table": _in_location("dining area"),
    "desk chair": _in_location("work area"),
    "computer chair": _in_location("work area"),
    "floor lamp": lambda _, placed: placed.support == ON_FLOOR,
    "standing lamp": lambda _, placed: placed.support == ON_FLOOR,
    "table lamp": lambda _, placed: placed.support >= 0,
    "bar stool": lambda _, placed: _height_m(placed) > 0.6,
    "barstool": lambda _, placed: _height_m(placed) > 0.6,
    "footstool": lambda _, placed: _height_m(placed) < 0.46,
    "cardboard box": lambda _, placed: placed.item.color_name in ("brown", "light brown", "beige"),
    "carton": lambda _, placed: placed.item.color_name in ("brown", "light brown", "beige"),
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
    return frozenset(_CONFUSED_WITH_WORD.get(word, _CONFUSED_WITH_CLASS.get(class_name, (class_name,))))


def name_groups(house: House, placed: PlacedItem) -> tuple[NameGroup, ...]:
    """All true names of an item, in the order of its class's words."""
    object_class = next(object_class for object_class in CLASSES if object_class.name == placed.item.name)
    grouped: dict[ClassSet, tuple[list[str], list[str]]] = {}
    for words, column in ((object_class.training_words, 0), (object_class.held_out_words, 1)):
        for word in words:
            if word not in NEVER_SAID and (word not in _TRUE_OF or _TRUE_OF[word](house, placed)):
                grouped.setdefault(classes_meant_by(word, object_class.name), ([], []))[column].append(word)
    return tuple(
        NameGroup(classes, tuple(training_words), tuple(held_out_words))
        for classes, (training_words, held_out_words) in grouped.items()
    )
