"""Writes a house as a TUM RGB-D folder with its ground truth; the bytes do not depend on the number of processes.

Source: the folder format that nodes/camera/tum.py reads.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from placegraph.runtime.arrays import I64
from placegraph.runtime.errors import SourceError
from placegraph.runtime.vision.geometry import quaternion_xyzw
from placegraph.tools.simulator.floor_plan_drawing import draw_floor_plan
from placegraph.tools.simulator.furniture_rearrangement import moved_item_ids
from placegraph.tools.simulator.ground_truth import (
    CLEAR_SHARE,
    QUESTIONS,
    TRUTH,
    FrameCounts,
    HouseRun,
    truth_of,
    write_before,
    write_truth,
)
from placegraph.tools.simulator.house_frames import HouseFrame, HouseFrames, generator_version
from placegraph.tools.simulator.house_model import House
from placegraph.tools.simulator.questions import generate_questions, to_json

JPEG_QUALITY = 95
QUESTION_COUNT = 60
MIN_CLEAR_FRAMES = 5  # of what is asked about


@dataclass(frozen=True)
class HouseOrder:
    """Which house to film and how: seed, floors (None: the seed chooses), frames at most (0: all), image size.

    moved: pieces of furniture that are moved before the house is filmed a second time; 0: it is filmed once.
    """

    seed: int
    floors: int | None = None
    limit: int = 0
    width: int = 640
    height: int = 480
    moved: int = 0

    def frames(self) -> HouseFrames:
        """The house and its frames."""
        return HouseFrames(self.seed, self.floors, self.width, self.height, self.moved)

    def run(self, frames: int, frames_before: int) -> HouseRun:
        """The run record of a folder made to this order by this generator."""
        size = self.width, self.height
        version = generator_version()
        return HouseRun(self.seed, self.floors, self.limit, *size, version, frames, self.moved, frames_before)

    def is_made_by(self, run: HouseRun) -> bool:
        """Whether a run record matches this order and this generator."""
        return run == self.run(run.frames, run.frames_before)


def export(order: HouseOrder, out: Path, workers: int | None = None, quiet: bool = True) -> HouseRun:
    """Writes a house folder with `workers` processes (None: one per core); `out` must be absent or empty.

    Raises SourceError when the folder cannot be written.
    """
    source = order.frames()
    count = source.count(order.limit)
    run = order.run(count, min(source.frames_before, count))
    changed = moved_item_ids(source.before, source.house)
    with _atomic_folder(out) as folder:
        for name in ("rgb", "depth", f"{TRUTH}/instances"):
            (folder / name).mkdir(parents=True)
        views = np.zeros((len(source.house.items), 2), np.int64)  # frames, clear frames
        for index, pixels in enumerate(
            track(
                _frames(order, source, folder, workers or os.cpu_count() or 1),
                total=count,
                description=f"house {order.seed}",
                console=Console(stderr=True),
                disable=quiet,
            )
        ):
            if index == source.frames_before:
                views[list(changed)] = 0  # frames before the move do not count
            views[:, 0] += pixels > 0
            views[:, 1] += pixels >= CLEAR_SHARE * order.width * order.height
        _write_lists(source, count, folder)
        seen = tuple(FrameCounts(id, frames, clear) for id, (frames, clear) in enumerate(views.tolist()))
        write_truth(truth_of(source.house, run, seen), folder)
        if order.moved:
            write_before(source.before, changed, folder)
        _write_questions(source.house, seen, folder)
        _write_image(
            folder / "plan.png", draw_floor_plan(source.house, source.world_from_camera[:count, :3, 3])[..., ::-1]
        )
    return run


def _write_questions(house: House, seen: tuple[FrameCounts, ...], folder: Path) -> None:
    """Questions whose target and anchors were clearly visible."""
    shown = {counts.id for counts in seen if counts.clear_frames >= MIN_CLEAR_FRAMES}
    asked = [
        question
        for question in generate_questions(house, house.seed, 2 * QUESTION_COUNT)
        if {question.target, *question.anchors} <= shown
    ]
    text = json.dumps(to_json(asked[:QUESTION_COUNT]), sort_keys=True, ensure_ascii=False, indent=1)
    (folder / TRUTH / QUESTIONS).write_text(text + "\n", encoding="utf-8")


@contextmanager
def _atomic_folder(out: Path) -> Iterator[Path]:
    """A temporary folder beside `out` that replaces it at the end; an interrupted run leaves nothing."""
    part = out.with_name(f".{out.name}.{os.getpid()}.part")
    try:
        part.mkdir(parents=True)
        yield part
        part.rename(out)
    except OSError as error:
        raise SourceError(f"{error.filename or out}: cannot be written: {error.strerror}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _frames(order: HouseOrder, source: HouseFrames, folder: Path, workers: int) -> Iterator[I64]:
    """Writes the images of every frame; yields the pixels of each object (items,) frame by frame."""
    count = source.count(order.limit)
    if min(workers, count) <= 1:
        yield from (_write_frame(source.frame(index), folder, len(source.house.items)) for index in range(count))
        return
    # spawn: a forked copy of a process that has threads (OpenCV's, BLAS's) may hang
    pool = ProcessPoolExecutor(min(workers, count), get_context("spawn"), _start_worker, (order, folder))
    try:
        yield from pool.map(_write_in_worker, range(count), chunksize=4)
    finally:
        pool.shutdown(cancel_futures=True)


_worker: dict[str, Any] = {}  # per worker process: its copy of the house, and the output folder


def _start_worker(order: HouseOrder, folder: Path) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the parent process, which stops the workers
    cv2.setNumThreads(1)  # there is a process for each core
    _worker["source"] = order.frames()
    _worker["folder"] = folder


def _write_in_worker(index: int) -> I64:
    source: HouseFrames = _worker["source"]
    return _write_frame(source.frame(index), _worker["folder"], len(source.house.items))


def _write_frame(frame: HouseFrame, folder: Path, items: int) -> I64:
    name = f"{frame.frame_id:06d}"
    _write_image(folder / "rgb" / f"{name}.jpg", frame.color[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    _write_image(folder / "depth" / f"{name}.png", frame.depth_steps)
    _write_image(folder / TRUTH / "instances" / f"{name}.png", frame.instance)
    return np.bincount(frame.instance.ravel(), minlength=items + 1)[1:]


def _write_image(file: Path, image: NDArray[Any], settings: list[int] | None = None) -> None:
    done, data = cv2.imencode(file.suffix, np.ascontiguousarray(image), settings or [])
    assert done
    file.write_bytes(data.tobytes())


def _write_lists(source: HouseFrames, count: int, folder: Path) -> None:
    times = [f"{stamp // 10**9}.{stamp % 10**9:09d}" for stamp in np.asarray(source.stamps_ns)[:count].tolist()]
    for name, suffix in (("rgb", "jpg"), ("depth", "png")):
        lines = [f"{time} {name}/{index:06d}.{suffix}" for index, time in enumerate(times)]
        _write_lines(folder / f"{name}.txt", [f"# time in s, {name} image", *lines])
    track_lines = [
        f"{time} {' '.join(f'{value:.9f}' for value in (*pose[:3, 3], *quaternion_xyzw(pose[:3, :3])))}"
        for time, pose in zip(times, source.world_from_camera, strict=False)
    ]
    _write_lines(folder / "groundtruth.txt", ["# time in s, tx ty tz in m, qx qy qz qw", *track_lines])
    _write_lines(folder / "calibration.txt", [" ".join(repr(float(value)) for value in source.intrinsics)])


def _write_lines(file: Path, lines: list[str]) -> None:
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
