"""What a keyframe costs as the map grows: a building of many floors (box_building.py), mapped room by room."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.messages import LastKeyframe, Map, Message
from placegraph.runtime.node import Context, Node, build_node
from placegraph.tools.bench.box_building import views

STRIDE = 1  # as many points a keyframe as every fourth pixel each way of 640 x 480


@dataclass(frozen=True)
class Sample:
    """A keyframe: its floor, the size of the newest Map, CPU time of each node in ms, whether it gave a new Map."""

    floor: int
    voxels: int
    fusion_ms: float
    hierarchy_ms: float
    with_map: bool

    @property
    def ms(self) -> float:
        """Both nodes together."""
        return self.fusion_ms + self.hierarchy_ms


def grow(floors: int, rooms: int) -> list[Sample]:
    """Map the building and time each keyframe (CPU time)."""
    fusion = build_node("fusion", {"stride": STRIDE}, Context())
    hierarchy = build_node("hierarchy", {}, Context())
    samples: list[Sample] = []
    voxels = 0
    for floor, keyframe, segments in views(floors, rooms):
        fusion.step(keyframe)
        fusion_ms, maps = _timed(fusion, segments)
        hierarchy_ms = 0.0
        for message in maps:
            assert isinstance(message, Map)
            voxels = len(message.points_world)
            hierarchy_ms += _timed(hierarchy, message)[0]
        samples.append(Sample(floor, voxels, fusion_ms, hierarchy_ms, bool(maps)))
    (last,) = fusion.step(LastKeyframe(frame_id=len(samples) - 1, stamp_ns=0, keyframes=len(samples)))
    assert isinstance(last, Map)
    return samples


def _timed(node: Node, message: Message) -> tuple[float, list[Message]]:
    began = time.process_time()
    outputs = list(node.step(message))
    return (time.process_time() - began) * 1e3, outputs


def _by_floor(samples: list[Sample]) -> list[list[Sample]]:
    return [[sample for sample in samples if sample.floor == floor] for floor in sorted({s.floor for s in samples})]


def p95_by_floor(samples: list[Sample]) -> list[float]:
    """95th percentile of a keyframe's time in ms, floor by floor."""
    return [float(np.percentile([sample.ms for sample in floor], 95)) for floor in _by_floor(samples)]


def growth_table(samples: list[Sample]) -> str:
    """A row for each floor: percentiles and mean of a keyframe's time, and the slowest keyframe."""
    rows = ["floor  voxels     p50    p95   mean  slowest, ms a keyframe"]
    for floor in _by_floor(samples):
        ms = [sample.ms for sample in floor]
        p50, p95 = np.percentile(ms, (50, 95))
        rows.append(f"{floor[0].floor:5}  {floor[-1].voxels:8} {p50:6.1f} {p95:6.1f} {np.mean(ms):6.1f} {max(ms):8.1f}")
    return "\n".join(rows)


def drawing(samples: list[Sample], rooms: int) -> str:
    """SVG: each keyframe's time, those with a new Map in another colour, and the 95th percentile of each floor."""
    width, height, left, top = 900, 420, 60, 40
    slowest = max(sample.ms for sample in samples)
    low, high = np.log10(1.0), np.log10(max(slowest, 10.0)) * 1.02
    p95 = p95_by_floor(samples)

    def x(index: float) -> float:
        return left + index / len(samples) * width

    def y(ms: float) -> float:
        return float(top + (high - np.log10(max(ms, 1.0))) / (high - low) * height)

    size = f'viewBox="0 0 {left + width + 20} {top + height + 50}" width="{left + width + 20}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="12">',
        f'<text x="{left}" y="18">ms of CPU a keyframe, fusion and hierarchy: {len(p95)} floors of {rooms} rooms, '
        f"{samples[-1].voxels:,} voxels at the end</text>",
        f'<text x="{left}" y="34" fill="#999">dots: keyframes; orange: those with a new Map and a graph of it; '
        "line: 95th percentile of each floor</text>",
    ]
    for ms in (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0):
        if np.log10(ms) <= high:
            parts.append(f'<path d="M{left} {y(ms):.1f}h{width}" stroke="#ddd"/>')
            parts.append(f'<text x="{left - 6}" y="{y(ms) + 4:.1f}" text-anchor="end">{ms:.0f}</text>')
    for k, sample in enumerate(samples):
        look = 'r="2.4" fill="#e07b28"' if sample.with_map else 'r="1.2" fill="#7a8fb0"'
        parts.append(f'<circle cx="{x(k):.1f}" cy="{y(sample.ms):.1f}" {look}/>')
    share = len(samples) / len(p95)
    line = " ".join(f"{x((k + 0.5) * share):.1f},{y(ms):.1f}" for k, ms in enumerate(p95))
    parts.append(f'<polyline points="{line}" fill="none" stroke="#b02a48" stroke-width="2"/>')
    for k, value in enumerate(p95):
        label = f'<text x="{x((k + 0.5) * share):.1f}" y="{top + height + 18}" text-anchor="middle">'
        parts.append(f"{label}{value:.0f}</text>")
    parts.append(f'<text x="{left}" y="{top + height + 38}">p95 in ms by floor</text></svg>')
    return "\n".join(parts) + "\n"
