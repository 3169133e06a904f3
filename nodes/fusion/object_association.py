"""Objects over views: associate what a keyframe shows with known objects, merge duplicates, drop what was seen once.

Source: paper, object layer, after HOV-SG, ConceptGraphs and BBQ: geometric overlap plus the cosine of name embeddings.
Not as there: overlap counts in both directions, and objects of unlike names are one only when they fill the same space,
so that a table does not swallow the cup on it; two objects seen side by side in one view are not merged for being near.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel
from scipy.spatial import cKDTree

from placegraph.nodes.fusion.mask_lifting import Observation
from placegraph.nodes.fusion.object_cloud import VoxelContext
from placegraph.nodes.fusion.object_instance import KeyframeStamp, ObjectInstance
from placegraph.nodes.fusion.spatial_index import SpatialIndex, boxes_within, containment, share_near, touches_both
from placegraph.nodes.fusion.visibility import DepthVisibility
from placegraph.runtime.arrays import F32, F64

Encode = Callable[[Sequence[str]], F32]  # names to (N, D) unit rows


class AssociationConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When two clouds are one object. Values without a source were chosen by hand."""

    reach_voxels: float = 1.5  # points this near each other count as shared
    same_cosine: float = 0.5  # BBQ; with WordLlama couch/sofa is .51, chair/table .18
    overlap: float = 0.25  # with a known object of a similar name; HOV-SG's .75 duplicates objects
    box_inside: float = 0.5  # share of the smaller box inside the larger, for two sides of one object
    box_overlap: float = 0.1  # ... which must also share this much of their points
    unlike_overlap: float = 0.5  # with an object of another name, in both directions
    merge_overlap: float = 0.5  # BBQ: .7
    merge_unlike_overlap: float = 0.6
    sides_m: float = 0.12  # two sides of a pole or a board share no point, but most of each is this near to the other
    sides_share: float = 0.8  # of one side's points; for the other side, which may be seen in full, `overlap`
    split_gap_m: float = 0.1  # minimum gap between two masks of one view that lie on one object, to count as two
    split_views: int = 3  # an object is split when this many more views show such a gap than do not
    merge_every: int = 10  # keyframes; BBQ: 20
    prune_after: int = 20  # keyframes without a second view; ConceptGraphs drops what has fewer than 3 views


class RetiredInstance(NamedTuple):
    """An object that is no longer where it was, and the frame that made it certain."""

    instance: ObjectInstance
    gone_frame: int


class ObjectMap:
    """All objects of a run by id, with an index of where they are."""

    def __init__(self, encode: Encode, context: VoxelContext, config: AssociationConfig) -> None:
        self.instances: dict[int, ObjectInstance] = {}
        self.retired: dict[int, RetiredInstance] = {}
        self._encode = encode
        self._config = config
        self._context = context
        self._reach_m = config.reach_voxels * context.voxel_m
        self._next_id = 0
        self._name_vectors: dict[str, F32] = {}
        self._spatial_index = SpatialIndex()
        self._seen_apart: Counter[frozenset[int]] = Counter()  # views that showed both as separate objects
        self._visible_ids: list[int] = []  # of the last keyframe
        self._checked_revisions: dict[int, int] = {}  # at which an object was last compared with its neighbours

    def add(self, observations: Sequence[Observation], stamp: KeyframeStamp) -> None:
        """Add all that a keyframe shows, strongest first. Merges and prunes every `merge_every` keyframes."""
        observed: dict[int, list[Observation]] = {}
        self._encode_names(observation.name for observation in observations)
        for observation in observations:
            object_id = self._find_match(observation, observed)
            if object_id is None:
                object_id = self._next_id
                self._next_id += 1
                self.instances[object_id] = ObjectInstance(object_id, observation, stamp, self._context)
            else:
                self.instances[object_id].update(observation, stamp)
            observed.setdefault(object_id, []).append(observation)
            self._spatial_index.update(object_id, self.instances[object_id].box)
        for object_id, views in observed.items():
            self._update_split_votes(self.instances[object_id], views)
        self._count_seen_apart(list(observed))
        if (stamp.keyframe + 1) % self._config.merge_every == 0:
            self.merge_duplicates(stamp.keyframe)

    def _update_split_votes(self, instance: ObjectInstance, views: list[Observation]) -> None:
        """Split an object after enough views that showed two objects in its place, with a gap between them."""
        c = self._config
        if len(views) == 1:
            instance.split_votes -= instance.split_votes > 0 and touches_both(
                views[0].points, instance.split_sides, self._reach_m
            )
            return
        sides = views[0].points, views[1].points
        if self._cosine({views[0].name: 1.0}, {views[1].name: 1.0}) < c.same_cosine:
            return
        if share_near(sides[0], cKDTree(sides[1]), c.split_gap_m) > 0:
            return
        instance.split_votes, instance.split_sides = instance.split_votes + 1, sides
        if instance.split_votes >= c.split_views:
            new = instance.split(self._next_id)
            self._next_id += 1
            self.instances[new.object_id] = new
            for part in (instance, new):
                self._spatial_index.update(part.object_id, part.box)
            self._seen_apart[frozenset((instance.object_id, new.object_id))] = c.split_views

    def apply_visibility(self, visibility: DepthVisibility) -> None:
        """Count what a depth image shows of the objects in view; call it before `add` of the same keyframe."""
        for object_id in self._visible_ids:
            if object_id in self.instances:
                self.instances[object_id].clear_visible()
        self._visible_ids = []
        for object_id in self._spatial_index.ids_near(visibility.box, 0.0):
            instance = self.instances[object_id]
            if visibility.box_in_view(instance.box):
                self._visible_ids.append(object_id)
                instance.apply_visibility(*visibility.classify(instance.points), visibility.config)
                self._spatial_index.update(object_id, instance.box)

    def retire_absent(self, views: int, frame_id: int) -> None:
        """Retire the objects that so many keyframes have seen through since they were last seen."""
        for object_id in [i for i, instance in self.instances.items() if instance.times_absent >= views]:
            self.retired[object_id] = RetiredInstance(self.instances[object_id], frame_id)
            self._remove(object_id, None)

    def move_submaps(self, moves: Mapping[int, F64], keyframe: int) -> None:
        """Follow submaps that have moved, and merge objects that now coincide, retired ones included."""
        for instance in self.instances.values():
            if instance.cloud.is_from_any(moves):
                instance.move_submaps(moves)
                self._spatial_index.update(instance.object_id, instance.box)
        for object_id, (instance, _) in list(self.retired.items()):
            if instance.cloud.is_from_any(moves):
                instance.move_submaps(moves)
                self._merge_retired(object_id)
        self.merge_duplicates(keyframe)

    def _merge_retired(self, object_id: int) -> None:
        """Merge a retired object with one that now lies in its place: it was only looked for in the wrong place."""
        instance = self.retired[object_id].instance
        self.instances[object_id] = instance
        if (duplicate_id := self._find_duplicate(object_id)) is None:
            del self.instances[object_id]
            return
        del self.retired[object_id]
        self._spatial_index.update(object_id, instance.box)
        self._merge(object_id, duplicate_id)

    def _merge(self, a: int, b: int) -> int:
        kept, merged = sorted((a, b))
        self.instances[kept].merge(self.instances[merged])
        self._spatial_index.update(kept, self.instances[kept].box)
        self._remove(merged, kept)
        return kept

    def merge_duplicates(self, keyframe: int) -> None:
        """Merge duplicates until none is left, then drop objects that one view alone showed long ago."""
        queue = [i for i, instance in self.instances.items() if self._checked_revisions.get(i) != instance.revision]
        while queue:
            object_id = queue.pop(0)
            if object_id not in self.instances:
                continue
            duplicate_id = self._find_duplicate(object_id)
            if duplicate_id is None:
                self._checked_revisions[object_id] = self.instances[object_id].revision
                continue
            # The merged object has grown and may now meet a third. Each round leaves one object fewer, so this ends.
            queue.append(self._merge(object_id, duplicate_id))
        for object_id in [i for i, instance in self.instances.items() if self._is_stale(instance, keyframe)]:
            self._remove(object_id, None)

    def _is_stale(self, instance: ObjectInstance, keyframe: int) -> bool:
        return instance.observations == 1 and keyframe - instance.last_keyframe >= self._config.prune_after

    def _remove(self, object_id: int, merged_into: int | None) -> None:
        del self.instances[object_id]
        self._checked_revisions.pop(object_id, None)
        self._spatial_index.remove(object_id)
        for pair in [pair for pair in self._seen_apart if object_id in pair]:
            views = self._seen_apart.pop(pair)
            if merged_into is not None and merged_into not in pair:
                self._seen_apart[pair - {object_id} | {merged_into}] += views

    def _find_match(self, observation: Observation, observed: dict[int, list[Observation]]) -> int | None:
        c = self._config
        best: tuple[float, int] | None = None
        for object_id in self._spatial_index.ids_near(observation.box, self._reach_m):
            instance = self.instances[object_id]
            if not boxes_within(observation.box, instance.box, self._reach_m):
                continue
            forward, backward = self._overlap_shares(observation.points, None, instance)
            cosine = self._cosine({observation.name: 1.0}, instance.votes)
            contained = containment(observation.box, instance.box, self._reach_m)
            larger = max(forward, backward)
            if cosine >= c.same_cosine:
                # a second mask of one view joins only what it lies in: two chairs of a view stay two
                is_second = object_id in observed
                fits = larger >= (2 * c.overlap if is_second else c.overlap)
                fits |= not is_second and contained >= c.box_inside and larger >= c.box_overlap
            else:
                fits = min(forward, backward) >= c.unlike_overlap
            score = larger + contained + cosine
            if fits and (best is None or score > best[0]):
                best = (score, object_id)
        return None if best is None else best[1]

    def _find_duplicate(self, object_id: int) -> int | None:
        c, instance = self._config, self.instances[object_id]
        best: tuple[float, int] | None = None
        reach_m = max(self._reach_m, c.sides_m)
        for candidate_id in self._spatial_index.ids_near(instance.box, reach_m):
            candidate = self.instances[candidate_id]
            if candidate_id == object_id or not boxes_within(instance.box, candidate.box, reach_m):
                continue
            forward, backward = self._overlap_shares(instance.points, instance.tree, candidate)
            cosine = self._cosine(instance.votes, candidate.votes)
            larger = max(forward, backward)
            seen_apart = self._seen_apart[frozenset((object_id, candidate_id))]
            fits = min(forward, backward) >= c.merge_unlike_overlap
            if cosine >= c.same_cosine and seen_apart < 2:
                contained = containment(instance.box, candidate.box, self._reach_m)
                fits |= larger >= c.merge_overlap or (contained >= c.box_inside and larger >= c.box_overlap)
                fits |= not seen_apart and self._are_two_sides(instance, candidate)
            if fits and (best is None or larger > best[0]):
                best = (larger, candidate_id)
        return None if best is None else best[1]

    def _are_two_sides(self, a: ObjectInstance, b: ObjectInstance) -> bool:
        """Whether two clouds lie along each other, as those of a thin object's two sides do."""
        c = self._config
        smaller, larger = sorted(share_near(x.points, y.tree, c.sides_m) for x, y in ((a, b), (b, a)))
        return larger >= c.sides_share and smaller >= c.overlap

    def _overlap_shares(self, points: F64, tree: cKDTree | None, instance: ObjectInstance) -> tuple[float, float]:
        """Share of points (N, 3) near the object's, and of the object's points near these."""
        forward = share_near(points, instance.tree, self._reach_m)
        if forward == 0:
            return 0.0, 0.0
        low, high = points.min(axis=0) - self._reach_m, points.max(axis=0) + self._reach_m
        candidates = instance.points[((instance.points >= low) & (instance.points <= high)).all(axis=1)]
        near = share_near(candidates, tree if tree is not None else cKDTree(points), self._reach_m)
        return forward, near * len(candidates) / len(instance.points)

    def _encode_names(self, names: Iterable[str]) -> None:
        new = [name for name in dict.fromkeys(names) if name not in self._name_vectors]
        self._name_vectors.update(zip(new, self._encode(new) if new else (), strict=True))

    def _cosine(self, a: dict[str, float], b: dict[str, float]) -> float:
        """Cosine of the vote-weighted mean embeddings of names; names without an embedding must be equal."""
        vector_a, vector_b = (
            sum((weight * self._name_vectors[name] for name, weight in votes.items()), np.zeros(1)) for votes in (a, b)
        )
        length = float(np.linalg.norm(vector_a) * np.linalg.norm(vector_b))
        if length == 0:
            return float(max(a, key=lambda name: (a[name], name)) == max(b, key=lambda name: (b[name], name)))
        return float(vector_a @ vector_b) / length

    def _count_seen_apart(self, object_ids: list[int]) -> None:
        reach_m = max(self._reach_m, self._config.sides_m)
        for a, b in combinations(object_ids, 2):
            if boxes_within(self.instances[a].box, self.instances[b].box, reach_m):
                self._seen_apart[frozenset((a, b))] += 1
