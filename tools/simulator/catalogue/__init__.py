"""Designs of every class: `design(name, random)` assembles one item, never the same twice."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from placegraph.runtime.errors import ConfigError
from placegraph.runtime.node import available, plugin
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize
from placegraph.tools.simulator.house_model import Item

Design = Callable[[Random, WantedSize], Item]


@cache
def designs() -> dict[str, Design]:
    """Every design by class name, from the modules of this folder (each exports DESIGNS)."""
    designs_by_name: dict[str, Design] = {}
    for module in available(__name__):
        designs_by_name |= plugin(__name__, module, "DESIGNS", "catalogue module")
    return designs_by_name


def design(name: str, random: Random, **sizes_m: float | None) -> Item:
    """One new item of a class in the wanted sizes width_m, depth_m, height_m; raises ConfigError without a design."""
    known = designs()
    if name not in known:
        raise ConfigError(f"no design for {name!r}; there are: {', '.join(sorted(known))}")
    return known[name](random, WantedSize(**sizes_m))
