import pytest

from placegraph.runtime.errors import ConfigError
from placegraph.runtime.node import Context, build_node
from placegraph.runtime.renamed_settings import REMOVED_SETTINGS, RENAMED_SETTINGS
from placegraph.tools.graph import node_types


def nested(path: list[str], value: object) -> dict[str, object]:
    for key in reversed(path):
        value = {key: value}
    assert isinstance(value, dict)
    return value


@pytest.mark.parametrize("old", RENAMED_SETTINGS)
def test_a_renamed_setting_is_refused_with_its_new_name_which_exists(old: str) -> None:
    node, *path = old.split(".")
    new_node, *new_path = RENAMED_SETTINGS[old].split(".")
    with pytest.raises(ConfigError, match=rf"\[nodes.{node}\] .*: this setting is now called {'.'.join(new_path)}"):
        build_node(node, nested(path, 1), Context())
    settings = node_types()[new_node].config_type.model_construct().model_dump()
    for key in new_path:
        assert key in settings, RENAMED_SETTINGS[old]
        settings = settings[key]


@pytest.mark.parametrize("removed", REMOVED_SETTINGS)
def test_a_removed_setting_is_refused_with_the_reason(removed: str) -> None:
    node, *path = removed.split(".")
    with pytest.raises(ConfigError, match=rf"\[nodes.{node}\] .*: this setting was removed, delete it: .* bus"):
        build_node(node, nested(path, 1), Context())


def test_the_lists_are_in_order() -> None:
    assert list(RENAMED_SETTINGS) == sorted(RENAMED_SETTINGS)
    assert list(REMOVED_SETTINGS) == sorted(REMOVED_SETTINGS)
