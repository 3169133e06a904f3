"""Requests by other things, without a viewer: on, under, above, below, next to, near, closest, between, several."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.runtime.arrays import Bool
from placegraph.tools.simulator.asking.names import Mention, Naming
from placegraph.tools.simulator.asking.relations import NO, YES, Answers, between, closest, farthest, only
from placegraph.tools.simulator.asking.request import Request, unique_mentions
from placegraph.tools.simulator.asking.scene import Scene
from placegraph.tools.simulator.asking.scopes import Scope

SAID: dict[str, str] = {
    "on": "on the {}", "under": "under the {}", "above": "above the {}", "below": "below the {}",
    "next to": "next to the {}", "near": "near the {}", "closest": "closest to the {}",
    "farthest": "farthest from the {}", "between": "between the {} and the {}",
}  # fmt: skip
MEANT: dict[str, str] = {
    "on": "on ({})", "under": "under ({})", "above": "above ({})", "below": "under ({})", "next to": "near ({})",
    "near": "near ({})", "closest": "closest ({})", "farthest": "farthest ({})", "between": "between ({}, {})",
}  # fmt: skip
LONGEST_M = 4.5  # between two anchors
SMALL = 0.3  # share of a target's longest extent that an anchor needs at least, or it is too small to tell it by


def relation_requests(scene: Scene, scope: Scope, answers: dict[str, Answers]) -> Iterator[Request]:
    """Requests by one anchor: on, under, above, below, next to, near, closest, farthest."""
    for anchor in unique_mentions(scene, scope):
        for form, table in answers.items():
            column = table[:, anchor.id]
            for target in _targets(scene, scope, anchor, column == YES):
                peers = scene.of(target.naming.kin) & scope.mask
                if only(column, peers) == target.id:
                    yield _request(scene, form, target, scope, (anchor,))
        yield from _by_distance(scene, scope, anchor)


def _targets(scene: Scene, scope: Scope, anchor: Mention, fit: Bool) -> Iterator[Mention]:
    """Items that may be asked for by an anchor, under all their words for which there is another in the house."""
    longest = scene.size.max(axis=1)
    fit = fit & scene.askable & scope.mask & (longest[anchor.id] >= SMALL * longest)
    for one in np.flatnonzero(fit).tolist():
        for naming in scene.namings[one]:
            if one != anchor.id and np.count_nonzero(scene.of(naming.kin)) > 1:
                yield Mention(one, naming)


def _request(scene: Scene, form: str, target: Mention, scope: Scope, anchors: tuple[Mention, ...]) -> Request:
    needed = scene.has_twin(target.id, scope.mask)
    return Request(form, target, scope, "", (SAID[form],), (MEANT[form],), anchors, None, needed)


def _by_distance(scene: Scene, scope: Scope, anchor: Mention) -> Iterator[Request]:
    """The closest of a scope to an anchor, and the farthest of a room; not where they touch."""
    done: set[frozenset[str]] = set()
    for target in _targets(scene, scope, anchor, scene.same_room[:, anchor.id]):
        if target.naming.kin in done:
            continue  # one search finds the winner of all that share a word
        done.add(target.naming.kin)
        peers = scene.of(target.naming.kin) & scope.mask
        peers[anchor.id] = False
        for form, winner in (
            ("closest", closest(scene, anchor.id, peers)),
            ("farthest", farthest(scene, anchor.id, peers) if scope.kind == "room" else None),
        ):
            if winner is None or not _may_be_told(scene, winner, anchor.id):
                continue
            for naming in scene.namings[winner]:
                if naming.kin == target.naming.kin:
                    yield _request(scene, form, Mention(winner, naming), scope, (anchor,))


def _may_be_told(scene: Scene, one: int, anchor: int) -> bool:
    """Whether an item may be asked for by its distance to another: they are in a room and do not carry each other."""
    carried = scene.support[one] == anchor or scene.support[anchor] == one
    return bool(scene.askable[one] and scene.same_room[one, anchor] and not carried)


def between_requests(scene: Scene, scope: Scope) -> Iterator[Request]:
    """Requests by two anchors of one room that the target lies between."""
    anchors = unique_mentions(scene, scope)
    for k, first in enumerate(anchors):
        for second in anchors[k + 1 :]:
            apart = first.id != second.id and scene.same_room[first.id, second.id]
            if not apart or scene.distance[first.id, second.id] > LONGEST_M:
                continue
            answers = between(scene, first.id, second.id)
            for target in _targets(scene, scope, first, answers == YES):
                if only(answers, scene.of(target.naming.kin) & scope.mask) == target.id:
                    yield _request(scene, "between", target, scope, (first, second))


def double_requests(
    scene: Scene, scope: Scope, answers: dict[str, Answers], random: np.random.Generator
) -> Iterator[Request]:
    """Requests by two relations of the target: the lamp next to the bed and near the window."""
    anchors = unique_mentions(scene, scope)
    for first in anchors:
        for second in anchors:
            if scene.names[first.id] == scene.names[second.id] or not scene.same_room[first.id, second.id]:
                continue
            form, other = [("on", "near"), ("next to", "near"), ("above", "near"), ("near", "next to")][
                random.integers(4)
            ]
            joint = np.minimum(answers[form][:, first.id], answers[other][:, second.id])
            for target in _targets(scene, scope, first, joint == YES):
                peers = scene.of(target.naming.kin) & scope.mask
                if target.id != second.id and scene.has_twin(target.id, scope.mask) and only(joint, peers) == target.id:
                    joiner = " and " if form != "on" else " "
                    tail = joiner.join((SAID[form], SAID[other]))
                    yield Request(
                        "two anchors", target, scope, "", (tail,), (MEANT[form], MEANT[other]), (first, second)
                    )


def chain_requests(scene: Scene, scope: Scope, answers: dict[str, Answers]) -> Iterator[Request]:
    """Requests by an anchor that is told by another: the book on the nightstand next to the bed."""
    for last in unique_mentions(scene, scope):
        for link in ("next to", "near", "below"):
            linked = answers[link][:, last.id]
            for middle in np.flatnonzero(scene.anchors & scope.mask & (linked == YES)).tolist():
                for naming in scene.namings[middle]:
                    group = scene.of(naming.kin) & scope.mask
                    if np.count_nonzero(group) > 1 and only(linked, group) == middle:
                        yield from _chained(scene, scope, answers, Mention(middle, naming), last, link)


def _chained(
    scene: Scene, scope: Scope, answers: dict[str, Answers], middle: Mention, last: Mention, link: str
) -> Iterator[Request]:
    for form in ("on", "next to", "above"):
        column = answers[form][:, middle.id]
        for target in _targets(scene, scope, middle, column == YES):
            peers = scene.of(target.naming.kin) & scope.mask
            if target.id == last.id or not scene.has_twin(target.id, scope.mask) or only(column, peers) != target.id:
                continue
            if _is_read_one_way(scene, answers, target, middle.naming, peers, form, last, link):
                tail = f"{SAID[form]} {SAID[link]}"
                means = MEANT[form].replace("{}", "{{}}; {}").format(MEANT[link])
                yield Request("chain", target, scope, "", (tail,), (means,), (middle, last))


def _is_read_one_way(
    scene: Scene,
    answers: dict[str, Answers],
    target: Mention,
    middle: Naming,
    peers: Bool,
    form: str,
    last: Mention,
    link: str,
) -> bool:
    """Whether no other item fits when the second relation is taken for the target's own, not for its anchor's."""
    group = scene.of(middle.kin)
    at_some = answers[form][:, group].max(axis=1)
    other = np.minimum(at_some, answers[link][:, last.id]) > NO
    other[target.id] = False
    return not (other & peers).any()
