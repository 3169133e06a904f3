import pytest

from placegraph.nodes.naming.evidence_naming import EvidenceNaming
from placegraph.nodes.naming.place_contents import PlaceContents
from placegraph.nodes.naming.place_types import LOCATION_TYPES, ROOM_TYPES
from placegraph.runtime.language.language_model import LanguageModel

DEFAULT_TYPES = {"room": ROOM_TYPES, "location": LOCATION_TYPES}


@pytest.fixture(scope="module")
def naming():
    """The default types; a model that must not be needed."""

    class Unasked(LanguageModel):
        def log_probabilities(self, prefix, text, options):
            raise AssertionError(text)

    return EvidenceNaming(Unasked(), DEFAULT_TYPES)


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
def test_what_stands_there_names_a_place(naming, layer, holds, name):
    names = naming.names(layer, PlaceContents(tuple((tag, 1) for tag in sorted(holds.split(", ")))))
    assert names[0].name == name
    assert len(names) == 3 and sum(tag.weight for tag in names) == pytest.approx(1)
    assert names[0].weight >= names[1].weight >= names[2].weight


def test_many_of_one_kind_do_not_outweigh_what_is_decisive(naming):
    one_cup, many_cups = (
        naming.names("room", PlaceContents((("bed", 1), ("cup", count), ("nightstand", 1), ("table", 1))))
        for count in (1, 9)
    )
    assert one_cup == many_cups
    assert one_cup[0].name == "bedroom"


def test_a_place_without_a_named_object_gets_no_name_and_asks_nothing(naming):
    assert naming.names("room", PlaceContents(())) == ()


def test_the_model_is_asked_for_what_the_table_does_not_hold():
    model = LanguageModel()
    naming = EvidenceNaming(model, DEFAULT_TYPES | {"room": ("kitchen", "bedroom", "sauna")})
    first = naming.names("room", PlaceContents((("bed", 1), ("lamp", 2))))
    asked = model.calls
    assert asked > 0
    assert naming.names("room", PlaceContents((("bed", 1), ("lamp", 2)))) == first
    assert model.calls == asked
    assert first[0].name == "bedroom"
    model.close()
