"""Every design: centred, on its lowest point, closed faces outward, honours sizes, repeats for a seed. (contract)"""

import numpy as np
import pytest

from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.catalogue import design, designs
from placegraph.tools.simulator.house_model import TEXTURES
from placegraph.tools.simulator.object_classes import NAMES


def test_there_is_a_design_for_each_class_and_nothing_else() -> None:
    assert set(designs()) == set(NAMES)


def test_an_unknown_class_is_refused() -> None:
    with pytest.raises(ConfigError, match="spaceship"):
        design("spaceship", np.random.default_rng(0))


@pytest.mark.parametrize("name", sorted(designs()))
def test_an_item_is_well_formed(name: str) -> None:
    for seed in range(6):
        item = design(name, np.random.default_rng(seed))
        low, high = item.extent
        assert item.name == name
        assert np.abs(low + high)[:2].max() < 0.02, "footprint centred"
        assert abs(low[2]) < 1e-6
        assert ((high - low) > 0.002).all() and (high - low).max() < 8
        for part in item.parts:
            assert part.material.texture in TEXTURES
            assert part.faces.min() >= 0 and part.faces.max() < len(part.vertices)
            assert np.isfinite(part.vertices).all()
        assert sum(len(part.faces) for part in item.parts) <= 1500
        for s in item.surfaces:
            assert low[0] - 1e-6 <= s.x0 < s.x1 <= high[0] + 1e-6 and low[1] - 1e-6 <= s.y0 < s.y1 <= high[1] + 1e-6
            assert 0 < s.z <= high[2] + 1e-6 and s.clearance_m > 0


@pytest.mark.parametrize("name", sorted(designs()))
def test_equal_seeds_give_equal_items_and_others_differ(name: str) -> None:
    first, again, other = (design(name, np.random.default_rng(seed)) for seed in (3, 3, 4))
    assert [p.vertices.tobytes() for p in first.parts] == [p.vertices.tobytes() for p in again.parts]
    assert [p.material for p in first.parts] == [p.material for p in again.parts]
    assert [p.vertices.tobytes() for p in first.parts] != [p.vertices.tobytes() for p in other.parts]


@pytest.mark.parametrize("name", sorted(designs()))
def test_given_sizes_are_honored(name: str) -> None:
    low, high = design(name, np.random.default_rng(7)).extent
    want = (high - low) * 1.1
    item = design(name, np.random.default_rng(8), width_m=want[0], depth_m=want[1], height_m=want[2])
    np.testing.assert_allclose(item.extent[1] - item.extent[0], want, atol=0.02)
