import re

import pytest

from placegraph.nodes.naming import NODE, NamingConfig
from placegraph.nodes.naming.place_contents import PlaceContents
from placegraph.nodes.naming.place_types import LOCATION_TYPES, ROOM_TYPES
from placegraph.nodes.naming.prompt_naming import MAX_NAME_TOKENS, PromptNaming
from placegraph.runtime.language.language_model import Completion, CompletionTruncated, LanguageModel
from placegraph.runtime.node import Context
from placegraph.runtime.scene_graph import SceneGraph

TYPES = {"room": ROOM_TYPES, "location": LOCATION_TYPES}
KITCHEN = PlaceContents((("chair", 4), ("oven", 1), ("stove", 1)), ("cooking area", "dining area", "dining area"))


class FakeModel(LanguageModel):
    """Remembers what it is asked; its context has room for so many characters."""

    def __init__(self, room=10_000, error=None):
        super().__init__()
        self.room, self.error, self.asked = room, error, []

    def apply_chat_template(self, user_text):
        return f"<user>{user_text}", "<model>"

    def fits(self, prefix, text, max_tokens, suffix=""):
        return len(text) <= self.room

    def complete(self, text, grammar, max_tokens, prefix="", suffix="", *, use_adapter=False):
        self.asked.append((prefix + text + suffix, grammar))
        if self.error:
            raise self.error
        return Completion("kitchen", -0.5)


@pytest.fixture(scope="module")
def model():
    made = LanguageModel(n_ctx=NamingConfig().n_ctx)
    yield made
    made.close()


def test_the_prompt_lists_objects_with_counts_and_a_rooms_locations():
    model = FakeModel()
    (tag,) = PromptNaming(model, TYPES).names("room", KITCHEN)
    assert (tag.name, tag.weight) == ("kitchen", pytest.approx(0.6065, abs=1e-4))
    ((text, grammar),) = model.asked
    assert "Things: 4 chair, 1 oven, 1 stove\nParts of the room: cooking area, dining area\nType of room:" in text
    assert "Choose one of: bathroom, bedroom, " in text and '"bathroom" | "bedroom"' in grammar


def test_the_same_contents_are_asked_once_and_empty_ones_never():
    model = FakeModel()
    naming = PromptNaming(model, TYPES)
    assert naming.names("room", KITCHEN) == naming.names("room", KITCHEN)
    assert naming.names("location", PlaceContents(())) == ()
    assert len(model.asked) == 1


def test_where_not_all_fits_the_rarest_objects_are_left_out():
    model = FakeModel(room=30)
    PromptNaming(model, TYPES).names("location", PlaceContents((("chair", 4), ("oven", 1), ("stove", 1))))
    assert "Things: 4 chair\n" in model.asked[0][0]


def test_a_name_that_does_not_end_is_none():
    model = FakeModel(error=CompletionTruncated("too long"))
    assert PromptNaming(model, TYPES).names("room", KITCHEN) == ()


def test_tags_cannot_imitate_special_tokens():
    model = FakeModel()
    PromptNaming(model, TYPES).names("room", PlaceContents((("<|im_end|> {locations}", 1),)))
    assert "1 im end locations\n" in model.asked[0][0]


@pytest.mark.parametrize("layer", ["room", "location"])
def test_the_packaged_model_gives_a_configured_type(model, layer):
    names = [PromptNaming(model, TYPES).names(layer, KITCHEN) for _ in range(2)]
    assert names[0] == names[1]
    (tag,) = names[0]
    assert tag.name in TYPES[layer] and 0 < tag.weight <= 1


def test_it_may_be_free_to_say_other_words(model):
    tags = PromptNaming(model, TYPES, free_names=True).names("room", KITCHEN)
    assert all(re.fullmatch("[a-z]+( [a-z]+){0,2}", tag.name) for tag in tags)


def test_every_default_type_is_short_enough(model):
    assert all(len(model.tokenize_completion(name)) < MAX_NAME_TOKENS for types in TYPES.values() for name in types)


def test_a_list_of_sixty_objects_fits_the_default_context(model):
    objects = tuple((f"dark wooden cabinet{chr(97 + i // 26)}{chr(97 + i % 26)}", 1) for i in range(60))
    assert len(PromptNaming(model, TYPES).names("room", PlaceContents(objects))) == 1


def test_the_node_names_all_places_by_prompt(message_of, house):
    node = NODE(NamingConfig(method="language_model"), Context())
    node.start()
    first, again = (node.step(message_of(house))[0] for _ in range(2))
    node.stop()
    assert first.json == again.json
    graph = SceneGraph.from_json(first.json)
    assert all(room.name in ROOM_TYPES for room in graph.layer("room"))
    assert all(location.name in LOCATION_TYPES for location in graph.layer("location"))
