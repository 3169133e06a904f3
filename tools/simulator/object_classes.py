"""Object classes of the simulator and the words for them, from object_classes.toml.

The first of `training_words` is the name of the class. `held_out_words` never occur in training; evaluation uses them
to test whether the detector generalises through the text encoder.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ObjectClass:
    """One class with the words of training and the words kept for evaluation."""

    training_words: tuple[str, ...]
    held_out_words: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The name in the ground truth."""
        return self.training_words[0]


CLASSES: tuple[ObjectClass, ...] = tuple(
    ObjectClass(tuple(words["training"]), tuple(words.get("held_out", ())))
    for words in tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8")).values()
)
NAMES: tuple[str, ...] = tuple(object_class.name for object_class in CLASSES)
