"""Measure what each part costs, as ratios to a baseline of the same run, so that machines can be compared."""

from __future__ import annotations

import dataclasses
import json
import queue
import statistics
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import typer

from placegraph.nodes.camera.flat import Flat
from placegraph.runtime.bus.session import Bus, BusConfig, free_endpoint
from placegraph.runtime.errors import PlacegraphError
from placegraph.runtime.messages import Keyframe
from placegraph.runtime.messages.codec import decode, encode
from placegraph.runtime.node import Context, Node, build_node
from placegraph.runtime.recording import RecordingWriter
from placegraph.tools.bench.map_growth import Sample, drawing, grow, p95_by_floor
from placegraph.tools.bench.reply_contract import fuzz

IMAGE = {"width": 640, "height": 480}  # what an OAK-D gives
REPEATS = 30
FRAME_PERIOD_MS = 1000 / 30  # a depth camera's frame rate
POSE_FRAMES = 20
FUSION_KEYFRAMES, MAP_EVERY = 40, 2
ARRIVAL_TIMEOUT_S = 10.0

T = TypeVar("T")


@dataclass(frozen=True)
class Cost:
    """One row: a part's time, its baseline's time in the same run, and the ratio of the two (0.5: half as long)."""

    part: str
    ms: float
    baseline: str
    baseline_ms: float

    @property
    def ratio(self) -> float:
        """Time over the baseline's time."""
        return self.ms / self.baseline_ms


Clock = Callable[[], float]  # seconds
CPU, WALL = time.process_time, time.perf_counter  # other jobs disturb CPU time less, but it does not see waiting


def median_ms(action: Callable[[], object], clock: Clock = CPU, repeats: int = REPEATS) -> float:
    """Median time of `repeats` calls after one that does not count, in ms."""
    action()
    return statistics.median(_timed_ms(action, clock)[0] for _ in range(repeats))


def _timed_ms(action: Callable[[], T], clock: Clock = CPU) -> tuple[float, T]:
    began = clock()
    result = action()
    return (clock() - began) * 1e3, result


def drawn_keyframes(count: int, width: int, height: int) -> list[Keyframe]:
    """Keyframes evenly along the drawn scene's walk, at their true poses; one keyframe: the walk's start."""
    source = Flat(Path(), {"width": width, "height": height, "frames": max(count, 2)})
    return [Keyframe.of(frame, frame.given_world_from_camera) for frame in islice(source.frames(), count)]


def codec_costs(keyframe: Keyframe) -> list[Cost]:
    """Encode and decode against one copy of the payload's bytes."""
    payload = encode(keyframe)
    source, target = np.frombuffer(payload, np.uint8), np.empty(len(payload), np.uint8)
    copy_ms, baseline = median_ms(lambda: np.copyto(target, source)), f"memcpy of its {len(payload) / 1e6:.2f} MB"
    return [
        Cost("codec: encode a keyframe", median_ms(lambda: encode(keyframe)), baseline, copy_ms),
        Cost("codec: decode a keyframe", median_ms(lambda: decode(Keyframe, payload)), baseline, copy_ms),
    ]


def bus_cost(keyframe: Keyframe) -> Cost:
    """From put to arrival through a hub over loopback TCP, against a queue between two threads.

    Hub, giver and taker are sessions of this process: the links are those of a run, the switches between processes are
    not counted. Raises PlacegraphError when a payload does not arrive.
    """
    payload, arrived = encode(keyframe), queue.SimpleQueue[bytes]()

    def receive() -> None:
        try:
            arrived.get(timeout=ARRIVAL_TIMEOUT_S)
        except queue.Empty:
            raise PlacegraphError(f"the bus did not deliver within {ARRIVAL_TIMEOUT_S:g} s over loopback") from None

    config = BusConfig.model_validate({"endpoint": free_endpoint()})
    with Bus(config, hub=True), Bus(config) as producer, Bus(config) as consumer:
        consumer.subscribe(lambda key, data, attachment: arrived.put(data), "bench")
        consumer.declare_alive("taker")
        ready = threading.Event()
        producer.watch_alive(lambda name, present: ready.set())
        if not ready.wait(ARRIVAL_TIMEOUT_S):
            raise PlacegraphError(f"nobody appeared on the bus within {ARRIVAL_TIMEOUT_S:g} s over loopback")
        put = producer.publisher("bench")

        def over_bus() -> None:
            put(payload, b"")
            receive()

        bus_ms = median_ms(over_bus, WALL)
    return Cost("bus: a keyframe over loopback", bus_ms, "queue between threads", _between_threads_ms(payload))


def _between_threads_ms(payload: bytes) -> float:
    asked, arrived = queue.SimpleQueue[bytes | None](), queue.SimpleQueue[bytes]()

    def pass_on() -> None:
        while (data := asked.get()) is not None:
            arrived.put(bytes(memoryview(data)))  # the one copy that the bus's taker makes too

    def over_queue() -> None:
        asked.put(payload)
        arrived.get(timeout=ARRIVAL_TIMEOUT_S)

    thread = threading.Thread(target=pass_on)
    thread.start()
    try:
        return median_ms(over_queue, WALL)
    finally:
        asked.put(None)
        thread.join()


def pose_cost() -> Cost:
    """One step of odometry on 640x480, against the time to the camera's next frame."""
    source = Flat(Path(), IMAGE)
    node = build_node("pose", {}, Context())
    times_ms = [_timed_ms(partial(node.step, frame))[0] for frame in islice(source.frames(), POSE_FRAMES)]
    return Cost("pose: one frame", statistics.median(times_ms[1:]), "frame period at 30 Hz", FRAME_PERIOD_MS)


def fusion_costs() -> list[Cost]:
    """A step of fusion after the whole walk against early in it, for the same views: how costs grow with the map."""
    perceive = build_node("instances", {"model": "drawn_scene"}, Context())
    fusion = build_node("fusion", {"map_every": MAP_EVERY}, Context())
    walk = drawn_keyframes(FUSION_KEYFRAMES, 240, 180)
    start = walk[: FUSION_KEYFRAMES // 4]
    perceive.start()
    try:
        # twice at first: what is new costs more than what is known, whatever the size of the map
        times_ms, outputs = _fuse([*start, *start, *walk[len(start) :], *start], perceive, fusion)
    finally:
        perceive.stop()
    early, late = slice(len(start), 2 * len(start)), slice(-len(start), None)
    costs = []
    for part, given in (("fusion: add a keyframe", False), ("fusion: add and give the map", True)):
        medians = [
            statistics.median(ms for ms, gave in zip(times_ms[when], outputs[when], strict=True) if gave is given)
            for when in (late, early)
        ]
        costs.append(Cost(f"{part}, whole walk", medians[0], "same views, first quarter", medians[1]))
    return costs


def _fuse(views: list[Keyframe], perceive: Node, fusion: Node) -> tuple[list[float], list[bool]]:
    """Time of each view's step in ms, and whether it gave the Map."""
    times_ms, outputs = [], []
    for frame_id, view in enumerate(views):
        keyframe = dataclasses.replace(view, frame_id=frame_id)
        _, segments = perceive.step(keyframe)
        fusion.step(keyframe)
        took_ms, maps = _timed_ms(partial(fusion.step, segments))
        times_ms.append(took_ms)
        outputs.append(bool(maps))
    return times_ms, outputs


def recorder_cost(keyframe: Keyframe) -> Cost:
    """Writing a keyframe into a recording, flushes included, against encoding it for the bus."""
    with tempfile.TemporaryDirectory() as folder:
        writer = RecordingWriter(Path(folder) / "bench.rrd", "bench", {})
        try:
            write_ms = median_ms(lambda: writer.write(keyframe))
        finally:
            writer.close()
    return Cost("recorder: write a keyframe", write_ms, "codec encode", median_ms(lambda: encode(keyframe)))


def measure() -> list[Cost]:
    """All costs, on one thread for each library."""
    (keyframe,) = drawn_keyframes(1, **IMAGE)
    return [*codec_costs(keyframe), bus_cost(keyframe), pose_cost(), *fusion_costs(), recorder_cost(keyframe)]


def table(costs: list[Cost]) -> str:
    """Aligned text, one row a cost."""
    rows = [("part", "ms", "baseline", "ms", "ratio")]
    rows += [(c.part, f"{c.ms:.3f}", c.baseline, f"{c.baseline_ms:.3f}", f"{c.ratio:.2f}") for c in costs]
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    lines = []
    for row in rows:
        cells = [
            text.ljust(w) if i in (0, 2) else text.rjust(w) for i, (text, w) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def growth_table(samples: list[Sample]) -> str:
    """A row for each floor: percentiles and mean of what a keyframe took, and the slowest Map with its graph."""
    rows = ["floor  voxels     p50    p95   mean  slowest, ms a keyframe"]
    for floor in sorted({one.floor for one in samples}):
        here = [one for one in samples if one.floor == floor]
        ms = [one.ms for one in here]
        p50, p95 = np.percentile(ms, (50, 95))
        rows.append(f"{floor:5}  {here[-1].voxels:8} {p50:6.1f} {p95:6.1f} {np.mean(ms):6.1f} {max(ms):8.1f}")
    return "\n".join(rows)


def bench(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    growth: Annotated[
        Path | None, typer.Option(help="Instead: draw (SVG) what keyframes cost as a generated building is mapped.")
    ] = None,
    floors: Annotated[int, typer.Option(min=1, help="Of that building.")] = 10,
    rooms: Annotated[int, typer.Option(min=1, help="Of each of its floors.")] = 20,
    requests: Annotated[
        int, typer.Option("--fuzz", min=0, help="Instead: put so many broken and hostile requests to the reasoner.")
    ] = 0,
    mode: Annotated[str, typer.Option(help="Of those requests: program, rules or deductive.")] = "program",
    seed: Annotated[int, typer.Option(min=0, help="Of those requests and of the house they are about.")] = 0,
) -> None:
    """Measure each part on this machine: times, and ratios to baselines of the same run. Takes under a minute.

    Times are CPU time, for the bus elapsed time, medians of many. They differ between machines; ratios say whether a
    part has become worse. With --fuzz the exit status is 1 when a reply broke its contract.
    """
    if growth is not None:
        samples = grow(floors, rooms)
        growth.write_text(drawing(samples, rooms), encoding="utf-8")
        p95 = p95_by_floor(samples)
        document = {"p95_ms": p95, "keyframes": len(samples), "voxels": samples[-1].voxels, "ratio": p95[-1] / p95[0]}
        print(json.dumps(document, indent=1) if as_json else growth_table(samples))
        return
    if requests:
        outcome = fuzz(requests, mode=mode, seed=seed)
        print(json.dumps(outcome.document(), indent=1))
        if outcome.faults:
            raise typer.Exit(1)
        return
    costs = measure()
    if as_json:
        print(json.dumps([asdict(cost) | {"ratio": cost.ratio} for cost in costs], indent=1))
    else:
        print(table(costs))
