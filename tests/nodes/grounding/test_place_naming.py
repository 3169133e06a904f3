import pytest

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.place_naming import LOCATION_TYPES, ROOM_TYPES, PlaceNamer, tag_counts
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.scene_graph import SceneGraph


def test_an_empty_room_gets_no_name_and_asks_nothing(node_of, thing_of):
    graph = SceneGraph.of([
        node_of("B0", "", "building", (0, 0, 0), (1, 1, 1)),
        node_of("F0", "B0", "floor 1", (0, 0, 0), (1, 1, 1)),
        node_of("R0", "F0", "", (0, 0, 0), (1, 1, 1)),
        node_of("R1", "F0", "", (0, 0, 0), (1, 1, 1)),
        thing_of(0, "R1", "", (0, 0, 0), (1, 1, 1)),
    ])  # fmt: skip
    model = LanguageModel()
    assert PlaceNamer(model, TextEncoder(), ROOM_TYPES, LOCATION_TYPES).name_places(graph) == []
    assert model.calls == 0


def test_tag_counts_are_of_strongest_tags_below_the_room_and_its_locations(house):
    assert tag_counts(house, house.nodes["R0"]) == (
        ("chair", 4),
        ("cup", 2),
        ("fridge", 1),
        ("table", 1),
        ("window", 1),
    )


@pytest.fixture(scope="module")
def namer():
    """The default types; a model that must not be needed."""

    class Unasked(LanguageModel):
        def log_probabilities(self, prefix, text, options):
            raise AssertionError(text)

    return PlaceNamer(Unasked(), TextEncoder(), ROOM_TYPES, LOCATION_TYPES)


@pytest.mark.parametrize(
    ("layer", "holds", "name"),
    [
        ("room", "sofa, tv, bookshelf", "living room"),
        ("room", "bed, wardrobe, desk, monitor, keyboard, window", "bedroom"),
        ("room", "desk, monitor, keyboard, bookshelf, armchair", "office"),
        ("room", "washing machine, toilet, sink, mirror", "bathroom"),
        ("room", "washing machine, sink, window", "laundry room"),
        ("room", "stove, sink, table, chair", "kitchen"),
        ("room", "table, chair, picture", "dining room"),
        ("room", "window, radiator, picture", "hallway"),  # nothing tells
        ("room", "window", "hallway"),
        ("location", "table, chair, cup", "dining area"),
        ("location", "sofa, armchair, rug", "sitting area"),
        ("location", "armchair, bookshelf, lamp", "reading area"),
        ("location", "sink, mirror", "washing area"),
    ],
)
def test_what_stands_there_names_a_place(namer, layer, holds, name):
    names = namer.names(layer, tuple((tag, 1) for tag in sorted(holds.split(", "))))
    assert names[0][0] == name
    assert len(names) == 3 and sum(weight for _, weight in names) == pytest.approx(1)
    assert names[0][1] >= names[1][1] >= names[2][1]


def test_many_of_one_kind_do_not_outweigh_what_is_decisive(namer):
    one, many = (namer.names("room", (("bed", 1), ("cup", count), ("nightstand", 1), ("table", 1))) for count in (1, 9))
    assert one == many
    assert one[0][0] == "bedroom"


def test_the_model_is_asked_for_what_the_table_does_not_hold():
    model = LanguageModel()
    namer = PlaceNamer(model, TextEncoder(), ("kitchen", "bedroom", "sauna"), LOCATION_TYPES)
    first = namer.names("room", (("bed", 1), ("lamp", 2)))
    asked = model.calls
    assert asked > 0
    assert namer.names("room", (("bed", 1), ("lamp", 2))) == first
    assert model.calls == asked
    assert first[0][0] == "bedroom"
    model.close()
