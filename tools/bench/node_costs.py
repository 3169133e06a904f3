"""What each part of the dataflow costs, as a ratio to a baseline of the same run, so that machines can be compared."""

from __future__ import annotations

import dataclasses
import queue
import statistics
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TypeVar

import numpy as np

from placegraph.nodes.camera.flat import Flat
from placegraph.runtime.bus.session import Bus, BusConfig, free_endpoint
from placegraph.runtime.errors import PlacegraphError
from placegraph.runtime.messages import Keyframe
from placegraph.runtime.messages.codec import decode, encode
from placegraph.runtime.node import Context, Node, build_node
from placegraph.runtime.recording import RecordingWriter
from placegraph.tools.evaluate.report import table

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

    Hub, producer and consumer are sessions of this process: the links are those of a run, but there are no switches
    between processes. Raises PlacegraphError when a payload does not arrive.
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
        consumer.declare_alive("consumer")
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
    sent, arrived = queue.SimpleQueue[bytes | None](), queue.SimpleQueue[bytes]()

    def forward() -> None:
        while (data := sent.get()) is not None:
            arrived.put(bytes(memoryview(data)))  # the bus's consumer makes one copy, too

    def over_queue() -> None:
        sent.put(payload)
        arrived.get(timeout=ARRIVAL_TIMEOUT_S)

    thread = threading.Thread(target=forward)
    thread.start()
    try:
        return median_ms(over_queue, WALL)
    finally:
        sent.put(None)
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
    fusion = build_node("fusion", {"map_every_keyframes": MAP_EVERY}, Context())
    walk = drawn_keyframes(FUSION_KEYFRAMES, 240, 180)
    start = walk[: FUSION_KEYFRAMES // 4]
    perceive.start()
    try:
        # the start twice: voxels cost more when they are new, whatever the size of the map
        times_ms, outputs = _fuse([*start, *start, *walk[len(start) :], *start], perceive, fusion)
    finally:
        perceive.stop()
    early, late = slice(len(start), 2 * len(start)), slice(-len(start), None)
    costs = []
    for part, with_map in (("fusion: add a keyframe", False), ("fusion: add and give the map", True)):
        medians = [
            statistics.median(
                ms for ms, has_map in zip(times_ms[when], outputs[when], strict=True) if has_map is with_map
            )
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


def cost_table(costs: list[Cost]) -> str:
    """Aligned text, one row a cost."""
    rows = [(c.part, f"{c.ms:.3f}", c.baseline, f"{c.baseline_ms:.3f}", f"{c.ratio:.2f}") for c in costs]
    return table([("part", "ms", "baseline", "ms", "ratio"), *rows], left=(0, 2))
