"""Objects over views: associate what a keyframe shows with what is known, merge doubles, drop what was seen once.

Source: METHOD section 4, after HOV-SG, ConceptGraphs and BBQ: geometric overlap plus the cosine of tag embeddings.
Departs: overlap is judged in both directions, and things of unlike names are one only when they fill the same space, so
that a table does not swallow the cup on it; two things seen side by side in one view are not merged for nearness.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel
from scipy.spatial import cKDTree

from placegraph.nodes.fusion.instance import Instance
from placegraph.nodes.fusion.lift import Observation

F32 = NDArray[np.float32]
Encode = Callable[[Sequence[str]], F32]  # names to (N, D) unit rows


class AssociationConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When two clouds are one object."""

    reach_voxels: float = 1.5  # METHOD: points this near each other count as shared
    same_cosine: float = 0.5  # BBQ; with WordLlama couch/sofa is .51, chair/table .18
    overlap: float = 0.25  # departs: of a keyframe with a known object of a like name; HOV-SG .75 doubles objects
    box_inside: float = 0.5  # departs: share of the smaller box inside the larger, for two sides of one thing
    box_overlap: float = 0.1  # departs: ... which must also share this much of their points
    unlike_overlap: float = 0.5  # departs: in both directions, when the names differ
    merge_overlap: float = 0.5  # BBQ: .7
    merge_unlike_overlap: float = 0.6
    merge_every: int = 10  # keyframes; BBQ: 20
    prune_after: int = 20  # keyframes without a second view; ConceptGraphs drops what has fewer than 3 views


class ObjectMap:
    """All objects of a run by number, with a grid over the plan that finds neighbours."""

    def __init__(self, encode: Encode, voxel_m: float, config: AssociationConfig) -> None:
        self.instances: dict[int, Instance] = {}
        self._encode = encode
        self._config = config
        self._reach_m = config.reach_voxels * voxel_m
        self._next = 0
        self._vectors: dict[str, F32] = {}
        self._grid = _Grid()
        self._apart: dict[tuple[int, int], int] = {}  # views that showed both as separate things
        self._checked: dict[int, int] = {}  # the revision at which an instance was last compared for merging

    def add(self, seen: Sequence[Observation], keyframe: int, frame_id: int) -> None:
        """Take all that keyframe number `keyframe` shows; strongest first. Merges and prunes every `merge_every`."""
        taken: dict[int, list[Observation]] = {}
        self._remember_vectors(observation.name for observation in seen)
        for observation in seen:
            number = self._match(observation, taken)
            if number is None:
                number = self._next
                self._next += 1
                self.instances[number] = Instance(number, observation, keyframe, frame_id)
            else:
                self.instances[number].update(observation, keyframe, frame_id)
            taken.setdefault(number, []).append(observation)
            self._grid.put(number, self.instances[number].box)
        self._note_apart(list(taken))
        if (keyframe + 1) % self._config.merge_every == 0:
            self.tidy(keyframe)

    def tidy(self, keyframe: int) -> None:
        """Merge doubles until none is left, then prune what one view alone showed long ago."""
        queue = [n for n, instance in self.instances.items() if self._checked.get(n) != instance.revision]
        while queue:
            number = queue.pop(0)
            if number not in self.instances:
                continue
            partner = self._double_of(number)
            if partner is None:
                self._checked[number] = self.instances[number].revision
                continue
            kept, gone = sorted((number, partner))
            self.instances[kept].absorb(self.instances[gone])
            self._grid.put(kept, self.instances[kept].box)
            self._forget(gone, kept)
            queue.append(kept)  # it has grown and may now meet a third; each round is one object fewer, so this ends
        for number in [n for n, instance in self.instances.items() if self._is_stale(instance, keyframe)]:
            self._forget(number, None)

    def _is_stale(self, instance: Instance, keyframe: int) -> bool:
        return instance.observations == 1 and keyframe - instance.last_keyframe >= self._config.prune_after

    def _forget(self, number: int, heir: int | None) -> None:
        del self.instances[number]
        self._checked.pop(number, None)
        self._grid.remove(number)
        for pair in [pair for pair in self._apart if number in pair]:
            views = self._apart.pop(pair)
            other = pair[0] if pair[1] == number else pair[1]
            if heir is not None and other != heir:
                key = (min(heir, other), max(heir, other))
                self._apart[key] = self._apart.get(key, 0) + views

    def _match(self, seen: Observation, taken: dict[int, list[Observation]]) -> int | None:
        c = self._config
        best: tuple[float, int] | None = None
        for number in self._grid.near(seen.box, self._reach_m):
            instance = self.instances[number]
            if not _boxes_meet(seen.box, instance.box, self._reach_m):
                continue
            forward, backward = self._shares(seen.points, None, instance)
            cosine = self._cosine({seen.name: 1.0}, instance.votes)
            inside = _inside(seen.box, instance.box, self._reach_m)
            most = max(forward, backward)
            if cosine >= c.same_cosine:
                # a second mask of one view joins only what it lies in: two chairs of a view stay two
                wanted = 2 * c.overlap if number in taken else c.overlap
                fits = most >= wanted or (number not in taken and inside >= c.box_inside and most >= c.box_overlap)
            else:
                fits = min(forward, backward) >= c.unlike_overlap
            score = most + inside + cosine
            if fits and (best is None or score > best[0]):
                best = (score, number)
        return None if best is None else best[1]

    def _double_of(self, number: int) -> int | None:
        c, instance = self._config, self.instances[number]
        best: tuple[float, int] | None = None
        for other in self._grid.near(instance.box, self._reach_m):
            candidate = self.instances[other]
            if other == number or not _boxes_meet(instance.box, candidate.box, self._reach_m):
                continue
            forward, backward = self._shares(instance.points, instance.tree, candidate)
            cosine = self._cosine(instance.votes, candidate.votes)
            most = max(forward, backward)
            apart = self._apart.get((min(number, other), max(number, other)), 0) >= 2
            fits = min(forward, backward) >= c.merge_unlike_overlap
            if cosine >= c.same_cosine and not apart:
                inside = _inside(instance.box, candidate.box, self._reach_m)
                fits |= most >= c.merge_overlap or (inside >= c.box_inside and most >= c.box_overlap)
            if fits and (best is None or most > best[0]):
                best = (most, other)
        return None if best is None else best[1]

    def _shares(self, points: NDArray[np.float64], tree: cKDTree | None, known: Instance) -> tuple[float, float]:
        # share of `points` near the known object's, and the other way round, looking only where they can meet
        forward = _share_near(points, known.tree, self._reach_m)
        if forward == 0:
            return 0.0, 0.0
        low, high = points.min(axis=0) - self._reach_m, points.max(axis=0) + self._reach_m
        meeting = known.points[((known.points >= low) & (known.points <= high)).all(axis=1)]
        near = _share_near(meeting, tree if tree is not None else cKDTree(points), self._reach_m)
        return forward, near * len(meeting) / len(known.points)

    def _remember_vectors(self, names: Iterable[str]) -> None:
        new = [name for name in dict.fromkeys(names) if name not in self._vectors]
        self._vectors.update(zip(new, self._encode(new) if new else (), strict=True))

    def _cosine(self, a: dict[str, float], b: dict[str, float]) -> float:
        """Of the vote-weighted mean tags; names without an embedding are alike when they are equal."""
        first, second = (
            sum((votes * self._vectors[name] for name, votes in side.items()), np.zeros(1)) for side in (a, b)
        )
        length = float(np.linalg.norm(first) * np.linalg.norm(second))
        if length == 0:
            return float(max(a, key=lambda name: (a[name], name)) == max(b, key=lambda name: (b[name], name)))
        return float(first @ second) / length

    def _note_apart(self, numbers: list[int]) -> None:
        for i, first in enumerate(numbers):
            for second in numbers[i + 1 :]:
                if _boxes_meet(self.instances[first].box, self.instances[second].box, self._reach_m):
                    key = (min(first, second), max(first, second))
                    self._apart[key] = self._apart.get(key, 0) + 1


class _Grid:
    """Which objects may be near a box: numbers by plan cell of 1 m, so that a search does not visit them all."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], set[int]] = {}
        self._spans: dict[int, list[tuple[int, int]]] = {}

    def put(self, number: int, box: F32) -> None:
        span = self._covered(box, 0.0)
        if self._spans.get(number) != span:
            self.remove(number)
            self._spans[number] = span
            for cell in span:
                self._cells.setdefault(cell, set()).add(number)

    def remove(self, number: int) -> None:
        for cell in self._spans.pop(number, ()):
            self._cells[cell].discard(number)

    def near(self, box: F32, reach_m: float) -> list[int]:
        found: set[int] = set()
        for cell in self._covered(box, reach_m):
            found |= self._cells.get(cell, set())
        return sorted(found)

    @staticmethod
    def _covered(box: F32, reach_m: float) -> list[tuple[int, int]]:
        (x0, y0), (x1, y1) = np.floor(box[0, :2] - reach_m).tolist(), np.floor(box[1, :2] + reach_m).tolist()
        return [(x, y) for x in range(int(x0), int(x1) + 1) for y in range(int(y0), int(y1) + 1)]


def _share_near(points: NDArray[np.float64], tree: cKDTree, reach_m: float) -> float:
    if not len(points):
        return 0.0
    distance, _ = tree.query(points, distance_upper_bound=reach_m)
    return float(np.isfinite(distance).mean())


def _boxes_meet(a: F32, b: F32, reach_m: float) -> bool:
    return bool((a[0] <= b[1] + reach_m).all() and (b[0] <= a[1] + reach_m).all())


def _inside(a: F32, b: F32, reach_m: float) -> float:
    """Share of the smaller box inside the other; both grown, as one view of a thing may be a thin sheet."""
    sizes = [box[1] - box[0] + reach_m for box in (a, b)]
    shared = np.clip(np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]) + reach_m, 0, None)
    return float(np.prod(shared) / min(np.prod(sizes[0]), np.prod(sizes[1])))
