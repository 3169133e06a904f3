import json

import numpy as np
import pytest

from placegraph.nodes.grounding.program import Program
from placegraph.nodes.grounding.program_syntax import format_program, parse_program
from placegraph.runtime.errors import ConfigError
from placegraph.tools.evaluate.grounding_command import variant_scores
from placegraph.tools.evaluate.grounding_variants import (
    VARIANTS,
    VariantRunner,
    chosen_variants,
    house_scene,
    without_hierarchy,
    without_places,
    without_relations,
)


@pytest.fixture(scope="module")
def scene():
    return house_scene(9100, 6)


def program(text):
    return Program(target=parse_program(text))


def test_parts_are_taken_from_a_program() -> None:
    whole = program("lamp; is red; on (table; near (door)); leftmost; room (kitchen); floor (upstairs)")
    assert format_program(without_relations(whole).target) == "lamp; room (kitchen); floor (upstairs)"
    assert format_program(without_places(whole).target) == "lamp; is red; on (table; near (door)); leftmost"


def test_a_flat_graph_has_the_same_objects_in_one_room(scene) -> None:
    flat = without_hierarchy(scene.graph)
    assert [node.id for node in flat.layer("object")] == [node.id for node in scene.graph.layer("object")]
    assert {flat.room_of(node.id) for node in flat.layer("object")} == {"R0"} and len(flat.layer("room")) == 1


def test_the_true_program_gives_the_right_object_and_its_box(scene) -> None:
    runner = VariantRunner()
    replies = [runner.ask("oracle", scene, asked) for asked in scene.questions]
    scores = variant_scores([scene], [replies])
    assert scores["all"]["questions"] == 6
    right = np.mean([reply.object_id == f"O{one.target}" for reply, one in zip(replies, scene.questions, strict=True)])
    assert scores["all"]["exact"] == pytest.approx(right) and right > 0.5
    assert scores["all"]["acc_0.75"] >= right and scores["all"]["calls"] == 0


def test_each_variant_answers(scene) -> None:
    runner = VariantRunner()
    for variant in VARIANTS:
        reply = runner.ask(variant, scene, scene.questions[0])
        assert reply.status in ("found", "not_in_map"), variant
        assert (reply.calls > 0) == (variant not in ("oracle", "rules")), variant
    runner.model.close()


def test_wrong_arguments_are_named(cli) -> None:
    with pytest.raises(ConfigError, match="magic"):
        chosen_variants("program,magic")
    assert cli("evaluate", "grounding").code == 2
    assert cli("evaluate", "grounding", "--houses", "9-2").code == 2
    assert cli("evaluate", "grounding", "--houses", "x").code == 2
    assert cli("evaluate", "grounding", "some-map").code == 2


def test_the_command_prints_a_table_or_json(cli) -> None:
    asked = ("evaluate", "grounding", "--houses", "9100", "--count", 3, "--variants", "oracle,rules")
    assert "exact id" in cli(*asked, "--forms").out
    assert set(json.loads(cli(*asked, "--json").out)) == {"oracle", "rules"}
