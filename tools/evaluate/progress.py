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
from placegraph.runtime.messages import Graph, Map, Segments
from placegraph.runtime.recording import read
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.aligned_map import NOTHING, AlignedMap, aligned
from placegraph.tools.evaluate.house import known_of
from placegraph.tools.evaluate.scores import map_scores
from placegraph.tools.evaluate.trajectory import against_given, level_alignment, paired
from placegraph.tools.simulator.truth import CLEAR_SHARE, TRUTH, Seen, Truth, read_truth
from placegraph.tools.view import RECORDING

PARTS = (0.25, 0.5, 0.75, 1.0)  # of the frames


@dataclass(frozen=True, eq=False)
class Part:
    """The newest graph of a recording by a time, the map it was built from, and when each keyframe of it was."""

    graph: Graph
    map: Map
    stamps_ns: tuple[int, ...]


def progress_scores(folder: Path, source: Path, given: Mapping[int, F64]) -> dict[str, dict[str, Any]]:
    """Scores by the share of the walk ("25 %"); `given` are the poses (4, 4) by stamp_ns of all of SOURCE's frames.

    Of each part the newest graph that was finished by then counts, laid onto the truth by the keyframes that it knows,
    where it put them then; the ATE is that of those. Raises SourceError for a damaged truth, SchemaError for a damaged
    recording.
    """
    truth, stamps = read_truth(source), sorted(given)
    counts = [max(1, round(part * len(stamps))) for part in PARTS]
    parts = recorded_parts(folder / RECORDING, [stamps[count - 1] for count in counts])
    sights = _seen_after(source, truth, stamps, counts)
    found = {}
    for share, count, part, seen in zip(PARTS, counts, parts, sights, strict=True):
        true = np.array([given[stamp][:3, 3] for stamp in stamps[:count]])
        laid, ate = _laid(part, given, str(folder / RECORDING))
        row = {"frames": count, "keyframes": 0 if part is None else part.map.keyframes} | ate
        found[f"{share:.0%}"] = row | map_scores(laid, known_of(truth, seen, true))
    return found


def _laid(part: Part | None, given: Mapping[int, F64], where: str) -> tuple[AlignedMap, dict[str, float]]:
    """The map onto the truth, and its trajectory's error; a map of fewer than three keyframes is none."""
    if part is None:
        return NOTHING, {}
    cameras = part.map.camera_positions_world.astype(np.float64)
    if len(cameras) != len(part.stamps_ns):
        raise SchemaError(
            f"{where}: Map {part.map.revision} knows {len(cameras)} keyframes, and {len(part.stamps_ns)} Segments "
            "were recorded until then"
        )
    known = dict(zip(part.stamps_ns, cameras, strict=True))
    ate = against_given(known, given)
    if ate is None:
        return NOTHING, {}
    clouds = {f"O{item.id}": item.points for item in part.map.objects()}
    graph = SceneGraph.from_json(part.graph.json)
    laid = aligned(graph, clouds, level_alignment(*paired(known, given)), where)
    share = ate["ate_rmse_m"] / ate["path_m"] if ate["path_m"] else float("nan")
    return laid, {**ate, "ate_share": share}


def recorded_parts(recording: Path, until_ns: list[int]) -> list[Part | None]:
    """Of each time the newest recorded graph that is not later, with its map; None before the first one.

    Raises SourceError without the file, SchemaError when it is damaged or lacks the Map of a Graph.
    """
    graphs: list[Graph] = []
    stamps: dict[int, int] = {}
    for message in read(recording, (Graph, Segments)):  # Segments: one a keyframe, and small
        if isinstance(message, Graph):
            graphs.append(message)
        else:
            stamps[message.frame_id] = message.stamp_ns
    newest = [max((g for g in graphs if g.stamp_ns <= end), key=_age, default=None) for end in until_ns]
    asked = {graph.revision for graph in newest if graph is not None}
    maps = {one.revision: one for one in read(recording, (Map,)) if isinstance(one, Map) and one.revision in asked}
    absent = sorted(asked - maps.keys())
    if absent:
        raise SchemaError(f"{recording}: holds Graph {absent[0]} without the Map that it was built from")

    def part(graph: Graph) -> Part:
        upto = tuple(stamp for frame, stamp in sorted(stamps.items()) if frame <= maps[graph.revision].frame_id)
        return Part(graph, maps[graph.revision], upto)

    return [None if graph is None else part(graph) for graph in newest]


def _age(graph: Graph) -> tuple[int, bool]:
    return graph.revision, graph.named


def _seen_after(source: Path, truth: Truth, stamps: list[int], counts: list[int]) -> list[tuple[Seen, ...]]:
    """How each object was seen in the first frames, for each number of them."""
    if len(stamps) != truth.house.frames:
        raise SourceError(
            f"{source}: {len(stamps)} frames have a pose, and {TRUTH}/house.json tells of {truth.house.frames}"
        )
    pixels = np.array([_pixels(source, index, len(truth.objects)) for index in range(max(counts))])
    clear = pixels >= CLEAR_SHARE * truth.house.width * truth.house.height
    return [
        tuple(
            Seen(id, frames, well)
            for id, (frames, well) in enumerate(
                zip((pixels[:count] > 0).sum(axis=0).tolist(), clear[:count].sum(axis=0).tolist(), strict=True)
            )
        )
        for count in counts
    ]


def _pixels(source: Path, index: int, objects: int) -> I64:
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
