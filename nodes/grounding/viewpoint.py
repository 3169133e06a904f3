"""Choose the viewpoint from which left, right, in front of and behind are judged.

In the order of preference: what the request names ("facing the window"), the asker's own position, the front of the
anchor, the centre of its room. With viewpoint c and anchor a the forward direction is f = (a - c) / |a - c| and left is
z x f. Not as in the paper: who faces a thing stands squarely before it, so f is one of the thing's axes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes, Label, Layout
from placegraph.nodes.grounding.settings import DEFAULTS, GroundingSettings
from placegraph.nodes.grounding.word_lists import word_list
from placegraph.runtime.arrays import F64

LONG_FACED = word_list("faced_from_their_end")
MAX_FACED = 50  # things whose lines of sight are compared; bounds the time of "facing the chairs"


class ViewpointKind(Enum):
    """Where a viewer stands; the value is its wording, with the things it refers to."""

    ASKER = "asker"
    ROOM_CENTER = "room centre"
    AT = "{}"
    BEFORE = "place before {}"  # facing it
    FRONT = "front of {}"  # facing the front that the map knows
    BACK_TO = "{} in the back"


@dataclass(frozen=True)
class ViewpointSource:
    """What a viewpoint was taken from: its kind, and the things that it refers to."""

    kind: ViewpointKind
    things: tuple[Label, ...] = ()

    def __str__(self) -> str:
        """The wording in replies: `asker`, `place before window O4`."""
        return self.kind.value.format(", ".join(map(str, self.things)))


ASKER, ROOM_CENTER = ViewpointSource(ViewpointKind.ASKER), ViewpointSource(ViewpointKind.ROOM_CENTER)


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A position `eye` (2,) in metres and a forward unit vector (2,), both in the building's frame.

    forward: None when the viewer turns to whatever is judged. trust: 0..1, lower when nobody named a viewpoint.
    """

    source: ViewpointSource
    eye: F64
    forward: F64 | None = None
    trust: float = 1.0
    z_m: float = 0.0  # height of the floor at the position
    others: tuple[Viewpoint, ...] = ()  # one per door when several match; each room uses its own


@dataclass(frozen=True, eq=False)
class LinesOfSight:
    """Lines of sight to m things: forward (m, 2) unit vectors, eye (m, 2) m, sources, trust (m,) 0..1."""

    forward: F64
    eye: F64
    sources: tuple[ViewpointSource, ...]
    trust: F64

    @property
    def left(self) -> F64:
        """(m, 2) unit vectors to the left."""
        return np.stack((-self.forward[:, 1], self.forward[:, 0]), axis=1)


class ViewpointSelector:
    """Chooses the viewpoints of one request on one map."""

    def __init__(
        self, layout: Layout, asker_world: F64, heading_rad: float = np.nan, settings: GroundingSettings = DEFAULTS
    ) -> None:
        """asker_world: (3,) metres, building frame, NaN when not given; heading_rad: about z from +x, NaN likewise."""
        self.layout, self.settings = layout, settings
        self.requested: Viewpoint | None = None  # set by the program executor
        self.asker: Viewpoint | None = None
        if np.isfinite(asker_world).all():
            heading = np.array([np.cos(heading_rad), np.sin(heading_rad)]) if np.isfinite(heading_rad) else None
            self.asker = Viewpoint(ASKER, asker_world[:2], heading)

    @property
    def explicit(self) -> Viewpoint | None:
        """The viewpoint given by the request, else by the asker."""
        return self.requested or self.asker

    def lines_of_sight(self, anchors: Boxes) -> LinesOfSight:
        """The line of sight to each anchor."""
        middle = self.layout.room_center(anchors.room)
        forward, eye = anchors.center[:, :2] - middle, middle
        sources, trust = [ROOM_CENTER] * len(anchors), np.full(len(anchors), self.settings.viewpoint.unstated_trust)
        viewpoint = self.explicit
        if viewpoint is not None:
            viewpoints = [self._nearest_to_room(viewpoint, int(room)) for room in anchors.room]
            eye = np.array([viewpoint.eye for viewpoint in viewpoints]).reshape(-1, 2)
            forward = anchors.center[:, :2] - eye
            if viewpoint is self.requested and viewpoint.forward is not None:
                forward = np.tile(viewpoint.forward, (len(anchors), 1))
            sources, trust = [v.source for v in viewpoints], np.array([v.trust for v in viewpoints], float)
        else:
            for j in range(len(anchors)):
                if np.isfinite(anchors.front[j]).all():
                    forward[j], trust[j] = -anchors.front[j], 1.0
                    eye[j] = anchors.center[j, :2] + 2.0 * anchors.front[j]
                    sources[j] = ViewpointSource(ViewpointKind.FRONT, (anchors.labels[j],))
                else:
                    forward[j] = self.facing_direction(anchors, j)
        return LinesOfSight(_unit(forward), eye, tuple(sources), trust)

    def overlooking(self, targets: Boxes, reference: Boxes | None = None) -> Viewpoint:
        """One viewpoint for several targets, always with a direction.

        reference: the anchors of the targets' other conditions: "the left pillow on the bed" is seen from the bed's
        foot.
        """
        middle = targets.center[:, :2].mean(axis=0) if len(targets) else np.zeros(2)
        viewpoint = self.explicit
        rooms = targets.room.tolist()
        room = max(set(rooms), key=rooms.count) if rooms else -1
        if viewpoint is not None:
            viewpoint = self._nearest_to_room(viewpoint, room)
            forward = viewpoint.forward if viewpoint.forward is not None else _unit((middle - viewpoint.eye)[None])[0]
            return Viewpoint(
                viewpoint.source, viewpoint.eye, forward if forward.any() else np.array([0.0, 1.0]), viewpoint.trust
            )
        if reference is not None and len(reference) and reference.ids[0]:
            faced = self.in_front_of(reference.take([0]))
            return Viewpoint(faced.source, faced.eye, faced.forward, self.settings.viewpoint.unstated_trust)
        eye = self.layout.room_center(np.array([room]))[0]
        whole = Boxes(
            (Label("the targets"),), targets.low.min(axis=0, keepdims=True), targets.high.max(axis=0, keepdims=True),
            np.zeros(1), np.full((1, 2), np.nan), np.array([room]),
        ) if len(targets) else None  # fmt: skip
        forward = self.facing_direction(whole, 0) if whole is not None else np.array([0.0, 1.0])
        # in the middle of them: look along +y, so that left is -x as on a map
        return Viewpoint(
            ROOM_CENTER, eye, forward if forward.any() else np.array([0.0, 1.0]), self.settings.viewpoint.unstated_trust
        )

    def facing_direction(self, things: Boxes, j: int) -> F64:
        """(2,) forward direction of one who stands in the room squarely before thing j; 0 at the room's very centre."""
        numbers = self.settings.viewpoint
        center, room = things.center[j, :2], things.room[j]
        from_room = center - self.layout.room_center(np.array([room]))[0]
        length = float(np.linalg.norm(from_room))
        size, yaw = things.size[j, :2], float(things.yaw[j])
        axes = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        directions = np.concatenate((axes, -axes))
        long = np.array([size[0] >= size[1], size[1] > size[0]] * 2)
        ratio = float(size.max() / size.min())
        low, high = self.layout.room_low[room, :2], self.layout.room_high[room, :2]
        half = np.abs(directions) @ (size / 2)
        edge = np.where(directions > 0, high - center, low - center)
        steps = np.where(np.abs(directions) > 0.3, edge / np.where(np.abs(directions) > 0.3, directions, 1), np.inf)
        free = steps.min(axis=1) - half
        is_long_faced = things.labels[j].name in LONG_FACED
        broad = (long if is_long_faced else ~long) * (is_long_faced or ratio >= numbers.min_broad_ratio)
        if not broad.any() and (free > numbers.back_to_wall_m).all():
            return from_room / length if length > 0.05 else np.zeros(2)
        score = directions @ (from_room / length) if length > 0.05 else np.zeros(4)
        score = score + 1.0 * (free <= numbers.back_to_wall_m) + 1.0 * broad
        return np.asarray(directions[int(np.argmax(score))])

    def in_front_of(self, things: Boxes) -> Viewpoint:
        """The viewpoint of one who faces the first of some things."""
        front = things.front[0]
        forward = -front / np.linalg.norm(front) if np.isfinite(front).all() else self.facing_direction(things, 0)
        center = things.center[0, :2]
        room = self.layout.room_center(things.room[:1])[0]
        away = max(float((center - room) @ forward), float(np.abs(forward) @ things.size[0, :2]) / 2 + 1.0)
        source = ViewpointSource(ViewpointKind.BEFORE, things.labels[:1])
        return Viewpoint(source, center - forward * away, forward if forward.any() else None)

    def in_front_of_most(self, things: Boxes) -> Viewpoint:
        """The viewpoint of one who faces several things ("the windows"): towards the wall that most of them are on."""
        viewpoints = [self.in_front_of(things.take([j])) for j in range(min(len(things), MAX_FACED))]
        directions = np.array([np.zeros(2) if v.forward is None else v.forward for v in viewpoints])
        return viewpoints[
            int(np.argmax((directions @ directions.T > self.settings.viewpoint.same_direction_cosine).sum(axis=1)))
        ]

    def with_back_to(self, things: Boxes) -> Viewpoint:
        """The viewpoint of one who turns the back to the first of some things."""
        forward = -self.facing_direction(things, 0)
        source = ViewpointSource(ViewpointKind.BACK_TO, things.labels[:1])
        return Viewpoint(source, things.center[0, :2], forward if forward.any() else None)

    def at(self, things: Boxes) -> Viewpoint:
        """The viewpoint of one who stands at a thing and turns to what is judged; of several, at the room's own."""
        viewpoints = [
            Viewpoint(ViewpointSource(ViewpointKind.AT, (label,)), things.center[j, :2], z_m=float(things.low[j, 2]))
            for j, label in enumerate(things.labels)
        ]
        return Viewpoint(viewpoints[0].source, viewpoints[0].eye, others=tuple(viewpoints))

    def _nearest_to_room(self, viewpoint: Viewpoint, room: int) -> Viewpoint:
        """Of a viewpoint with alternatives (several doors) the one at this room; any other viewpoint unchanged.

        When none of them is at the room (not every doorway has a door): the asker's, else the nearest, less trusted.
        """
        if not viewpoint.others:
            return viewpoint
        low, high = self.layout.room_low[room], self.layout.room_high[room]
        places = np.array([[*other.eye, other.z_m] for other in viewpoint.others])
        away = np.linalg.norm(np.maximum(np.maximum(low - places, places - high), 0), axis=1)
        nearest = viewpoint.others[int(np.argmin(away))]
        if away.min() <= self.settings.viewpoint.at_door_m:
            return nearest
        return self.asker or replace(nearest, trust=self.settings.viewpoint.unstated_trust)


def _unit(vectors: F64) -> F64:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.where(length > 1e-3, vectors / np.maximum(length, 1e-9), 0.0))
