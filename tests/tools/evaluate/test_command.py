import pytest


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((), "either --source or --against must say"),
        (("--source", "S", "--against", "A"), "either --source or --against must say"),
        (("--source", "S", "--source", "S"), "1 maps and 2 --source"),
        (("MAP", "--source", "S", "--source", "S"), "a map is named twice"),
        (("--against", "A", "--questions"), "--questions needs a house with its truth as --source"),
        (("--against", "A", "--progress"), "--progress needs a house"),
        (("--against", "A", "--write-truth", "F"), "--write-truth needs a house"),
        (("--source", "S", "--progress", "--per-class"), "--per-class goes with one map"),
    ],
)
def test_options_that_do_not_fit_are_refused(cli, arguments, reason, tmp_path) -> None:
    done = cli("evaluate", "map", "MAP", *arguments)
    assert done.code == 2 and reason in done.reason
