"""The ground truth of a data set, in the one form that all scoring reads; metres, z up.

A simulated house (house_truth.py) and a truth file (truth_file.py) are both converted to it. A layer that is None is
not known and not scored; an empty one is known to hold nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.runtime.arrays import F64
from placegraph.runtime.language.word_forms import normal_form

MIN_COSINE = 0.5  # source: BBQ; with WordLlama couch/sofa is .51, chair/table .18

# How the walk saw an object. "well": it counts for recall. "poorly": it does not, but a map object on it is not wrong.
# "never": as if it did not exist.
Visibility = Literal["well", "poorly", "never"]


class ClassVocabulary:
    """The classes of a data set, and which of them a word means.

    A word means the class that it names or is a synonym of, in normal form (plurals alike). With `embedding` any other
    word means the class of the nearest word in WordLlama's space, if their cosine is MIN_COSINE or more.
    """

    def __init__(self, classes: Mapping[str, Sequence[str]], embedding: bool = False) -> None:
        """`classes`: synonyms of each class by its name. Raises ValueError when a word belongs to two classes."""
        self.classes = {name: tuple(synonyms) for name, synonyms in classes.items()}
        self.names = tuple(self.classes)
        self.embedding = embedding
        self.class_of_word: dict[str, str] = {}  # by normal form
        for name, synonyms in self.classes.items():
            for word in (name, *synonyms):
                first_class = self.class_of_word.setdefault(normal_form(word), name)
                if first_class != name:
                    raise ValueError(f"the word {word!r} belongs to two classes, {first_class!r} and {name!r}")
        self._encoder = TextEncoder()

    def classes_of(self, words: Sequence[str]) -> list[str]:
        """The class of each word; "" where it means none."""
        classes = [self.class_of_word.get(normal_form(word), "") for word in words]
        unmatched = [i for i, name in enumerate(classes) if not name]
        if self.embedding and unmatched and self.class_of_word:
            vocabulary = list(self.class_of_word)
            cosines = self._encoder.encode([words[i] for i in unmatched]) @ self._encoder.encode(vocabulary).T
            for i, row in zip(unmatched, cosines, strict=True):
                best = int(row.argmax())
                classes[i] = self.class_of_word[vocabulary[best]] if row[best] >= MIN_COSINE else ""
        return classes

    def class_similarities(self, words: Sequence[str]) -> F64:
        """(words, classes) cosines of words with the names of the classes."""
        return np.asarray(self._encoder.encode(words) @ self._encoder.encode(self.names).T, np.float64)


@dataclass(frozen=True)
class GroundTruthFloor:
    """A storey from the surface that people walk on to its ceiling; `seen`: the walk was on it."""

    bottom_m: float
    top_m: float
    seen: bool = True


@dataclass(frozen=True, eq=False)
class GroundTruthPlace:
    """A room or location: the index of its floor, and its outline (N, 2); it counts for recall when `seen`."""

    floor: int
    outline: F64
    seen: bool = True


@dataclass(frozen=True, eq=False)
class GroundTruthObject:
    """An object: the name of its class and its axis-aligned box (2, 3), lowest and highest corner."""

    name: str
    box: F64
    seen: Visibility = "well"


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """All layers. Without floors every place lies on floor 0, and so does everything of the map."""

    floors: tuple[GroundTruthFloor, ...] | None = None
    rooms: tuple[GroundTruthPlace, ...] | None = None
    locations: tuple[GroundTruthPlace, ...] | None = None
    objects: tuple[GroundTruthObject, ...] | None = None
    vocabulary: ClassVocabulary = field(default_factory=lambda: ClassVocabulary({}))  # holds every object's name
    trajectory: Mapping[int, F64] | None = None  # world_from_camera (4, 4) by stamp_ns
