"""Projection of word vectors into the embedding that words share with pixels: as trained, and as packaged."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from placegraph.tools.simulator.object_classes import CLASSES

TEXT = 256  # numbers of a WordLlama vector
EMBEDDING = 96  # numbers in which pixels and words meet
OTHER_WORDS = (
    "car", "dog", "tree", "person", "cat", "horse", "airplane", "boat", "traffic light", "bird", "cow", "pizza",
    "banana", "umbrella", "tie", "skateboard", "kite", "knife", "fork", "truck", "bus", "train", "mountain", "river",
    "fence", "phone", "hair dryer", "toothbrush", "scissors", "surfboard", "carrot", "cake", "elephant", "bridge",
    "flag", "hat",
)  # fmt: skip  # never shown: the network must also say no
KNOWN_WORDS = (*(word for object_class in CLASSES for word in object_class.training_words), *OTHER_WORDS)
# Weight of similarity. On held-out houses AP50 by held-out synonyms was .36 with WordProjection alone, and .47,
# .51, .51, .51 with a sharpness of 15, 25, 40, 80; by names it rose as well
SHARPNESS = 25.0


class WordProjection(nn.Module):
    """WordLlama vectors to the shared embedding; starts close to a linear projection."""

    def __init__(self) -> None:
        super().__init__()
        self.linear = nn.Linear(TEXT, EMBEDDING)
        self.hidden = nn.Sequential(nn.Linear(TEXT, 192), nn.ReLU(), nn.Linear(192, EMBEDDING))

    def forward(self, text: Tensor) -> Tensor:
        """(B, N, 256) to (B, N, EMBEDDING), unit rows."""
        return _unit_rows(self.linear(text) + self.hidden(text))


class WordTable(nn.Module):
    """One embedding per training word, initialised from a trained WordProjection; other words are interpolated.

    Between the few training words the projection is unreliable, while distances between WordLlama vectors still measure
    similarity: a kernel regression (Nadaraya 1964, Watson 1964), written as attention.
    """

    def __init__(self, words: WordProjection, known: Tensor) -> None:
        """known: (K, 256) unit rows."""
        super().__init__()
        self.register_buffer("known", known.T.contiguous())
        with torch.no_grad():
            self.meaning = nn.Parameter(words(known[None])[0])

    def forward(self, text: Tensor) -> Tensor:
        """(B, N, 256) unit rows to (B, N, EMBEDDING), unit rows."""
        near = torch.softmax(SHARPNESS * torch.matmul(text, self.known), dim=-1)
        return _unit_rows(torch.matmul(near, self.meaning))


def _unit_rows(rows: Tensor) -> Tensor:
    return rows / torch.sqrt((rows * rows).sum(dim=-1, keepdim=True) + 1e-6)
