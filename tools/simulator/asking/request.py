"""A request before it is put into words: what is asked for, where, and by which things it is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.asking.names import Mention
from placegraph.tools.simulator.asking.scene import Scene
from placegraph.tools.simulator.asking.scopes import Scope


@dataclass(frozen=True, eq=False)
class Request:
    """One request with one right answer; every `{}` of the tails is a word for the next anchor."""

    form: str
    target: Mention
    scope: Scope
    adjective: str = ""  # stands before the word: red, largest, second
    tails: tuple[str, ...] = ()  # stand behind it: "next to the {}"
    means: tuple[str, ...] = ()  # the same as conditions of a program, `{}` for the anchors in the same order
    anchors: tuple[Mention, ...] = ()
    eye: F64 | None = None  # (3,) where the asker stands
    needed: bool = True  # whether the word and the scope alone would leave a doubt


def unique_mentions(scene: Scene, scope: Scope) -> list[Mention]:
    """All ways to tell an anchor of a scope by a word that means nothing else there."""
    found = []
    for one in np.flatnonzero(scene.anchors & scope.mask).tolist():
        found += [
            Mention(one, naming)
            for naming in scene.namings[one]
            if np.count_nonzero(scene.of(naming.kin) & scope.mask) == 1
        ]
    return found
