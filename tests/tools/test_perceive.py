"""The picture of what networks see. (contract)"""

from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.flat import Flat
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages import Segments, Tags
from placegraph.runtime.node import Context, build_node
from placegraph.tools.perceive import WIDTH_PX, draw, perceive, run_networks, sheet

FLOW = '[nodes.camera]\n\n[nodes.instances]\nmodel = "drawn_scene"\n'


def test_what_is_seen_is_colored_in_the_picture() -> None:
    frame = next(iter(Flat(Path(), {"width": 160, "height": 120}).frames()))
    node = build_node("instances", {"model": "drawn_scene"}, Context())
    node.start()
    seen = run_networks(frame, [node])
    segments = next(one for one in seen if isinstance(one, Segments))
    assert len(segments.names) > 0
    bare, drawn = draw(frame, []), draw(frame, seen)
    assert bare.shape == drawn.shape == (480 + len(bare) - 480, WIDTH_PX, 3)
    x0, y0, x1, y1 = (segments.boxes_px[0] * 4).tolist()
    changed = (bare != drawn).any(axis=2)
    assert changed[y0:y1, x0:x1].mean() > 0.2
    outside = np.ones(changed.shape, bool)
    for x0, y0, x1, y1 in (segments.boxes_px * 4).tolist():
        outside[max(y0 - 20, 0) : y1 + 3, max(x0 - 3, 0) : x1 + 200] = False
    assert not (changed & outside).any()


def test_tags_stand_below_the_picture() -> None:
    frame = next(iter(Flat(Path(), {"width": 160, "height": 120}).frames()))
    tags = Tags(frame_id=0, stamp_ns=0, names=("sofa",), scores=np.array([0.5], np.float32))
    assert (draw(frame, [tags])[:480] == draw(frame, [])[:480]).all()
    assert (draw(frame, [tags])[480:] != draw(frame, [])[480:]).any()


def test_pictures_of_unequal_height_make_one_sheet() -> None:
    black = [np.zeros((h, WIDTH_PX, 3), np.uint8) for h in (100, 120, 110, 90)]
    found = sheet(black)
    assert found.shape == (240, 3 * WIDTH_PX, 3) and (found[100:120, :WIDTH_PX] == 255).all()


def test_the_command_writes_a_picture_and_refuses_a_dataflow_without_networks(seven: Path, tmp_path: Path) -> None:
    config = tmp_path / "flow.toml"
    config.write_text(FLOW)
    perceive(config, seven, tmp_path / "seen.png", frames=2, of=4)
    assert cv2.imread(str(tmp_path / "seen.png")).shape[1] == 2 * WIDTH_PX
    config.write_text("[nodes.camera]\n")
    with pytest.raises(ConfigError, match="none of the nodes"):
        perceive(config, seven, tmp_path / "seen.png", frames=2, of=4)
