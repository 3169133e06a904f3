"""The embedded networks in PyTorch: a small backbone with a feature pyramid, and a head for each task.

Blocks follow YOLOv8 (C2f, SPPF, PAN) with ReLU in place of SiLU, which costs nothing in INT8. Text is compared with
pixels as in YOLO-World's contrastive head: a projected word vector times the embedding of each cell.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from placegraph.tools.training.word_projection import EMBEDDING, WordProjection, WordTable

STRIDES = (8, 16, 32)


class Conv(nn.Sequential):
    """Convolution, batch norm, ReLU."""

    def __init__(self, c_in: int, c_out: int, size: int = 3, stride: int = 1) -> None:
        super().__init__(
            nn.Conv2d(c_in, c_out, size, stride, size // 2, bias=False),
            nn.BatchNorm2d(c_out, eps=1e-3, momentum=0.03),
            nn.ReLU(inplace=True),
        )


class Residual(nn.Module):
    """Two 3x3 convolutions beside a shortcut."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.body = nn.Sequential(Conv(channels, channels), Conv(channels, channels))

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, H, W) to the same."""
        return x + self.body(x)


class Csp(nn.Module):
    """Cross-stage block: half of the channels go through `depth` residual steps, all are merged."""

    def __init__(self, c_in: int, c_out: int, depth: int) -> None:
        super().__init__()
        self.half = c_out // 2
        self.enter = Conv(c_in, 2 * self.half, 1)
        self.steps = nn.ModuleList(Residual(self.half) for _ in range(depth))
        self.leave = Conv((2 + depth) * self.half, c_out, 1)

    def forward(self, x: Tensor) -> Tensor:
        """(B, c_in, H, W) to (B, c_out, H, W)."""
        parts = list(self.enter(x).split(self.half, dim=1))
        for step in self.steps:
            parts.append(step(parts[-1]))
        return self.leave(torch.cat(parts, dim=1))


class PooledPyramid(nn.Module):
    """Three chained max pools: a wide view at the coarsest scale (YOLOv8's SPPF)."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.enter = Conv(channels, channels // 2, 1)
        self.pool = nn.MaxPool2d(5, 1, 2)
        self.leave = Conv(channels * 2, channels, 1)

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, H, W) to the same."""
        parts = [self.enter(x)]
        for _ in range(3):
            parts.append(self.pool(parts[-1]))
        return self.leave(torch.cat(parts, dim=1))


class Backbone(nn.Module):
    """Image (B, 3, H, W), 0..1, to features at strides 8, 16, 32 after a top-down and a bottom-up path."""

    WIDTHS = (64, 80, 112)

    def __init__(self, c16: int = 112, c32: int = 176, depths: tuple[int, int, int] = (4, 3, 2)) -> None:
        """c16, c32: channels at strides 16 and 32; depths: of the blocks there, and of the two paths."""
        super().__init__()
        depth16, depth32, depth = depths
        self.stem = nn.Sequential(Conv(3, 16, 3, 2), Conv(16, 32, 3, 2), Csp(32, 32, 1))
        self.to8 = nn.Sequential(Conv(32, 64, 3, 2), Csp(64, 64, 2))
        self.to16 = nn.Sequential(Conv(64, c16, 3, 2), Csp(c16, c16, depth16))
        self.to32 = nn.Sequential(Conv(c16, c32, 3, 2), Csp(c32, c32, depth32), PooledPyramid(c32))
        self.down16 = Csp(c32 + c16, 80, depth)
        self.down8 = Csp(80 + 64, 64, depth)
        self.up16 = Conv(64, 64, 3, 2)
        self.join16 = Csp(64 + 80, 80, depth)
        self.up32 = Conv(80, 80, 3, 2)
        self.join32 = Csp(80 + c32, self.WIDTHS[2], depth)

    def forward(self, image: Tensor) -> Any:
        """Features at each of STRIDES."""
        return self.features(image)[1]

    def features(self, image: Tensor) -> tuple[Tensor, list[Tensor]]:
        """Features of the stem at stride 4, and those at each of STRIDES."""
        c4 = self.stem(image)
        c8 = self.to8(c4)
        c16 = self.to16(c8)
        c32 = self.to32(c16)
        p16 = self.down16(torch.cat((upsample(c32), c16), 1))
        p8 = self.down8(torch.cat((upsample(p16), c8), 1))
        n16 = self.join16(torch.cat((self.up16(p8), p16), 1))
        n32 = self.join32(torch.cat((self.up32(n16), c32), 1))
        return c4, [p8, n16, n32]


class TextHead(nn.Module):
    """Scores of cells for words: embedding times projected word vector, scaled."""

    def __init__(self, c_in: int) -> None:
        super().__init__()
        self.embed = nn.Sequential(Conv(c_in, c_in), nn.Conv2d(c_in, EMBEDDING, 1))
        self.norm = nn.BatchNorm2d(EMBEDDING, momentum=0.03)
        self.scale = nn.Parameter(torch.tensor(1.0))
        self.bias = nn.Parameter(torch.tensor(-4.6))  # probability .01 at the start: most cells show nothing

    def forward(self, features: Tensor, words: Tensor) -> Tensor:
        """Features (B, C, h, w) and words (B, N, EMBEDDING), unit rows: logits (B, N, h * w)."""
        cells = self.norm(self.embed(features)).flatten(2)
        return self.scale * torch.matmul(words, cells) + self.bias


class ObjectNetwork(nn.Module):
    """Detector with a dense head, from which the tagger is made.

    The dense head names the object at each stride-8 cell, so that the backbone learns from every pixel.
    """

    def __init__(self) -> None:
        super().__init__()
        self.backbone = Backbone()
        self.words: WordProjection | WordTable = WordProjection()
        self.boxes = nn.ModuleList(nn.Sequential(Conv(c, 64), nn.Conv2d(64, 4, 1)) for c in Backbone.WIDTHS)
        self.texts = nn.ModuleList(TextHead(c) for c in Backbone.WIDTHS)
        self.dense = TextHead(Backbone.WIDTHS[0])

    def forward(self, image: Tensor, text: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Image (B, 3, H, W) and text (B, N, 256).

        Gives raw distances (B, 4, A) of left, top, right, bottom in strides before softplus, logits (B, N, A), and
        dense logits (B, N, A8) of the stride-8 cells.
        """
        features = self.backbone(image)
        words = self.words(text)
        distances = torch.cat([head(f).flatten(2) for head, f in zip(self.boxes, features, strict=True)], 2)
        logits = torch.cat([head(f, words) for head, f in zip(self.texts, features, strict=True)], 2)
        return distances, logits, self.dense(features[0], words)


class BoxExport(nn.Module):
    """A network with its boxes decoded to px, for one input size."""

    def __init__(self, network: nn.Module, height: int, width: int) -> None:
        super().__init__()
        self.network = network
        centers, strides = anchors(height, width)
        self.register_buffer("centres", centers.T.contiguous()[None])  # spelled as in the packaged ONNX files
        self.register_buffer("strides", strides[None, None])

    def decode(self, distances: Tensor) -> Tensor:
        """Raw distances (1, 4, A) to boxes (1, 4, A): cx cy w h in px."""
        reach = functional.softplus(distances) * self.strides
        low, high = self.centres - reach[:, :2], self.centres + reach[:, 2:]
        return torch.cat(((low + high) / 2, high - low), dim=1)


class DetectorExport(BoxExport):
    """ObjectNetwork in the YOLO-World export layout, for one input size."""

    def forward(self, image: Tensor, text: Tensor) -> Tensor:
        """(1, 3, H, W) and (1, N, 256) to (1, 4 + N, A): cx cy w h in px, and probabilities."""
        distances, logits, _ = self.network(image, text)
        return torch.cat((self.decode(distances), torch.sigmoid(logits)), dim=1)


class TaggerNetwork(nn.Module):
    """An ObjectNetwork without boxes, with fixed words: logits of the whole image, RAM++ layout.

    The logit of a tag combines a smooth maximum over the cells of the dense head with one over the anchors of the
    detector. Input is ImageNet-normalised.
    """

    def __init__(self, network: ObjectNetwork, text: Tensor) -> None:
        super().__init__()
        self.backbone, self.words = network.backbone, network.words
        self.dense, self.texts = network.dense, network.texts
        self.register_buffer("text", text[None])  # (1, T, 256)
        self.register_buffer("mean", torch.tensor([0.485, 0.456, 0.406]).view(1, 3, 1, 1))
        self.register_buffer("std", torch.tensor([0.229, 0.224, 0.225]).view(1, 3, 1, 1))
        self.gains = nn.Parameter(torch.full((2, text.shape[0]), 0.5))
        self.shift = nn.Parameter(torch.zeros(text.shape[0]))

    def forward(self, image: Tensor) -> Tensor:
        """(B, 3, S, S) normalised to (B, T) logits."""
        features = self.backbone(image * self.std + self.mean)
        words = self.words(self.text).expand(image.shape[0], -1, -1)
        cells = self.dense(features[0], words)
        anchors = torch.cat([head(f, words) for head, f in zip(self.texts, features, strict=True)], 2)
        return self.gains[0] * torch.logsumexp(cells, 2) + self.gains[1] * torch.logsumexp(anchors, 2) + self.shift


def anchors(height: int, width: int) -> tuple[Tensor, Tensor]:
    """Cell centres (A, 2) x y in px and strides (A,) of an input size, by stride, row, column."""
    centers, strides = [], []
    for stride in STRIDES:
        ys, xs = torch.meshgrid(torch.arange(height // stride), torch.arange(width // stride), indexing="ij")
        centers.append((torch.stack((xs.flatten(), ys.flatten()), 1).float() + 0.5) * stride)
        strides.append(torch.full((xs.numel(),), float(stride)))
    return torch.cat(centers), torch.cat(strides)


def upsample(x: Tensor) -> Tensor:
    """(B, C, H, W) to (B, C, 2 H, 2 W) by repetition."""
    return functional.interpolate(x, scale_factor=2.0, mode="nearest")
