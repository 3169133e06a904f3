"""Materials and types that designs share."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.house_model import Material

Size = tuple[float, float, float]
Length = float | None
Random = np.random.Generator

STEEL = Material((178, 180, 184), gloss=0.7)
DARK = Material((32, 32, 35), gloss=0.3)
GLASS = Material((22, 26, 32), gloss=0.9)
