"""What all drawing functions share: the Rerun stream, what is shown now, and colours by name."""

from __future__ import annotations

import colorsys
import zlib
from collections.abc import Mapping
from typing import Any

import rerun as rr

Color = tuple[int, int, int]


class Canvas:
    """Draws into a Rerun stream and knows what it shows. `frames`: every camera frame is drawn, not keyframes alone."""

    def __init__(self, stream: rr.RecordingStream, frames: bool) -> None:
        self.frames = frames
        self.image_size = (0, 0)  # height, width of the newest colour image
        self.last_position: tuple[float, float, float] | None = None
        self.class_ids: dict[str, int] = {}
        self.questions: dict[str, str] = {}
        self._stream = stream
        self._shown: dict[str, set[str]] = {}

    def log(self, path: str | list[object], *entities: Any, static: bool = False) -> None:
        """Log entities at the time of the current message; bad input raises instead of warning."""
        self._stream.log(path, *entities, static=static, strict=True)

    def replace(self, group: str, entities: Mapping[str, Any]) -> None:
        """Show exactly these entities of a group (path to archetype) from now on; the group's others are cleared."""
        for path in sorted(self._shown.get(group, set()) - set(entities)):
            self.log(path, rr.Clear(recursive=False))
        for path, entity in entities.items():
            self.log(path, entity)
        self._shown[group] = set(entities)

    def classes(self, names: tuple[str, ...]) -> list[int]:
        """A number from 1 for each name, the same throughout the recording; new ones are announced to the viewer."""
        new = [name for name in dict.fromkeys(names) if name not in self.class_ids]
        for name in new:
            self.class_ids[name] = len(self.class_ids) + 1
        if new:
            classes = [rr.AnnotationInfo(id=0, label="", color=(0, 0, 0, 0))]  # no mask: transparent
            classes += [rr.AnnotationInfo(id=i, label=name, color=color_of(name)) for name, i in self.class_ids.items()]
            self.log("world/camera/image", rr.AnnotationContext(classes), static=True)
        return [self.class_ids[name] for name in names]


def color_of(name: str) -> Color:
    """A bright sRGB colour for a name, the same in every run."""
    code = zlib.crc32(name.encode())
    red, green, blue = colorsys.hsv_to_rgb((code & 0xFFFF) / 0x10000, 0.55 + 0.35 * ((code >> 16) & 0xFF) / 255, 1.0)
    return round(red * 255), round(green * 255), round(blue * 255)


def markdown(text: str) -> str:
    """Markdown that shows a text literally: nothing in it becomes a link, an image or a heading."""
    return "".join(f"\\{char}" if char in r"\`*_{}[]<>()#+-.!|~" else char for char in " ".join(text.split()))
