"""The items of a house as arrays: row i is the item of id i; metres, world frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from placegraph.runtime.arrays import F64, I64, Bool
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.house_model import House
from placegraph.tools.simulator.question_generation.class_synonyms import ClassSet, ItemMention, NameGroup, name_groups

MIN_TARGET_M = 0.12  # smallest largest extent that a camera can map
MIN_ANCHOR_M = 0.3
# A door belongs to two rooms, a rug lies under everything.
NO_TARGETS = ("door", "rug")
NO_ANCHORS = ("door", "rug", "stairs", "ceiling lamp", "radiator")


@dataclass(frozen=True, eq=False)
class ItemTable:
    """Items by id: corners (N, 3), room, floor and support (N,), extents (N, 3) along their own axes."""

    house: House
    names: tuple[str, ...]
    colors: tuple[str, ...]
    low: F64
    high: F64
    size: F64
    room: I64
    floor: I64
    support: I64
    name_groups: tuple[tuple[NameGroup, ...], ...]
    can_be_target: Bool  # may be a target
    can_be_anchor: Bool  # may be an anchor

    @property
    def count(self) -> int:
        """How many items there are."""
        return len(self.names)

    @cached_property
    def center(self) -> F64:
        """(N, 3) middles of the boxes."""
        return (self.low + self.high) / 2

    @cached_property
    def axis_gap(self) -> F64:
        """(N, N, 3) distance of two boxes along each axis, negative where they overlap."""
        return np.maximum(self.low[:, None] - self.high[None], self.low[None] - self.high[:, None])

    @cached_property
    def gap(self) -> F64:
        """(N, N) metres between the surfaces of two boxes."""
        return np.asarray(np.linalg.norm(np.maximum(self.axis_gap, 0), axis=2))

    @cached_property
    def plan_gap(self) -> F64:
        """(N, N) metres between two boxes in plan."""
        return np.asarray(np.linalg.norm(np.maximum(self.axis_gap[..., :2], 0), axis=2))

    @cached_property
    def distance(self) -> F64:
        """(N, N) metres between the middles of two boxes."""
        return np.asarray(np.linalg.norm(self.center[:, None] - self.center[None], axis=2))

    @cached_property
    def same_room(self) -> Bool:
        """(N, N) whether two items are in one room."""
        return np.asarray(self.room[:, None] == self.room[None])

    @cached_property
    def same_floor(self) -> Bool:
        """(N, N) whether two items are on one floor."""
        return np.asarray(self.floor[:, None] == self.floor[None])

    @cached_property
    def _of_class(self) -> dict[str, Bool]:
        names = np.array(self.names, dtype=str)
        return {name: names == name for name in sorted(set(self.names))}

    @cached_property
    def _masks_by_classes(self) -> dict[ClassSet, Bool]:
        return {}

    def of(self, classes: ClassSet) -> Bool:
        """(N,) which items a word for these classes may mean."""
        if classes not in self._masks_by_classes:
            names = [name for name in sorted(classes) if name in self._of_class]
            masks = [self._of_class[name] for name in names]
            self._masks_by_classes[classes] = np.logical_or.reduce([np.zeros(self.count, bool), *masks])
        return self._masks_by_classes[classes]

    def mentions(self, mask: Bool) -> Iterator[ItemMention]:
        """The items of a mask (N,) by id, each with all its names."""
        return (ItemMention(k, names) for k in np.flatnonzero(mask).tolist() for names in self.name_groups[k])

    def peers(self, mention: ItemMention, mask: Bool) -> Bool:
        """(N,) which items of a mask the words of a mention may mean."""
        return np.asarray(self.of(mention.name_group.classes) & mask)

    def has_class_peer(self, item_id: int, mask: Bool) -> bool:
        """Whether a mask (N,) holds another item of the same class."""
        return bool(np.count_nonzero(self._of_class[self.names[item_id]] & mask) > 1)


def item_table(house: House) -> ItemTable:
    """The arrays of a house; raises ConfigError when its items are not numbered from 0."""
    if [placed.id for placed in house.items] != list(range(len(house.items))):
        raise ConfigError(f"house {house.seed}: its items are not numbered from 0 in their order")
    boxes = np.array([placed.box for placed in house.items]).reshape(-1, 2, 3)
    row_extents = np.array([placed.item.extent for placed in house.items]).reshape(-1, 2, 3)
    size = row_extents[:, 1] - row_extents[:, 0]
    names = tuple(placed.item.name for placed in house.items)
    floor_of_room = [room.floor for room in house.rooms]
    room = np.array([placed.room for placed in house.items], np.int64)
    longest = size.max(axis=1, initial=0)
    return ItemTable(
        house=house,
        names=names,
        colors=tuple(placed.item.color_name for placed in house.items),
        low=boxes[:, 0],
        high=boxes[:, 1],
        size=size,
        room=room,
        floor=np.array([floor_of_room[room_id] for room_id in room], np.int64),
        support=np.array([placed.support for placed in house.items], np.int64),
        name_groups=tuple(name_groups(house, placed) for placed in house.items),
        can_be_target=(longest >= MIN_TARGET_M) & np.array([name not in NO_TARGETS for name in names], bool),
        can_be_anchor=(longest >= MIN_ANCHOR_M) & np.array([name not in NO_ANCHORS for name in names], bool),
    )
