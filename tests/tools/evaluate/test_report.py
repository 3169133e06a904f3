import math

import pytest

from placegraph.tools.evaluate.report import COLUMNS, map_text, maps_text, means, number, plain, table

NAN = float("nan")


def test_means_are_of_the_maps_that_have_the_number() -> None:
    rows = [{"rooms": {"f1": 0.5}, "ate_share": 0.01}, {"rooms": {"f1": NAN}}, {"rooms": {"f1": 1.0}}]
    found = means(rows)
    assert list(found) == [head for head, *_ in COLUMNS]
    assert found["room F1"] == 0.75 and found["ATE %"] == pytest.approx(1) and math.isnan(found["obj P"])
    assert all(math.isnan(value) for value in means([]).values())


def test_a_table_has_the_columns_that_some_map_has() -> None:
    rows = {"a": {"rooms": {"f1": 0.5}}, "b": {"rooms": {"f1": NAN, "precision": 0.25}}}
    text = maps_text(rows, {"mean": means(list(rows.values()))})
    assert [line.split() for line in text.splitlines()] == [
        ["map", "room", "P", "room", "F1"], ["a", "-", "0.500"], ["b", "0.25", "-"], ["mean", "0.25", "0.500"],
    ]  # fmt: skip


def test_a_trajectory_alone_says_nothing_of_layers() -> None:
    scores = {"ate_rmse_m": 0.1, "ate_max_m": 0.2, "poses": 9, "path_m": 5.0, "ate_share": 0.02}
    text = map_text(scores | {"rpe_m": NAN, "rpe_deg": NAN}, per_class=True)
    assert text == (
        "ATE rmse 0.1 m, max 0.2 m, over 9 poses and 5.0 m of path: 2.00 % of it; RPE over 1 m of path - m, - degrees"
    )


def test_an_undefined_number_is_a_dash_and_null() -> None:
    assert (number(float("nan")), number(0.12345), number(2, 0)) == ("-", "0.123", "2")
    assert plain({"a": float("nan"), "b": {"c": 0.123456}, "d": 3, "e": True}) == {
        "a": None, "b": {"c": 0.1235}, "d": 3, "e": True,
    }  # fmt: skip
    assert table([("a", "bb"), ("ccc", "d")]) == "a    bb\nccc   d"
