import threading

import pytest

from placegraph.runtime.bus.flow_control import CreditWindow, Envelope, Inbox
from placegraph.runtime.messages import Frame, Pose


def test_empty_inbox_gives_none_in_time() -> None:
    inbox = Inbox({})
    assert inbox.get(0.01) is None
    assert len(inbox) == 0 and not inbox.drained


def test_arrival_order_across_kinds() -> None:
    inbox = Inbox({})
    for sequence, kind in enumerate((Frame, Pose, Frame)):
        inbox.put(Envelope(kind, sequence, b""))
    assert [p.sequence for _ in range(3) if (p := inbox.get(0)) is not None] == [0, 1, 2]


def test_newest_wins_only_where_a_limit_says_so_and_drops_are_counted() -> None:
    inbox = Inbox({Frame: 2})
    for sequence in range(5):
        inbox.put(Envelope(Frame, sequence, b""))
        inbox.put(Envelope(Pose, sequence, b""))
    got = [p for _ in range(7) if (p := inbox.get(0)) is not None]
    assert [p.sequence for p in got if p.kind is Frame] == [3, 4]
    assert [p.sequence for p in got if p.kind is Pose] == [0, 1, 2, 3, 4]
    assert inbox.drops == {Frame: 3}


def test_closing_gives_what_is_left_and_then_nothing() -> None:
    inbox = Inbox({})
    inbox.put(Envelope(Frame, 1, b""))
    inbox.close()
    assert not inbox.drained
    assert inbox.get(10) is not None
    assert inbox.get(10) is None and inbox.drained


def test_window_without_consumers_never_waits() -> None:
    window = CreditWindow(1, [])
    assert [window.reserve(0) for _ in range(5)] == [1, 2, 3, 4, 5]


def test_window_waits_for_the_slowest_consumer() -> None:
    window = CreditWindow(2, ["a", "b"])
    assert window.reserve(0) == 1 and window.reserve(0) == 2
    assert window.reserve(0.01) is None
    window.confirm("a", 2)
    assert window.reserve(0.01) is None
    window.confirm("b", 1)
    assert window.reserve(0) == 3
    window.confirm("stranger", 99)
    assert window.reserve(0.01) is None


def test_receipt_wakes_a_waiting_producer() -> None:
    window = CreditWindow(1, ["a"])
    window.reserve(0)
    threading.Timer(0.05, lambda: window.confirm("a", 1)).start()
    assert window.reserve(5) == 2


def test_a_dead_consumer_bounds_the_producer_until_it_is_back_and_what_it_missed_is_confirmed() -> None:
    window = CreditWindow(2, ["a", "b"])
    window.reserve(0)
    window.set_present("a", False)
    assert window.reserve(0) == 2
    window.confirm("b", 2)
    assert window.reserve(0.01) is None
    window.set_present("a", True)
    assert [window.reserve(0) for _ in range(3)] == [3, 4, None]
    window.set_present("stranger", False)


def test_at_the_end_of_a_run_a_dead_consumer_is_not_waited_for() -> None:
    window = CreditWindow(1, ["a", "b"])
    window.reserve(0)
    window.set_present("a", False)
    window.ignore_absent()
    assert window.reserve(0.01) is None
    window.confirm("b", 1)
    assert window.reserve(0) == 2


@pytest.mark.parametrize("late", [1, 2])
def test_old_receipts_change_nothing(late: int) -> None:
    window = CreditWindow(1, ["a"])
    for sequence in (1, 2, 3):
        assert window.reserve(0) == sequence
        window.confirm("a", sequence)
    window.confirm("a", late)
    assert window.reserve(0) == 4
