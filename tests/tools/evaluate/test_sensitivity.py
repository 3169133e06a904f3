from placegraph.nodes.grounding.settings import DEFAULTS
from placegraph.tools.evaluate import sensitivity as module
from placegraph.tools.evaluate.grounding_variants import VariantRunner, house_scene
from placegraph.tools.evaluate.sensitivity import cases_of, sensitivity


def test_nothing_asked_changes_nothing():
    assert cases_of([], VariantRunner()) == []


def test_each_setting_is_perturbed_both_ways(monkeypatch):
    runner = VariantRunner()
    cases = cases_of([house_scene(100, 4)], runner)
    monkeypatch.setattr(
        module, "_numbers", lambda _: iter([("names", "same_words_fit", 1.0), ("nearness", "half_near_m", 1.5)])
    )
    right, rows = sensitivity(cases, runner.names)
    assert 0 < right <= 1 and [row.name for row in rows] == ["names.same_words_fit", "nearness.half_near_m"]
    assert all(len(row.changed) == len(row.right) == 2 for row in rows)
    assert DEFAULTS.nearness.half_near_m == 1.5
