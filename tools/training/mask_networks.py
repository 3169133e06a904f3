"""The segmenter's encoder and decoder in PyTorch."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from placegraph.tools.training.networks import Conv, Csp, PooledPyramid, upsample


class MaskEncoder(nn.Module):
    """Image and depth to an embedding that is shared by all boxes of a frame."""

    CHANNELS = 40

    def __init__(self) -> None:
        super().__init__()
        self.to2 = nn.Sequential(Conv(5, 16, 3, 2), Conv(16, 16))
        self.to4 = nn.Sequential(Conv(16, 32, 3, 2), Csp(32, 32, 1))
        self.to8 = nn.Sequential(Conv(32, 64, 3, 2), Csp(64, 64, 1))
        self.to16 = nn.Sequential(Conv(64, 96, 3, 2), Csp(96, 96, 1), PooledPyramid(96))
        self.down8 = Csp(96 + 64, 48, 1)
        self.down4 = Csp(48 + 32, 32, 1)
        self.down2 = Conv(32 + 16, self.CHANNELS - 1, 1)

    def forward(self, image: Tensor, depth: Tensor) -> Tensor:
        """(B, 3, H, W) 0..1 and (B, 1, H, W) metres, 0 = none: (B, CHANNELS, H/2, W/2); the last channel is depth."""
        known = (depth > 0).to(depth.dtype)
        c2 = self.to2(torch.cat((image, depth * 0.2, known), 1))
        c4 = self.to4(c2)
        c8 = self.to8(c4)
        p8 = self.down8(torch.cat((upsample(self.to16(c8)), c8), 1))
        p4 = self.down4(torch.cat((upsample(p8), c4), 1))
        p2 = self.down2(torch.cat((upsample(p4), c2), 1))
        return torch.cat((p2, functional.max_pool2d(depth, 2)), 1)


class MaskDecoder(nn.Module):
    """Embedding and boxes to one mask per box, on a grid that covers the box with a margin, and its predicted IoU."""

    GRID = 48
    MARGIN = 0.08  # share of the box's size added on each side as context

    def __init__(self) -> None:
        super().__init__()
        c = MaskEncoder.CHANNELS + 4
        self.enter = Conv(c, 32)
        self.down = nn.Sequential(Conv(32, 48, 3, 2), Csp(48, 48, 1))
        self.deep = nn.Sequential(Conv(48, 64, 3, 2), Csp(64, 64, 2))
        self.up1 = Csp(64 + 48, 48, 1)
        self.up2 = Conv(48 + 32, 24)
        self.mask = nn.Conv2d(24, 1, 1)
        self.quality = nn.Linear(64, 1)
        line = (torch.arange(self.GRID) + 0.5) / self.GRID * (1 + 2 * self.MARGIN) - self.MARGIN
        self.register_buffer("line", line)

    def forward(self, embedding: Tensor, boxes: Tensor) -> tuple[Tensor, Tensor]:
        """Embedding (1, C, h, w) and boxes (N, 4) x0 y0 x1 y1 as shares 0..1 of the image to masks and their IoU."""
        return self.decode(self.sample(embedding, boxes))

    def decode(self, cells: Tensor) -> tuple[Tensor, Tensor]:
        """Sampled grids (N, C + 4, G, G) of any images to logits (N, 1, G, G) and predicted IoU (N, 1)."""
        e0 = self.enter(cells)
        e1 = self.down(e0)
        e2 = self.deep(e1)
        d1 = self.up1(torch.cat((upsample(e2), e1), 1))
        d0 = self.up2(torch.cat((upsample(d1), e0), 1))
        return self.mask(d0), torch.sigmoid(self.quality(e2.mean(dim=(2, 3))))

    def sample(self, embedding: Tensor, boxes: Tensor) -> Tensor:
        """The embedding at each box's grid, with depth made relative and the box drawn in."""
        x = boxes[:, 0:1] + (boxes[:, 2:3] - boxes[:, 0:1]) * self.line  # (N, G)
        y = boxes[:, 1:2] + (boxes[:, 3:4] - boxes[:, 1:2]) * self.line
        g = self.GRID
        grid = torch.stack((x[:, None, :].expand(-1, g, g), y[:, :, None].expand(-1, g, g)), -1) * 2 - 1
        sampled = functional.grid_sample(
            embedding, grid.reshape(1, -1, g, 2), mode="bilinear", padding_mode="zeros", align_corners=False
        )
        sampled = sampled[0].reshape(embedding.shape[1], -1, g, g).transpose(0, 1)  # (N, C, G, G)
        depth = sampled[:, -1:]
        q = g // 4
        middle = depth[:, :, q : g - q, q : g - q]
        seen = (middle > 0).to(depth.dtype)
        center = (middle * seen).sum(dim=(2, 3), keepdim=True) / (seen.sum(dim=(2, 3), keepdim=True) + 1e-3)
        relative = torch.clamp(depth - center, -2.0, 2.0)
        inside = ((self.line >= 0) & (self.line <= 1)).to(depth.dtype)
        coarse_mask = (inside[None, :] * inside[:, None]).expand(boxes.shape[0], 1, g, g)
        # the size of the box gives the resolution of the grid
        size = (boxes[:, 2:] - boxes[:, :2])[:, :, None, None].expand(-1, 2, g, g)
        return torch.cat((sampled[:, :-1], relative, relative * 4.0, coarse_mask, size), 1)
