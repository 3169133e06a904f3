import pytest

from placegraph.nodes.grounding import NODE, GroundingConfig
from placegraph.nodes.grounding.settings import DEFAULTS, GroundingSettings
from placegraph.runtime.node import Context


def test_every_setting_is_a_positive_number():
    for theme, fields in DEFAULTS.model_dump().items():
        for name, value in fields.items():
            assert isinstance(value, float) and value > 0, (theme, name)


def test_settings_of_a_configuration_reach_the_relations(house, graph_message, ask):
    def near_score(half_near_m):
        settings = GroundingSettings.model_validate({"nearness": {"half_near_m": half_near_m}})
        node = NODE(GroundingConfig(use_model=False, settings=settings), Context())
        node.step(graph_message(house))
        return ask(node, "the vase near the sofa")["candidates"][0]["score"]

    assert near_score(0.5) < near_score(3.0)


def test_an_unknown_setting_is_refused():
    with pytest.raises(ValueError, match="near_cm"):
        GroundingSettings.model_validate({"nearness": {"near_cm": 3.0}})
