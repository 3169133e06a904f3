"""Node `playback`: a source that replays recorded messages, so that the nodes behind them can be run again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import Keyframe, LastKeyframe, Message, Pose, all_kinds
from placegraph.runtime.node import Context, NodeConfig, Source
from placegraph.runtime.recording import kinds_in, read


class PlaybackConfig(NodeConfig):
    """Settings of `playback`."""

    path: str  # the recording
    kinds: tuple[str, ...] = Field(default=("Pose", "Keyframe", "LastKeyframe"), strict=False)  # TOML has lists only
    incomplete: bool = False  # True: a recording that was cut is played up to its last keyframe


class PlaybackNode(Source):
    """Produces the recorded messages of its kinds, bit for bit and in recorded order."""

    config_type: ClassVar[type[NodeConfig]] = PlaybackConfig
    outputs: tuple[type[Message], ...] = (Pose, Keyframe, LastKeyframe)

    def __init__(self, config: Any, context: Context) -> None:
        super().__init__(config, context)
        known = {kind.__name__: kind for kind in all_kinds()}
        for name in config.kinds:
            if name not in known:
                raise ConfigError(f"[nodes.playback] kinds: no message {name!r}; there are: {', '.join(known)}")
        if len(set(config.kinds)) != len(config.kinds) or not config.kinds:
            raise ConfigError(f"[nodes.playback] kinds: expected each kind once, at least one: {list(config.kinds)}")
        self.outputs = tuple(known[name] for name in config.kinds)

    def is_lossless(self) -> bool:
        """True: a recording can wait for slow nodes."""
        return True

    def messages(self) -> Iterator[Message]:
        """The recorded messages in recorded order.

        Raises SourceError when there is no such file, no Keyframe in it, or it was cut before its end and the setting
        `incomplete` is off; SchemaError when it cannot be read.
        """
        path = Path(self.config.path)
        counts = kinds_in(path)
        if Keyframe in self.outputs:
            _require_keyframes(path, counts)
        end_is_missing = LastKeyframe in self.outputs and not counts.get("LastKeyframe", 0)
        if end_is_missing and not self.config.incomplete:
            raise SourceError(
                f"{path}: has no LastKeyframe: the recording was cut before its end. "
                "Set `incomplete = true` in [nodes.playback] to end after its last keyframe"
            )
        last, keyframes = LastKeyframe(frame_id=-1, stamp_ns=0, keyframes=0), 0
        for message in read(path, self.outputs):
            if isinstance(message, Keyframe):
                keyframes += 1
                last = LastKeyframe(frame_id=message.frame_id, stamp_ns=message.stamp_ns, keyframes=keyframes)
            yield message
            if self.ending:  # stopped early: the nodes behind still need a LastKeyframe
                end_is_missing = LastKeyframe in self.outputs and not isinstance(message, LastKeyframe)
                break
        if end_is_missing:
            yield last


def _require_keyframes(path: Path, counts: dict[str, int]) -> None:
    if counts.get("Keyframe", 0):
        return
    if counts.get("Frame", 0):
        raise SourceError(f"{path}: has no Keyframe but {counts['Frame']} Frame messages: read it as a camera's source")
    raise SourceError(f"{path}: has no Keyframe, only: {', '.join(counts) or 'nothing'}")


NODE = PlaybackNode
