"""Designs of every class: `design(name, random)` assembles one item, never twice the same."""

from __future__ import annotations

from functools import cache
from typing import Protocol

import numpy as np

from placegraph.runtime.errors import ConfigError
from placegraph.runtime.node import available, plugin
from placegraph.tools.simulator.house_model import Item


class Design(Protocol):
    """Assembles one item of a class; sizes that are given in metres are honoured, the others drawn."""

    def __call__(
        self,
        random: np.random.Generator,
        *,
        width_m: float | None = None,
        depth_m: float | None = None,
        height_m: float | None = None,
    ) -> Item:
        """The item, in its own frame."""
        ...


@cache
def designs() -> dict[str, Design]:
    """Every design by class name, from the modules of this folder (each exports DESIGNS)."""
    designs_by_name: dict[str, Design] = {}
    for module in available(__name__):
        designs_by_name |= plugin(__name__, module, "DESIGNS", "catalogue module")
    return designs_by_name


def design(
    name: str,
    random: np.random.Generator,
    *,
    width_m: float | None = None,
    depth_m: float | None = None,
    height_m: float | None = None,
) -> Item:
    """One new item of a class; raises ConfigError for a class that has no design."""
    known = designs()
    if name not in known:
        raise ConfigError(f"no design for {name!r}; there are: {', '.join(sorted(known))}")
    return known[name](random, width_m=width_m, depth_m=depth_m, height_m=height_m)
