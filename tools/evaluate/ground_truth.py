"""What is known to be true of a data set, in the one form that all scoring reads; metres, z up.

A procedural house (house.py) and a truth file (truth_file.py) are both turned into it. A layer that is None is not
known and not scored; one that is empty is known to hold nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.runtime.arrays import F64
from placegraph.runtime.language.word_forms import normal_form

MIN_COSINE = 0.5  # BBQ; with WordLlama couch/sofa is .51, chair/table .18

# "well": asked for. "poorly": not asked for, but a map object that lies on it is not wrong. "never": as if not there.
Sight = Literal["well", "poorly", "never"]


class Words:
    """The classes of a data set, and which of them a word means.

    A word means the class of which it is the name or one of the other words, in normal form (plurals alike). With
    `embedding` any other word means the class with the nearest word in WordLlama's space, if their cosine is
    MIN_COSINE or more.
    """

    def __init__(self, classes: Mapping[str, Sequence[str]], embedding: bool = False) -> None:
        """`classes`: other words of each class by its name. Raises ValueError when a word belongs to two."""
        self.classes = {name: tuple(others) for name, others in classes.items()}
        self.names = tuple(self.classes)
        self.embedding = embedding
        self.class_of_word: dict[str, str] = {}  # by normal form
        for name, others in self.classes.items():
            for word in (name, *others):
                known = self.class_of_word.setdefault(normal_form(word), name)
                if known != name:
                    raise ValueError(f"the word {word!r} belongs to two classes, {known!r} and {name!r}")
        self._encoder = TextEncoder()

    def called(self, words: Sequence[str]) -> list[str]:
        """The class of each word; "" where it means none."""
        found = [self.class_of_word.get(normal_form(word), "") for word in words]
        unknown = [i for i, name in enumerate(found) if not name]
        if self.embedding and unknown and self.class_of_word:
            known = list(self.class_of_word)
            cosines = self._encoder.encode([words[i] for i in unknown]) @ self._encoder.encode(known).T
            for i, row in zip(unknown, cosines, strict=True):
                best = int(row.argmax())
                found[i] = self.class_of_word[known[best]] if row[best] >= MIN_COSINE else ""
        return found

    def likeness(self, words: Sequence[str]) -> F64:
        """(words, classes) cosines of words with the names of the classes."""
        return np.asarray(self._encoder.encode(words) @ self._encoder.encode(self.names).T, np.float64)


@dataclass(frozen=True)
class KnownFloor:
    """A storey from the surface that is walked on to its ceiling; `seen`: the walk was on it."""

    bottom_m: float
    top_m: float
    seen: bool = True


@dataclass(frozen=True, eq=False)
class KnownPlace:
    """A room or location: the number of its floor, and its outline (N, 2); asked for when `seen`."""

    floor: int
    outline: F64
    seen: bool = True


@dataclass(frozen=True, eq=False)
class KnownObject:
    """An object: the name of its class and its axis-aligned box (2, 3), lowest and highest corner."""

    name: str
    box: F64
    seen: Sight = "well"


@dataclass(frozen=True, eq=False)
class Known:
    """All layers. Without floors every place lies on floor 0, and so does everything of the map."""

    floors: tuple[KnownFloor, ...] | None = None
    rooms: tuple[KnownPlace, ...] | None = None
    locations: tuple[KnownPlace, ...] | None = None
    objects: tuple[KnownObject, ...] | None = None
    words: Words = field(default_factory=lambda: Words({}))  # every object's name is one of its classes
    trajectory: Mapping[int, F64] | None = None  # world_from_camera (4, 4) by stamp_ns
