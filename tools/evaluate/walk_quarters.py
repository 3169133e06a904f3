"""A map as it was after each quarter of the walk, against what the walk had shown of the house until then."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.errors import SchemaError, SourceError
from placegraph.runtime.messages import Graph, Map, NamedGraph, Segments
from placegraph.runtime.recording import read
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.aligned_map import EMPTY_MAP, AlignedMap, align_map
from placegraph.tools.evaluate.house_truth import house_ground_truth
from placegraph.tools.evaluate.layer_scores import map_scores
from placegraph.tools.evaluate.place_overlap import ratio
from placegraph.tools.evaluate.trajectory_error import against_given, level_alignment, paired
from placegraph.tools.simulator.ground_truth import CLEAR_SHARE, TRUTH, FrameCounts, Truth, read_truth
from placegraph.tools.view import RECORDING

QUARTERS = (0.25, 0.5, 0.75, 1.0)  # of the frames


@dataclass(frozen=True, eq=False)
class MapSnapshot:
    """The newest graph of a recording at a time, the map it was built from, and the stamps of the map's keyframes."""

    graph: Graph | NamedGraph
    map: Map
    stamps_ns: tuple[int, ...]


def walk_quarter_scores(folder: Path, source: Path, given: Mapping[int, F64]) -> dict[str, dict[str, Any]]:
    """Scores by the share of the walk ("25 %"); `given` are the poses (4, 4) by stamp_ns of all of SOURCE's frames.

    Each quarter scores the newest graph that was finished by then, aligned by the keyframes that it knows, where it
    placed them then; the ATE is that of those keyframes. Raises SourceError for a damaged truth, SchemaError for a
    damaged recording.
    """
    truth, stamps = read_truth(source), sorted(given)
    frame_counts = [max(1, round(quarter * len(stamps))) for quarter in QUARTERS]
    snapshots = recorded_snapshots(folder / RECORDING, [stamps[count - 1] for count in frame_counts])
    seen_by_quarter = _seen_after(source, truth, stamps, frame_counts)
    scores = {}
    for quarter, count, snapshot, seen in zip(QUARTERS, frame_counts, snapshots, seen_by_quarter, strict=True):
        positions = np.array([given[stamp][:3, 3] for stamp in stamps[:count]])
        aligned_map, ate = _align_snapshot(snapshot, given, str(folder / RECORDING))
        row = {"frames": count, "keyframes": 0 if snapshot is None else snapshot.map.keyframes} | ate
        scores[f"{quarter:.0%}"] = row | map_scores(aligned_map, house_ground_truth(truth, seen, positions))
    return scores


def _align_snapshot(
    snapshot: MapSnapshot | None, given: Mapping[int, F64], source: str
) -> tuple[AlignedMap, dict[str, float]]:
    """The map moved onto the truth, and its trajectory's error; fewer than three keyframes count as an empty map."""
    if snapshot is None:
        return EMPTY_MAP, {}
    map_ = snapshot.map
    cameras = map_.camera_positions_world.astype(np.float64)
    if len(cameras) != len(snapshot.stamps_ns):
        raise SchemaError(
            f"{source}: Map {map_.revision} knows {len(cameras)} keyframes, and {len(snapshot.stamps_ns)} Segments "
            "were recorded until then"
        )
    estimated = dict(zip(snapshot.stamps_ns, cameras, strict=True))
    ate = against_given(estimated, given)
    if ate is None:
        return EMPTY_MAP, {}
    clouds = {f"O{item.id}": item.points for item in map_.objects()}
    graph = SceneGraph.from_json(snapshot.graph.json)
    aligned_map = align_map(graph, clouds, level_alignment(*paired(estimated, given)), source)
    return aligned_map, {**ate, "ate_share": ratio(ate["ate_rmse_m"], ate["path_m"])}


def recorded_snapshots(recording: Path, until_ns: list[int]) -> list[MapSnapshot | None]:
    """For each time the newest recorded graph that is not later, with its map; None before the first one.

    Raises SourceError without the file, SchemaError when it is damaged or lacks the Map of a Graph.
    """
    graphs: list[Graph | NamedGraph] = []
    stamps: dict[int, int] = {}
    for message in read(
        recording, (Graph, NamedGraph, Segments)
    ):  # one Segments a keyframe, smaller than the Keyframe itself
        if isinstance(message, Graph | NamedGraph):
            graphs.append(message)
        else:
            stamps[message.frame_id] = message.stamp_ns
    newest = [
        max((g for g in graphs if g.stamp_ns <= end), key=lambda graph: graph.revision, default=None)
        for end in until_ns
    ]
    revisions = {graph.revision for graph in newest if graph is not None}
    maps = {m.revision: m for m in read(recording, (Map,)) if isinstance(m, Map) and m.revision in revisions}
    missing = sorted(revisions - maps.keys())
    if missing:
        raise SchemaError(f"{recording}: holds Graph {missing[0]} without the Map that it was built from")

    def snapshot(graph: Graph | NamedGraph) -> MapSnapshot:
        map_ = maps[graph.revision]
        keyframe_stamps = tuple(stamp for frame, stamp in sorted(stamps.items()) if frame <= map_.frame_id)
        return MapSnapshot(graph, map_, keyframe_stamps)

    return [None if graph is None else snapshot(graph) for graph in newest]


def _seen_after(
    source: Path, truth: Truth, stamps: list[int], frame_counts: list[int]
) -> list[tuple[FrameCounts, ...]]:
    """How each object was seen in the first frames, for each of these numbers of frames."""
    if len(stamps) != truth.house.frames:
        raise SourceError(
            f"{source}: {len(stamps)} frames have a pose, but {TRUTH}/house.json says {truth.house.frames} frames"
        )
    pixels = np.array([_object_pixels(source, index, len(truth.objects)) for index in range(max(frame_counts))])
    clear = pixels >= CLEAR_SHARE * truth.house.width * truth.house.height

    def seen(count: int) -> tuple[FrameCounts, ...]:
        frames, clear_frames = (mask[:count].sum(axis=0).tolist() for mask in (pixels > 0, clear))
        return tuple(
            FrameCounts(*counts) for counts in zip(range(len(truth.objects)), frames, clear_frames, strict=True)
        )

    return [seen(count) for count in frame_counts]


def _object_pixels(source: Path, index: int, objects: int) -> I64:
    """(objects,) pixels of each object in a frame."""
    file = source / TRUTH / "instances" / f"{index:06d}.png"
    try:
        image = cv2.imdecode(np.frombuffer(file.read_bytes(), np.uint8), cv2.IMREAD_UNCHANGED)
    except OSError as error:
        raise SourceError(f"{file}: cannot be read: {error.strerror}") from None
    except cv2.error:
        image = None
    if image is None or image.dtype != np.uint16 or image.max(initial=0) > objects:
        raise SourceError(f"{file}: not the image of object ids that `placegraph house` writes")
    return np.bincount(image.ravel(), minlength=objects + 1)[1:]
