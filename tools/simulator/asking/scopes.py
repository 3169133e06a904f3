"""Where a request looks: the whole house, a floor or a room, and the words that name it without doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import Bool
from placegraph.tools.simulator.asking.names import Mention
from placegraph.tools.simulator.asking.scene import Scene
from placegraph.tools.simulator.model import Room

ROOM_WORDS: dict[str, tuple[str, ...]] = {
    "living room": ("living room", "living room", "lounge"),
    "kitchen": ("kitchen",),
    "office": ("office", "office", "study"),
    "laundry": ("laundry room", "laundry"),
    "hallway": ("hallway", "hall"),
    "corridor": ("corridor", "hallway"),
}
SAME_ROOMS = ("hallway", "corridor")  # a listener may take one for the other
AREA_RATIO = 1.25  # a room is larger than another from here on


@dataclass(frozen=True)
class ScopeWords:
    """One way to say a scope; `{}` in it is a word for the item `inside`."""

    text: str
    inside: Mention | None = None
    means: tuple[str, ...] = ()  # the same as conditions of a program, `{}` for the item


@dataclass(frozen=True, eq=False)
class Scope:
    """Items to look among (N,), and all ways to say so; the house is said by saying nothing."""

    kind: str  # house, floor, room
    mask: Bool
    words: tuple[ScopeWords, ...]
    room: int | None = None


def scopes(scene: Scene) -> tuple[Scope, ...]:
    """All scopes that can be named: the house, the floors of several, the rooms that words tell apart."""
    found = [Scope("house", np.ones(scene.count, bool), (ScopeWords(""),))]
    floors = len(scene.house.floors)
    for index in range(floors if floors > 1 else 0):
        found.append(Scope("floor", scene.floor == index, tuple(map(_on_floor, floor_words(index, floors)))))
    for room in scene.house.rooms:
        words = _room_words(scene, room)
        if words:
            found.append(Scope("room", scene.room == room.id, words, room.id))
    return tuple(found)


def floor_words(index: int, floors: int) -> tuple[str, ...]:
    """Words for a floor that nobody takes for another; "first floor" is never among them, it means two things."""
    if floors == 2:
        return (
            ("upstairs", "on the upper floor", "on the second floor")
            if index
            else ("downstairs", "on the ground floor", "on the lower floor")
        )
    if index == 0:
        return ("on the ground floor",)
    return ("on the top floor",) if index == floors - 1 else ("on the middle floor",) if floors == 3 else ()


def _on_floor(words: str) -> ScopeWords:
    return ScopeWords(words, means=(f"floor ({words.removeprefix('on the ')})",))


def _in_room(text: str, *conditions: str, floor: str = "") -> ScopeWords:
    """Words for a room, its name first among the conditions; floor: those of the floor that follow it."""
    place = _on_floor(floor).means if floor else ()
    return ScopeWords(f"in the {text}{' ' * bool(floor)}{floor}", means=(f"room ({'; '.join(conditions)})", *place))


def _alike(scene: Scene, room: Room) -> list[Room]:
    """All rooms that the word for a room may mean, itself among them."""
    kinds = SAME_ROOMS if room.type in SAME_ROOMS else (room.type,)
    return [one for one in scene.house.rooms if one.type in kinds]


def _room_words(scene: Scene, room: Room) -> tuple[ScopeWords, ...]:
    names = ROOM_WORDS.get(room.type, (room.type,))
    alike = _alike(scene, room)
    if len(alike) == 1:
        return tuple(_in_room(name, name) for name in names)
    floor_mates = [one for one in alike if one.floor == room.floor]
    words = []
    floors = len(scene.house.floors)
    if floors > 1 and len(floor_mates) == 1:
        words += [_in_room(names[0], names[0], floor=one) for one in floor_words(room.floor, floors)]
        if floors == 2:
            level = "upstairs" if room.floor else "downstairs"
            words.append(_in_room(f"{level} {names[0]}", names[0], f"floor ({level})"))
    elif floors > 1:
        ending = floor_words(room.floor, floors)
        words += [
            _in_room(f"{adjective} {names[0]}", names[0], _sized(adjective), floor=ending[0])
            for adjective in _size_words(room, floor_mates)
            if ending
        ]
    words += [_in_room(f"{size} {names[0]}", names[0], _sized(size)) for size in _size_words(room, alike)]
    return tuple(words + _content_words(scene, room, alike, names[0]))


def _size_words(room: Room, rooms: list[Room]) -> tuple[str, ...]:
    own, others = area_m2(room), [area_m2(one) for one in rooms if one.id != room.id]
    if not others:
        return ()
    if own >= AREA_RATIO * max(others):
        return ("larger", "bigger") if len(others) == 1 else ("largest",)
    if own * AREA_RATIO <= min(others):
        return ("smaller", "small") if len(others) == 1 else ("smallest",)
    return ()


def _sized(adjective: str) -> str:
    return {"larger": "largest", "bigger": "largest", "smaller": "smallest", "small": "is small"}.get(
        adjective, adjective
    )


def area_m2(room: Room) -> float:
    """The area of a room's polygon."""
    x, y = room.polygon.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


def _content_words(scene: Scene, room: Room, alike: list[Room], name: str) -> list[ScopeWords]:
    """The room with the desk: it has one, no room that the word may mean has another."""
    among = np.isin(scene.room, [one.id for one in alike])
    words = []
    for one in np.flatnonzero(scene.anchors & (scene.room == room.id)).tolist():
        for naming in scene.namings[one]:
            if scene.names[one] != "window" and np.flatnonzero(scene.of(naming.kin) & among).tolist() == [one]:
                means = (f"room ({name}; with ({{}}))",)
                words.append(ScopeWords(f"in the {name} with the {{}}", Mention(one, naming), means))
                break
    return words
