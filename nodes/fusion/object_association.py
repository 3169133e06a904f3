"""Objects over views: associate what a keyframe shows with what is known, merge doubles, drop what was seen once.

Source: METHOD section 4, after HOV-SG, ConceptGraphs and BBQ: geometric overlap plus the cosine of tag embeddings.
Departs: overlap is judged in both directions, and things of unlike names are one only when they fill the same space, so
that a table does not swallow the cup on it; two things seen side by side in one view are not merged for nearness.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel
from scipy.spatial import cKDTree

from placegraph.nodes.fusion.mask_lifting import Observation
from placegraph.nodes.fusion.object_cloud import Ground
from placegraph.nodes.fusion.object_instance import Instance
from placegraph.nodes.fusion.spatial_index import Grid, boxes_meet, inside, share_near, spans
from placegraph.nodes.fusion.visibility import Sight
from placegraph.runtime.arrays import F32, F64

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
    # departs: two sides of a pole or a board share no point; most of each is this near to the other
    sides_m: float = 0.12
    sides_share: float = 0.8  # of the one; of the other, which may be seen in full, `overlap`
    split_gap_m: float = 0.1  # departs: between two masks of one view that both lie on one object
    split_views: int = 3  # departs: so many more views with such a gap than without: it is two objects
    merge_every: int = 10  # keyframes; BBQ: 20
    prune_after: int = 20  # keyframes without a second view; ConceptGraphs drops what has fewer than 3 views


class Moment(NamedTuple):
    """When something was seen: the keyframe, counted from 0 over the run, its frame id and its submap."""

    keyframe: int
    frame_id: int
    submap: int = 0


class Retired(NamedTuple):
    """An object that is no longer where it was, and the frame that made it certain."""

    instance: Instance
    gone_frame: int


class ObjectMap:
    """All objects of a run by number, with a grid over the plan that finds neighbours."""

    def __init__(self, encode: Encode, ground: Ground, config: AssociationConfig) -> None:
        self.instances: dict[int, Instance] = {}
        self.retired: dict[int, Retired] = {}
        self._encode = encode
        self._config = config
        self._ground = ground
        self._reach_m = config.reach_voxels * ground.voxel_m
        self._next = 0
        self._vectors: dict[str, F32] = {}
        self._grid = Grid()
        self._apart: dict[tuple[int, int], int] = {}  # views that showed both as separate things
        self._looked_at: list[int] = []  # by the last keyframe
        self._checked: dict[int, int] = {}  # the revision at which an instance was last compared for merging

    def add(self, seen: Sequence[Observation], moment: Moment) -> None:
        """Take all that a keyframe shows; strongest first. Merges and prunes every `merge_every`."""
        taken: dict[int, list[Observation]] = {}
        self._remember_vectors(observation.name for observation in seen)
        for observation in seen:
            number = self._match(observation, taken)
            if number is None:
                number = self._next
                self._next += 1
                self.instances[number] = Instance(number, observation, *moment, self._ground)
            else:
                self.instances[number].update(observation, *moment)
            taken.setdefault(number, []).append(observation)
            self._grid.put(number, self.instances[number].box)
        for number, observations in taken.items():
            self._note_gap(self.instances[number], observations)
        self._note_apart(list(taken))
        if (moment.keyframe + 1) % self._config.merge_every == 0:
            self.tidy(moment.keyframe)

    def _note_gap(self, instance: Instance, observations: list[Observation]) -> None:
        """Two things that were taken for one are told apart by views that show both, with a gap between them."""
        c = self._config
        if len(observations) == 1:
            instance.gaps -= instance.gaps > 0 and spans(observations[0].points, instance.sides, self._reach_m)
            return
        sides = observations[0].points, observations[1].points
        if self._cosine({observations[0].name: 1.0}, {observations[1].name: 1.0}) < c.same_cosine:
            return
        if share_near(sides[0], cKDTree(sides[1]), c.split_gap_m) > 0:
            return
        instance.gaps, instance.sides = instance.gaps + 1, sides
        if instance.gaps >= c.split_views:
            other = instance.split(self._next)
            self._next += 1
            self.instances[other.number] = other
            for one in (instance, other):
                self._grid.put(one.number, one.box)
            self._apart[instance.number, other.number] = c.split_views

    def look(self, sight: Sight) -> None:
        """Take what a depth image says of the objects in its view; call it before `add` of the same keyframe."""
        for number in self._looked_at:
            if number in self.instances:
                self.instances[number].look_away()
        self._looked_at = []
        for number in self._grid.near(sight.box, 0.0):
            instance = self.instances[number]
            if sight.box_in_view(instance.box):
                self._looked_at.append(number)
                instance.look(*sight.judge(instance.points), sight.config)
                self._grid.put(number, instance.box)

    def retire(self, views: int, frame_id: int) -> None:
        """Objects that so many keyframes have seen through since they were last seen are no longer there."""
        for number in [n for n, instance in self.instances.items() if instance.absences >= views]:
            self.retired[number] = Retired(self.instances[number], frame_id)
            self._forget(number, None)

    def move(self, moves: Mapping[int, F64], keyframe: int) -> None:
        """Follow submaps that have moved; what now coincides becomes one, also with what was given up for gone."""
        for instance in self.instances.values():
            if instance.cloud.is_of(moves):
                instance.follow()
                self._grid.put(instance.number, instance.box)
        for number, (instance, _) in list(self.retired.items()):
            if instance.cloud.is_of(moves):
                instance.follow()
                self._revive(number)
        self.tidy(keyframe)

    def _revive(self, number: int) -> None:
        """An object that was only looked for in the wrong place is the one that was then found in the right place."""
        instance = self.retired[number].instance
        self.instances[number] = instance
        if (partner := self._double_of(number)) is None:
            del self.instances[number]
            return
        del self.retired[number]
        self._grid.put(number, instance.box)
        self._merge(number, partner)

    def _merge(self, a: int, b: int) -> int:
        kept, gone = sorted((a, b))
        self.instances[kept].absorb(self.instances[gone])
        self._grid.put(kept, self.instances[kept].box)
        self._forget(gone, kept)
        return kept

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
            queue.append(
                self._merge(number, partner)
            )  # it has grown and may now meet a third; each round is one object fewer, so this ends
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
            if not boxes_meet(seen.box, instance.box, self._reach_m):
                continue
            forward, backward = self._shares(seen.points, None, instance)
            cosine = self._cosine({seen.name: 1.0}, instance.votes)
            within = inside(seen.box, instance.box, self._reach_m)
            most = max(forward, backward)
            if cosine >= c.same_cosine:
                # a second mask of one view joins only what it lies in: two chairs of a view stay two
                wanted = 2 * c.overlap if number in taken else c.overlap
                fits = most >= wanted or (number not in taken and within >= c.box_inside and most >= c.box_overlap)
            else:
                fits = min(forward, backward) >= c.unlike_overlap
            score = most + within + cosine
            if fits and (best is None or score > best[0]):
                best = (score, number)
        return None if best is None else best[1]

    def _double_of(self, number: int) -> int | None:
        c, instance = self._config, self.instances[number]
        best: tuple[float, int] | None = None
        reach_m = max(self._reach_m, c.sides_m)
        for other in self._grid.near(instance.box, reach_m):
            candidate = self.instances[other]
            if other == number or not boxes_meet(instance.box, candidate.box, reach_m):
                continue
            forward, backward = self._shares(instance.points, instance.tree, candidate)
            cosine = self._cosine(instance.votes, candidate.votes)
            most = max(forward, backward)
            apart = self._apart.get((min(number, other), max(number, other)), 0)
            fits = min(forward, backward) >= c.merge_unlike_overlap
            if cosine >= c.same_cosine and apart < 2:
                within = inside(instance.box, candidate.box, self._reach_m)
                fits |= most >= c.merge_overlap or (within >= c.box_inside and most >= c.box_overlap)
                fits |= not apart and self._are_sides(instance, candidate)
            if fits and (best is None or most > best[0]):
                best = (most, other)
        return None if best is None else best[1]

    def _are_sides(self, one: Instance, other: Instance) -> bool:
        """Whether two clouds lie along each other, as those of a thin thing's two sides do."""
        c = self._config
        pairs = ((one.points, other.tree), (other.points, one.tree))
        less, most = sorted(share_near(points, tree, c.sides_m) for points, tree in pairs)
        return most >= c.sides_share and less >= c.overlap

    def _shares(self, points: F64, tree: cKDTree | None, known: Instance) -> tuple[float, float]:
        # share of `points` near the known object's, and the other way round, looking only where they can meet
        forward = share_near(points, known.tree, self._reach_m)
        if forward == 0:
            return 0.0, 0.0
        low, high = points.min(axis=0) - self._reach_m, points.max(axis=0) + self._reach_m
        meeting = known.points[((known.points >= low) & (known.points <= high)).all(axis=1)]
        near = share_near(meeting, tree if tree is not None else cKDTree(points), self._reach_m)
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
        reach_m = max(self._reach_m, self._config.sides_m)
        for i, first in enumerate(numbers):
            for second in numbers[i + 1 :]:
                if boxes_meet(self.instances[first].box, self.instances[second].box, reach_m):
                    key = (min(first, second), max(first, second))
                    self._apart[key] = self._apart.get(key, 0) + 1
