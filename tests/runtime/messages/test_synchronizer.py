import itertools

import numpy as np

from placegraph.runtime.messages import LastKeyframe, Message, Tags
from placegraph.runtime.messages.synchronizer import FrameSynchronizer


def tags(i: int) -> Tags:
    return Tags(frame_id=i, stamp_ns=0, names=(), scores=np.zeros(0, np.float32))


def last(i: int) -> LastKeyframe:
    return LastKeyframe(frame_id=i, stamp_ns=0, keyframes=0)


def test_nothing_until_complete() -> None:
    join = FrameSynchronizer(Tags, LastKeyframe)
    assert join.add(tags(0)) is None
    assert join.add(last(1)) is None
    assert len(join) == 2
    found = join.add(last(0))
    assert found is not None and [type(x) for x in found] == [Tags, LastKeyframe]


def test_output_does_not_depend_on_how_inputs_interleave() -> None:
    results = set()
    for places in itertools.combinations(range(6), 3):  # where the three Tags stand among six messages, each in order
        a, b = iter([tags(i) for i in range(3)]), iter([last(i) for i in range(3)])
        inputs: list[Message] = [next(a) if i in places else next(b) for i in range(6)]
        join = FrameSynchronizer(Tags, LastKeyframe)
        results.add(tuple(found[0].frame_id for x in inputs if (found := join.add(x)) is not None))
        assert len(join) == 0
    assert results == {(0, 1, 2)}


def test_what_was_lost_is_forgotten_when_a_later_frame_completes() -> None:
    join = FrameSynchronizer(Tags, LastKeyframe)
    join.add(tags(0))
    join.add(tags(1))
    assert join.add(last(1)) is not None
    assert len(join) == 0


def test_old_incomplete_sets_can_be_forgotten() -> None:
    join = FrameSynchronizer(Tags, LastKeyframe)
    for i in range(3):
        join.add(LastKeyframe(frame_id=i, stamp_ns=10 * i, keyframes=0))
    join.forget_before(10)
    assert len(join) == 2
    assert join.add(tags(0)) is None and join.add(tags(1)) is not None
