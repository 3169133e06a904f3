"""The typed program that a request is parsed into: a thing to find and its conditions, nested.

One schema for everything people say of an object: attributes, anchors with conditions of their own, relations,
negation, ordinals, superlatives, groups, viewpoints, room and floor. The conventions of `CONDITIONS` come from reading
400 human-written requests (Nr3D). Not as in the paper, which has targets and anchors only.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from pydantic import BaseModel, ConfigDict, model_validator

from placegraph.runtime.language.word_forms import normal_form

ANYTHING = "thing"  # the noun of what has no name of its own: "something under the bed"
SAME_KIND = "one"  # the noun of an anchor of the target's own kind: "next to the big one", "far from the others"
MAX_DEPTH = 4  # things within things; people go three deep
MAX_CONDITIONS = 8  # of one thing; the longest of 400 human requests has five

Kind = Literal["look", "group", "relation", "rank", "view", "place", "purpose"]


@dataclass(frozen=True)
class ConditionForm:
    """What a condition of one name takes: how many things (minimum, maximum), words, a number; and its meaning."""

    kind: Kind
    things: tuple[int, int]
    meaning: str
    words: bool = False
    number: Literal["never", "may", "must"] = "never"


CONDITIONS: dict[str, ConditionForm] = {
    "is": ConditionForm(
        "look", (0, 0), "colour, size, material, shape or state, as said: red, big, wooden, round, open", True
    ),
    "count": ConditionForm("group", (0, 0), "is one of so many; of an anchor: there are so many", number="must"),
    "alone": ConditionForm("group", (0, 0), "by itself, away from its like"),
    "near": ConditionForm("relation", (1, 1), "next to, beside, by, close to, at, around it"),
    "on": ConditionForm("relation", (1, 1), "on, on top of, hanging on"),
    "under": ConditionForm("relation", (1, 1), "under, below, beneath"),
    "above": ConditionForm("relation", (1, 1), "above, over"),
    "in": ConditionForm("relation", (1, 1), "inside of a thing (of a room: room)"),
    "holds": ConditionForm("relation", (1, 1), "has it on top or inside"),
    "with": ConditionForm("relation", (1, 1), "with, has, as a part or beside it"),
    "left": ConditionForm("relation", (1, 1), "left of it, on its left side"),
    "right": ConditionForm("relation", (1, 1), "right of it, on its right side"),
    "front": ConditionForm("relation", (1, 1), "in front of it"),
    "behind": ConditionForm("relation", (1, 1), "behind it, at the back of it"),
    "across": ConditionForm("relation", (1, 1), "across from, opposite of it"),
    "against": ConditionForm("relation", (1, 1), "against, touching it"),
    "end": ConditionForm("relation", (1, 1), "at the end, foot or head of it"),
    "along": ConditionForm("relation", (1, 1), "on the same wall or side of the room as it"),
    "facing": ConditionForm("relation", (1, 1), "turned towards it"),
    "between": ConditionForm("relation", (1, 2), "between two things, or those of one kind"),
    "corner": ConditionForm("relation", (0, 1), "in a corner of the room, or of the thing"),
    "center": ConditionForm("relation", (0, 1), "in the middle of the room, or of the thing"),
    "closest": ConditionForm("rank", (0, 1), "closest, nearest, closer; without a thing: to the viewer", number="may"),
    "farthest": ConditionForm(
        "rank", (0, 1), "farthest, far from, away from; without a thing: from the viewer", number="may"
    ),
    "leftmost": ConditionForm("rank", (0, 0), "the left one, on the left, first from the left", number="may"),
    "rightmost": ConditionForm("rank", (0, 0), "the right one, on the right, second from the right: 2", number="may"),
    "frontmost": ConditionForm("rank", (0, 0), "the front one", number="may"),
    "backmost": ConditionForm("rank", (0, 0), "the back one, at the back", number="may"),
    "middle": ConditionForm("rank", (0, 0), "the middle one of several"),
    "nth": ConditionForm("rank", (0, 0), "the first, second, third with no side named", number="must"),
    "largest": ConditionForm("rank", (0, 0), "largest, larger, biggest", number="may"),
    "smallest": ConditionForm("rank", (0, 0), "smallest, smaller", number="may"),
    "tallest": ConditionForm("rank", (0, 0), "tallest, taller", number="may"),
    "shortest": ConditionForm("rank", (0, 0), "shortest, shorter", number="may"),
    "longest": ConditionForm("rank", (0, 0), "longest, longer, widest, wider", number="may"),
    "highest": ConditionForm("rank", (0, 0), "highest, upper, top", number="may"),
    "lowest": ConditionForm("rank", (0, 0), "lowest, lower, bottom", number="may"),
    "looking": ConditionForm("view", (1, 1), "seen by one who faces it: facing, looking at, from the foot of it"),
    "from": ConditionForm("view", (1, 1), "seen from it: standing at it, entering by it, lying on it"),
    "back": ConditionForm("view", (1, 1), "seen with the back to it"),
    "room": ConditionForm("place", (1, 1), "in a room or area: bathroom, work area, second bedroom"),
    "floor": ConditionForm("place", (0, 0), "on a floor of the building, as said: upstairs, second floor", True),
    "for": ConditionForm("purpose", (0, 0), "what the thing is used for, as said: sit on", True),
}


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class Condition(_Model):
    """One condition on a thing. `number`: 2 in "second from the left", 3 in "one of the three"; 0 when not given."""

    name: str
    things: tuple[Thing, ...] = ()
    words: str = ""
    number: int = 0
    negated: bool = False

    @model_validator(mode="after")
    def _check(self) -> Condition:
        form = CONDITIONS.get(self.name)
        if form is None:
            raise ValueError(f"there is no condition {self.name!r}")
        if not form.things[0] <= len(self.things) <= form.things[1]:
            raise ValueError(f"{self.name} takes {form.things[0]} to {form.things[1]} things, not {len(self.things)}")
        if form.words != bool(self.words):
            raise ValueError(f"{self.name} takes {'words' if form.words else 'no words'}")
        if (form.number == "must" and self.number < 1) or (form.number == "never" and self.number):
            raise ValueError(f"{self.name} takes {'a number from 1' if form.number == 'must' else 'no number'}")
        return self

    @property
    def kind(self) -> Kind:
        """The kind of condition, by which it is scored."""
        return CONDITIONS[self.name].kind


class Thing(_Model):
    """A noun as said and its conditions. "" or ANYTHING: any kind of thing; SAME_KIND: the target's kind."""

    noun: str = ""
    conditions: tuple[Condition, ...] = ()

    def conditions_named(self, name: str) -> Iterator[Condition]:
        """The conditions with this name, in order."""
        return (condition for condition in self.conditions if condition.name == name)


class Program(_Model):
    """A request: the thing to find. Viewpoint, room, floor and purpose are conditions of the target."""

    target: Thing


def normalized(thing: Thing) -> Thing:
    """The program in normal form: nouns singular, conditions sorted, ranks numbered from 1.

    Two programs mean the same when their normal forms are equal.
    """
    conditions = []
    for condition in thing.conditions:
        number = condition.number or int(CONDITIONS[condition.name].number == "may")
        things = tuple(normalized(inner) for inner in condition.things)
        if condition.name == "between":
            things = tuple(sorted(things, key=repr))
        words = normal_form(condition.words).replace("grey", "gray")
        conditions.append(condition.model_copy(update={"things": things, "words": words, "number": number}))
    noun = "" if thing.noun in ("", ANYTHING) else normal_form(thing.noun)
    return Thing(noun=noun, conditions=tuple(sorted(conditions, key=repr)))
