import numpy as np
import pytest

from placegraph.nodes.hierarchy.memo import Memo, digest


def test_made_once_while_it_is_asked_for_and_forgotten_after_a_build_without_it():
    made: list[str] = []
    known: Memo[str] = Memo()

    def ask(name):
        return known.get(name.encode(), lambda: made.append(name) or f"{name}{len(made)}")

    assert [ask("a"), ask("a")] == ["a1", "a1"]
    known.end_build()
    assert [ask("a"), ask("b")] == ["a1", "b2"]
    known.end_build()
    assert ask("b") == "b2"
    known.end_build()
    assert ask("a") == "a3"


A = np.arange(6, dtype=np.float32)


@pytest.mark.parametrize(
    "other",
    [
        (A.reshape(2, 3),),
        (A.astype(np.float64),),
        (A[:3], A[3:]),
        (A[::-1],),
        (A + np.float32(1e-6),),
        (A.tobytes(),),
        (),
    ],
)
def test_digests_differ_where_anything_differs(other):
    assert digest(*other) != digest(A)


def test_digests_are_equal_for_equal_values_however_they_lie_in_memory():
    wide = np.zeros((6, 2), np.float32)
    wide[:, 0] = A
    assert digest(wide[:, 0], 0.5) == digest(A, 0.5) and digest(np.zeros((0, 3))) == digest(np.zeros((0, 3)))
