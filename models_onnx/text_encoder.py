"""Words to vectors, so that "couch" is near "sofa" (the only wordllama import)."""

from __future__ import annotations

import logging
from collections import OrderedDict
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F32
from placegraph.runtime.errors import ModelError

DIMENSIONS = 256  # of the embedding that travels in wordllama's wheel
MAX_TEXTS = 8192  # vectors kept, 1 kB each; RAM++ knows 4585 tags, and questions bring new words


class TextEncoder:
    """Text to unit vectors, offline; each text is encoded alone, so its vector never depends on others.

    The vectors of the texts used last are kept.
    """

    def __init__(self, max_texts: int = MAX_TEXTS) -> None:
        """max_texts: how many vectors are kept, at least 1."""
        self._max_texts = max_texts
        self._rows: OrderedDict[str, F32] = OrderedDict()

    def encode(self, texts: Sequence[str]) -> F32:
        """Encode texts to (N, 256) unit rows; a zero row where a text has no letter or digit.

        Raises:
            ModelError: the embedding file that belongs to the wordllama package is missing.
        """
        rows = np.zeros((len(texts), DIMENSIONS), np.float32)
        for i, text in enumerate(texts):
            rows[i] = self._row(text)
        return rows

    def _row(self, text: str) -> F32:
        if text in self._rows:
            self._rows.move_to_end(text)
            return self._rows[text]
        row = self._rows[text] = _encode_text(text)
        if len(self._rows) > self._max_texts:
            self._rows.popitem(last=False)
        return row


def _encode_text(text: str) -> F32:
    words = " ".join(text.split()).lower()  # the tokenizer gives "Couch" and "couch" unrelated tokens
    if not any(character.isalnum() for character in words):
        return np.zeros(DIMENSIONS, np.float32)
    row = np.asarray(_embedding().embed([words])[0], np.float32)
    length = float(np.linalg.norm(row))
    return row / np.float32(length) if length > 0 else row


@cache
def _embedding() -> Any:
    """The table of word vectors, 16 MB, read at first use and shared by all encoders of the process."""
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    import wordllama  # at first use: nodes that compare no words need not load it

    # Importing it calls logging.basicConfig, which would decide the whole process's logging.
    root.handlers[:] = handlers
    root.setLevel(level)
    try:
        return wordllama.WordLlama.load(cache_dir=Path(wordllama.__file__).parent, disable_download=True)
    except FileNotFoundError as error:
        raise ModelError(f"wordllama's word vectors are missing, reinstall the package: {error}") from error
