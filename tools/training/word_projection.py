"""Words to where words and pixels meet: as they are trained, and as they are packed."""

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
# how much more a nearer word counts. On houses kept aside AP50 by unsaid synonyms was .36 with Words alone, and .47,
# .51, .51, .51 with a sharpness of 15, 25, 40, 80; by names it rose as well
SHARPNESS = 25.0


class WordProjection(nn.Module):
    """WordLlama vectors to the space where words and pixels meet; starts close to a plain projection."""

    def __init__(self) -> None:
        super().__init__()
        self.linear = nn.Linear(TEXT, EMBEDDING)
        self.hidden = nn.Sequential(nn.Linear(TEXT, 192), nn.ReLU(), nn.Linear(192, EMBEDDING))

    def forward(self, text: Tensor) -> Tensor:
        """(B, N, 256) to (B, N, EMBEDDING), unit rows."""
        return _unit_rows(self.linear(text) + self.hidden(text))


class WordTable(nn.Module):
    """A meaning for each word of the training, begun from a trained `Words`; any other word is a mean of those near it.

    Between the few words that it was trained with, what `Words` learnt means little, while the distances of WordLlama's
    own vectors still tell what a word is like: a kernel regression (Nadaraya 1964, Watson 1964), as attention.
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
