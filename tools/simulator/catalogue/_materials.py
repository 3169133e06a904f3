"""Materials that designs share."""

from __future__ import annotations

from placegraph.tools.simulator.house_model import Material

STEEL = Material((178, 180, 184), gloss=0.7)
DARK = Material((32, 32, 35), gloss=0.3)
GLASS = Material((22, 26, 32), gloss=0.9)
