"""Questions about a house, each with the one object that is right, checked on the true boxes alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.simulator.asking.forms_place import location_requests, place_requests
from placegraph.tools.simulator.asking.forms_relation import (
    between_requests,
    chain_requests,
    double_requests,
    relation_requests,
)
from placegraph.tools.simulator.asking.forms_view import ordinal_requests, view_requests
from placegraph.tools.simulator.asking.relations import relations
from placegraph.tools.simulator.asking.request import Request
from placegraph.tools.simulator.asking.scene import Scene, scene_of
from placegraph.tools.simulator.asking.scopes import scopes
from placegraph.tools.simulator.asking.speech import fitting_words, spoken
from placegraph.tools.simulator.asking.standpoints import standpoints
from placegraph.tools.simulator.model import House

SALT = 8_009  # keeps the questions' randomness apart from what else is drawn from the seed
MAX_PER_TARGET = 3
SMALL_TARGET_M = 0.15  # smaller ones are asked for where nothing better is left
FIELDS = ("text", "target", "box", "form", "anchors", "room", "floor", "viewpoint", "program")


@dataclass(frozen=True, eq=False)
class AskedQuestion:
    """A request and its one right answer: the target's id and box (2, 3) min and max in metres, world frame."""

    text: str
    target: int
    box: F64
    form: str
    anchors: tuple[int, ...]  # ids of the items that it is told by
    room: int  # of the target
    floor: int
    viewpoint: F64 | None = None  # (3,) the eyes of the asker, where the answer depends on them
    program: str = (
        ""  # what it means, in the words of nodes/grounding/program_syntax.py; "" in files from before there was one
    )


def questions(house: House, seed: int, count: int = 60) -> list[AskedQuestion]:
    """Up to `count` questions about a furnished house, spread over forms, rooms and targets; fewer where it has fewer.

    Raises ConfigError when the count is negative or the house's items are not numbered from 0.
    """
    if count < 0:
        raise ConfigError(f"count: {count} questions cannot be asked; give 0 or more")
    if not house.items:
        return []
    random = np.random.default_rng([seed, SALT])
    scene = scene_of(house)
    asked: list[AskedQuestion] = []
    texts: list[str] = []
    for request in _chosen(scene, requests_by_form(scene, random), count, random):
        text, anchors, program = spoken(request, random)
        one = request.target.id
        box = np.stack((scene.low[one], scene.high[one]))
        if text not in texts:
            texts.append(text)
            room, floor = int(scene.room[one]), int(scene.floor[one])
            asked.append(AskedQuestion(text, one, box, request.form, anchors, room, floor, request.eye, program))
    return asked


def requests_by_form(scene: Scene, random: np.random.Generator) -> dict[str, list[Request]]:
    """All requests about a house that have one right answer, by form, in random order."""
    places = scopes(scene)
    stands = standpoints(scene.house, random)
    answers = relations(scene)
    found = [*place_requests(scene, places), *location_requests(scene, places)]
    for scope in places:
        found += relation_requests(scene, scope, answers)
        found += between_requests(scene, scope)
        found += double_requests(scene, scope, answers, random)
        found += chain_requests(scene, scope, answers)
        found += view_requests(scene, scope, stands)
        found += ordinal_requests(scene, scope, stands)
    forms: dict[str, list[Request]] = {}
    found = [request for request in found if fitting_words(request)]
    for k in random.permutation(len(found)).tolist():
        forms.setdefault(found[k].form, []).append(found[k])
    return {form: forms[form] for form in sorted(forms)}


def _chosen(scene: Scene, forms: dict[str, list[Request]], count: int, random: np.random.Generator) -> list[Request]:
    """Requests taken from the forms in turn, each time the one whose target, room and class were asked for least."""
    targets: Counter[int] = Counter()
    rooms: Counter[int] = Counter()
    classes: Counter[str] = Counter()
    chosen: list[Request] = []
    small = scene.size.max(axis=1) < SMALL_TARGET_M

    def weight(request: Request) -> tuple[float, ...]:
        one = request.target.id
        worn = 2.0 * targets[one] + 0.5 * classes[scene.names[one]] + 0.25 * rooms[int(scene.room[one])]
        return (worn + 1.5 * (not request.needed) + 2.0 * float(small[one]),)

    while len(chosen) < count and any(forms.values()):
        for form in random.permutation(sorted(forms)).tolist():
            left = [request for request in forms[form] if targets[request.target.id] < MAX_PER_TARGET]
            forms[form] = left
            if not left or len(chosen) == count:
                continue
            best = min(range(len(left)), key=lambda k: weight(left[k]))
            request = left.pop(best)
            chosen.append(request)
            targets[request.target.id] += 1
            rooms[int(scene.room[request.target.id])] += 1
            classes[scene.names[request.target.id]] += 1
    return chosen


def to_json(asked: Sequence[AskedQuestion]) -> list[dict[str, Any]]:
    """Questions as plain values for a JSON file, lengths rounded to 1 mm."""
    return [
        {
            "text": one.text,
            "target": one.target,
            "box": np.round(one.box, 3).tolist(),
            "form": one.form,
            "anchors": list(one.anchors),
            "room": one.room,
            "floor": one.floor,
            "viewpoint": None if one.viewpoint is None else np.round(one.viewpoint, 3).tolist(),
            "program": one.program,
        }
        for one in asked
    ]


def from_json(values: Sequence[dict[str, Any]]) -> list[AskedQuestion]:
    """Questions read back from to_json's values; raises SourceError naming the first one that is damaged."""
    return [_read(value, k) for k, value in enumerate(values)]


def _read(value: dict[str, Any], place: int) -> AskedQuestion:
    if isinstance(value, dict) and "program" not in value:
        value = value | {"program": ""}  # a file from before questions had one
    if not isinstance(value, dict) or sorted(value) != sorted(FIELDS):
        raise SourceError(f"question {place}: expected the fields {', '.join(FIELDS)}")
    try:
        box = np.array(value["box"], np.float64).reshape(2, 3)
        eye = None if value["viewpoint"] is None else np.array(value["viewpoint"], np.float64).reshape(3)
        ids = [int(value[name]) for name in ("target", "room", "floor")]
        anchors = tuple(int(one) for one in value["anchors"])
    except (TypeError, ValueError):
        raise SourceError(f"question {place}: a number, the box or the viewpoint is damaged") from None
    text, form, program = (str(value[name]) for name in ("text", "form", "program"))
    return AskedQuestion(text, ids[0], box, form, anchors, ids[1], ids[2], eye, program)
