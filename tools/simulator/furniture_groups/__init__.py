"""Groups of furniture that are used together, each laid out in its own frame before it is placed in a room."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

CONTENTS: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("room_contents.toml").read_text("utf-8"))
