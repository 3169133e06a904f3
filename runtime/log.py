"""The one place logging is configured."""

from __future__ import annotations

import logging
import sys
import time
from typing import TextIO


class _Format(logging.Formatter):
    """`time level node text`, time in UTC."""

    def __init__(self, node: str) -> None:
        super().__init__(f"%(asctime)s.%(msecs)03d %(levelname)s {node} %(message)s", datefmt="%H:%M:%S")
        self.converter = time.gmtime


class _Stderr(logging.StreamHandler[TextIO]):
    """Writes to the current `sys.stderr`, which may have been replaced since the handler was made."""

    @property
    def stream(self) -> TextIO:  # type: ignore[override]
        return sys.stderr

    @stream.setter
    def stream(self, value: TextIO) -> None:
        pass


def configure(node: str, level: str = "INFO") -> None:
    """Log to stderr with the node's name; a second call replaces the first."""
    handler = _Stderr()
    handler.setFormatter(_Format(node))
    logging.basicConfig(level=level, handlers=[handler], force=True)
