from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from placegraph.nodes.camera.synthetic import DEPTH_UNIT_M, SOURCE, Synthetic
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.vision import geometry

SMALL = {"width": 64, "height": 48, "floors": 1, "seed": 5}


def made(**settings: Any) -> Synthetic:
    return SOURCE(Path(), {**SMALL, **settings})


def first(source: Synthetic, count: int) -> list[Any]:
    return [frame for frame, _ in zip(source.frames(), range(count), strict=False)]


@pytest.mark.parametrize(
    "settings", [{"width": 0}, {"height": 8}, {"seed": -1}, {"floors": 0}, {"floors": 4}, {"seed": 1.5}, {"rooms": 3}]
)
def test_wrong_settings(settings: dict[str, object]):
    with pytest.raises(ConfigError, match=next(iter(settings))):
        SOURCE(Path(), settings)


def test_matches_nothing(tmp_path: Path):
    assert not SOURCE.matches(tmp_path)
    assert not SOURCE.matches(Path())


def test_a_missing_library_names_the_extra():
    # a process of its own: here the generator may be imported already
    code = (
        "import sys; sys.modules['embreex'] = None\n"
        "from pathlib import Path\n"
        "from placegraph.nodes.camera.synthetic import SOURCE\n"
        "SOURCE(Path(), {})\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    last = done.stderr.splitlines()[-1]
    assert "ConfigError" in last and "'embreex'" in last and "placegraph[demo]" in last, done.stderr


def test_frames_are_whole_and_level():
    source = made()
    frames = first(source, 3)
    assert [frame.frame_id for frame in frames] == [0, 1, 2]
    given = source.given_poses()
    for frame in frames:
        frame.check()
        assert frame.depth_unit_m == DEPTH_UNIT_M
        assert geometry.is_rigid(frame.given_world_from_camera)
        assert np.array_equal(given[frame.stamp_ns], frame.given_world_from_camera)
        assert frame.given_world_from_camera[:3, :3] @ frame.up_camera == pytest.approx([0, 0, 1])
        assert (frame.depth > 0).mean() > 0.5
    stamps = list(given)
    assert stamps == sorted(set(stamps))


def test_equal_settings_give_equal_bytes_and_other_seeds_do_not():
    one, again, other = (first(made(seed=seed), 1)[0] for seed in (5, 5, 6))
    assert one.color.tobytes() == again.color.tobytes() and one.depth.tobytes() == again.depth.tobytes()
    assert one.color.tobytes() != other.color.tobytes()
