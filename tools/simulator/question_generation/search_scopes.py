"""Where a question searches: the whole house, a floor or a room, with unambiguous words for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import Bool
from placegraph.tools.simulator.house_model import Room
from placegraph.tools.simulator.question_generation import WORDS
from placegraph.tools.simulator.question_generation.class_synonyms import ItemMention
from placegraph.tools.simulator.question_generation.item_table import ItemTable

INTERCHANGEABLE_ROOMS = ("hallway", "corridor")  # words that are used for each other
AREA_RATIO = 1.25  # smallest ratio of areas for "larger"


@dataclass(frozen=True)
class ScopePhrase:
    """One phrase for a scope; `{}` in it is a word for the item `landmark`."""

    text: str
    landmark: ItemMention | None = None
    conditions: tuple[str, ...] = ()  # the same as program conditions, `{}` for the landmark


@dataclass(frozen=True, eq=False)
class SearchScope:
    """A mask of items (N,) and all phrases for it; the phrase for the house is empty."""

    kind: str  # house, floor, room
    mask: Bool
    words: tuple[ScopePhrase, ...]
    room: int | None = None


def search_scopes(table: ItemTable) -> tuple[SearchScope, ...]:
    """All scopes that can be named: the house, the floors of several, the rooms that words tell apart."""
    scopes = [SearchScope("house", np.ones(table.count, bool), (ScopePhrase(""),))]
    floors = len(table.house.floors)
    for index in range(floors if floors > 1 else 0):
        scopes.append(SearchScope("floor", table.floor == index, tuple(map(_on_floor, floor_words(index, floors)))))
    for room in table.house.rooms:
        words = _room_words(table, room)
        if words:
            scopes.append(SearchScope("room", table.room == room.id, words, room.id))
    return tuple(scopes)


def floor_words(index: int, floors: int) -> tuple[str, ...]:
    """Unambiguous words for a floor; never "first floor", which has two meanings."""
    if floors == 2:
        return (
            ("upstairs", "on the upper floor", "on the second floor")
            if index
            else ("downstairs", "on the ground floor", "on the lower floor")
        )
    if index == 0:
        return ("on the ground floor",)
    return ("on the top floor",) if index == floors - 1 else ("on the middle floor",) if floors == 3 else ()


def _on_floor(words: str) -> ScopePhrase:
    return ScopePhrase(words, conditions=(f"floor ({words.removeprefix('on the ')})",))


def _in_room(text: str, *conditions: str, floor: str = "") -> ScopePhrase:
    """A phrase for a room, its name first among the conditions; floor: the words of the floor that follow it."""
    place = _on_floor(floor).conditions if floor else ()
    return ScopePhrase(
        f"in the {text}{' ' * bool(floor)}{floor}", conditions=(f"room ({'; '.join(conditions)})", *place)
    )


def _rooms_of_word(table: ItemTable, room: Room) -> list[Room]:
    """All rooms that the word for a room may mean, including itself."""
    kinds = INTERCHANGEABLE_ROOMS if room.type in INTERCHANGEABLE_ROOMS else (room.type,)
    return [room for room in table.house.rooms if room.type in kinds]


def _room_words(table: ItemTable, room: Room) -> tuple[ScopePhrase, ...]:
    names = WORDS["room_words"].get(room.type, (room.type,))
    same_named = _rooms_of_word(table, room)
    if len(same_named) == 1:
        return tuple(_in_room(name, name) for name in names)
    floor_mates = [words_for_floor for words_for_floor in same_named if words_for_floor.floor == room.floor]
    words = []
    floors = len(table.house.floors)
    if floors > 1 and len(floor_mates) == 1:
        words += [
            _in_room(names[0], names[0], floor=words_for_floor) for words_for_floor in floor_words(room.floor, floors)
        ]
        if floors == 2:
            level = "upstairs" if room.floor else "downstairs"
            words.append(_in_room(f"{level} {names[0]}", names[0], f"floor ({level})"))
    elif floors > 1:
        ending = floor_words(room.floor, floors)
        words += [
            _in_room(f"{adjective} {names[0]}", names[0], _size_condition(adjective), floor=ending[0])
            for adjective in _size_words(room, floor_mates)
            if ending
        ]
    words += [_in_room(f"{size} {names[0]}", names[0], _size_condition(size)) for size in _size_words(room, same_named)]
    return tuple(words + _content_words(table, room, same_named, names[0]))


def _size_words(room: Room, rooms: list[Room]) -> tuple[str, ...]:
    area, other_areas = room.area_m2, [other.area_m2 for other in rooms if other.id != room.id]
    if not other_areas:
        return ()
    if area >= AREA_RATIO * max(other_areas):
        return ("larger", "bigger") if len(other_areas) == 1 else ("largest",)
    if area * AREA_RATIO <= min(other_areas):
        return ("smaller", "small") if len(other_areas) == 1 else ("smallest",)
    return ()


def _size_condition(adjective: str) -> str:
    return {"larger": "largest", "bigger": "largest", "smaller": "smallest", "small": "is small"}.get(
        adjective, adjective
    )


def _content_words(table: ItemTable, room: Room, same_named: list[Room], name: str) -> list[ScopePhrase]:
    """The room with the desk: no other room that the word may mean has one."""
    among = np.isin(table.room, [room.id for room in same_named])
    words = []
    for item_id in np.flatnonzero(table.can_be_anchor & (table.room == room.id)).tolist():
        for name_group in table.name_groups[item_id]:
            if table.names[item_id] != "window" and np.flatnonzero(table.of(name_group.classes) & among).tolist() == [
                item_id
            ]:
                conditions = (f"room ({name}; with ({{}}))",)
                words.append(ScopePhrase(f"in the {name} with the {{}}", ItemMention(item_id, name_group), conditions))
                break
    return words
