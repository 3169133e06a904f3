"""`placegraph perceive`: a picture of the output of a dataflow's networks on some frames: masks, boxes, tags."""

from __future__ import annotations

import colorsys
import zlib
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer

from placegraph.nodes.camera import detect_source
from placegraph.runtime.arrays import U8, Bool
from placegraph.runtime.config import read
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import Frame, Keyframe, Message, Segments, Tags
from placegraph.runtime.node import Context, Node, build_node

NETWORK_NODES = ("tagger", "detector", "segmenter", "instances")  # in the order of their messages
WIDTH_PX = 640  # of one picture on the sheet
LINE_PX, CAPTION_LINES = 19, 3
CAPTION_COLUMNS = 88  # characters of a line
FONT = cv2.FONT_HERSHEY_SIMPLEX


def perceive(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="A dataflow file; only its networks are run.")],
    source: Annotated[Path, typer.Option(help="Data set folder or recording; its format is recognised.")],
    out: Annotated[Path, typer.Option(help="The picture (PNG) to write.")],
    frames: Annotated[int, typer.Option(min=1, max=24, help="How many frames, evenly spaced.")] = 6,
    of: Annotated[int, typer.Option(min=1, help="Out of so many first frames of the source.")] = 500,
) -> None:
    """Draw what the networks of a dataflow see on some frames, side by side."""
    settings = read(config)
    context = Context(model_dirs=tuple(settings.run.model_dirs), threads=2)
    nodes = [build_node(name, settings.nodes[name], context) for name in NETWORK_NODES if name in settings.nodes]
    if not nodes:
        raise ConfigError(f"{config}: none of the nodes {', '.join(NETWORK_NODES)} is in it")
    chosen = list(islice(detect_source(str(source))(source, {}).frames(), 0, of, max(of // frames, 1)))[:frames]
    if not chosen:
        raise SourceError(f"{source}: the source gave no frame")
    for node in nodes:
        node.start()
    try:
        pictures = [draw(frame, run_networks(frame, nodes)) for frame in chosen]
    finally:
        for node in nodes:
            node.stop()
    if not cv2.imwrite(str(out), sheet(pictures)[..., ::-1]):
        raise SourceError(f"{out}: cannot be written")
    print(f"{out}: frames {', '.join(str(frame.frame_id) for frame in chosen)} of {source}")


def run_networks(frame: Frame, nodes: Sequence[Node]) -> list[Message]:
    """All messages that the networks give about one frame."""
    messages: list[Message] = [Keyframe.of(frame, np.eye(4))]
    for node in nodes:
        for message in list(messages):
            if type(message) in node.inputs:
                messages += node.step(message)
    return messages[1:]


def draw(frame: Frame, messages: Sequence[Message]) -> U8:
    """One picture (H, W, 3) sRGB: masks with names and scores, and below it the tags."""
    height = round(frame.color.shape[0] * WIDTH_PX / frame.color.shape[1])
    scale = WIDTH_PX / frame.color.shape[1]
    picture = np.asarray(cv2.resize(frame.color, (WIDTH_PX, height)), np.uint8)
    for segments in (message for message in messages if isinstance(message, Segments)):
        masks = list(segments.masks())
        for k, box in enumerate(segments.boxes_px):
            corners = (box * scale).round().astype(int).tolist()
            _draw_mask(picture, masks[k], corners, f"{segments.names[k]} {segments.scores[k]:.2f}", segments.names[k])
    caption = np.full((CAPTION_LINES * LINE_PX + 6, WIDTH_PX, 3), 255, np.uint8)
    words = ", ".join(
        f"{name} {score:.2f}"
        for tags in messages
        if isinstance(tags, Tags)
        for name, score in zip(tags.names, tags.scores, strict=True)
    )
    lines = [f"frame {frame.frame_id}; tags: {words or 'none'}"[i * CAPTION_COLUMNS :] for i in range(CAPTION_LINES)]
    for i, line in enumerate(lines):
        cv2.putText(
            caption, line[:CAPTION_COLUMNS], (5, LINE_PX * (i + 1) - 4), FONT, 0.42, (20, 20, 20), 1, cv2.LINE_AA
        )
    return np.concatenate((picture, caption))


def sheet(pictures: Sequence[U8]) -> U8:
    """Pictures in rows of three, padded with white."""
    columns = min(len(pictures), 3)
    tallest = max(len(picture) for picture in pictures)
    blank = np.full((tallest, WIDTH_PX, 3), 255, np.uint8)
    padded: list[U8] = [np.concatenate((picture, blank[len(picture) :])) for picture in pictures]
    padded += [blank] * (-len(padded) % columns)
    return np.concatenate([np.concatenate(padded[i : i + columns], axis=1) for i in range(0, len(padded), columns)])


def _draw_mask(picture: U8, mask: Bool, box: list[int], text: str, name: str) -> None:
    x0, y0, x1, y1 = box
    hue = (zlib.crc32(name.encode()) & 0xFFFF) / 0x10000
    color = tuple(round(255 * part) for part in colorsys.hsv_to_rgb(hue, 0.8, 1.0))
    crop = picture[y0:y1, x0:x1]
    if crop.size:
        shape = cv2.resize(mask.astype(np.uint8), crop.shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0
        crop[shape] = (0.55 * crop[shape] + 0.45 * np.array(color)).astype(np.uint8)
    cv2.rectangle(picture, (x0, y0), (x1, y1), color, 1, cv2.LINE_AA)
    at = (x0 + 2, max(y0 - 3, 11))
    cv2.putText(picture, text, at, FONT, 0.42, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(picture, text, at, FONT, 0.42, color, 1, cv2.LINE_AA)
