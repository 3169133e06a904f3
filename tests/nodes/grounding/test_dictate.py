import re
from importlib import resources

import pytest

from placegraph.nodes.grounding.dictate import (
    MOST_CONDITIONS,
    MOST_LETTERS,
    MOST_PLACES,
    MOST_THINGS,
    REPLY_TOKENS,
    Offer,
    dictated,
    offered,
    program_grammar,
    read_program,
)
from placegraph.nodes.grounding.llm import LanguageModel
from placegraph.nodes.grounding.program import Thing
from placegraph.runtime.errors import QueryError
from placegraph.runtime.scene_graph import SceneGraph

EMPTY = '{"target": "anything", "conditions": [{"relation": "none"}], "room": "none", "floor": "none"}'


@pytest.fixture
def bare(node_of):
    """A map with nothing in it."""
    return SceneGraph.of([node_of("B0", "", "building", (0, 0, 0), (1, 1, 1))])


@pytest.fixture(scope="module")
def model():
    made = LanguageModel(n_ctx=1024)
    yield made
    made.close()


def no_place(phrase):
    return False


def as_pattern(grammar):
    """The grammar as one regular expression: it has no rule that leads back to itself."""
    rules = dict(line.split(" ::= ", 1) for line in grammar.splitlines())
    assert len(rules) == len(grammar.splitlines())

    def expand(name):
        parts = re.findall(r'"(?:\\.|[^"\\])*"|[A-Za-z]+|[()?|]|\S', rules[name])
        found = []
        for part in parts:
            if part.startswith('"'):
                found.append(re.escape(part[1:-1].replace('\\"', '"')))
            elif part in ("(", ")", "?", "|"):
                found.append("(?:" if part == "(" else part)
            else:
                found.append(f"(?:{expand(part)})")  # a rule that is missing is a KeyError
        return "".join(found)

    return re.compile(expand("root"))


def test_no_question_is_refused(bare):
    with pytest.raises(QueryError, match="empty"):
        offered(" ", bare, no_place)


def test_a_map_with_nothing_in_it_offers_the_words_of_the_question(bare):
    offer = offered("upstairs?", bare, no_place)
    assert offer == Offer(floors=("upstairs",))
    pattern = as_pattern(program_grammar(offer))
    assert pattern.fullmatch(" " + EMPTY)
    assert not pattern.fullmatch(" " + EMPTY.replace("none", "on"))
    assert pattern.fullmatch(" " + EMPTY.replace('"relation": "none"', '"relation": "largest"'))


def test_things_are_said_with_and_without_their_look(bare):
    offer = offered("the coffee tables near a small red office chair", bare, no_place)
    assert list(offer.things)[:3] == ["coffee table", "coffee", "table"]
    assert offer.things["coffee table"] == Thing(noun="coffee table", plural=True)
    assert offer.things["small red office chair"] == Thing(noun="office chair", color="red", size="small")
    assert offer.things["chair"] == Thing(noun="chair")
    assert "small red office" in offer.things
    assert not any("near" in phrase or "coffee table office" in phrase for phrase in offer.things)
    assert offered("the mug on the table, the blue one", bare, no_place).things["blue mug"].color == "blue"


def test_places_ordinals_and_negation(house, bare):
    offer = offered("the second chair that isn't in the lounge on the third floor", house, {"lounge"}.__contains__)
    assert offer.rooms == ("lounge", "bedroom", "dining area", "kitchen", "living room")
    assert offer.floors == ("third floor", "floor 1", "floor 2")
    assert (offer.ordinals, offer.negation) == ((2,), True)
    assert not offered("the chair", bare, no_place).negation


def test_an_offer_is_bounded(house):
    words = " and the ".join(f"thing{i}x" for i in range(60))
    assert len(offered(words[:480], house, lambda phrase: True).things) == MOST_THINGS
    assert len(offered(words[:480], house, lambda phrase: True).rooms) == MOST_PLACES
    assert offered("a" * (MOST_LETTERS + 1), house, no_place).things == {}


def test_names_that_could_break_a_grammar_are_not_offered(node_of):
    graph = SceneGraph.of([
        node_of("B0", "", "building", (0, 0, 0), (1, 1, 1)),
        node_of("F0", "B0", 'floor" | root ::= "x', (0, 0, 0), (1, 1, 1)),
        node_of("R0", "F0", "кухня", (0, 0, 0), (1, 1, 1)),
    ])  # fmt: skip
    offer = offered('the cup" | root ::= "O999', graph, no_place)
    assert offer.rooms == ()
    assert all(
        set(phrase) <= set("abcdefghijklmnopqrstuvwxyz0123456789 '-") for phrase in (*offer.floors, *offer.things)
    )
    with pytest.raises(QueryError, match="cannot enter a grammar"):
        program_grammar(Offer(rooms=('x" | root',)))


def test_the_examples_of_the_prompt_are_programs_of_the_grammar(house):
    text = resources.files("placegraph.nodes.grounding").joinpath("prompts", "program.txt").read_text()
    examples = re.findall(r"Request: (.+)\nSearch:( .+)", text)
    assert len(examples) == 6
    read = []
    for question, reply in examples:
        offer = offered(question, house, no_place)
        assert as_pattern(program_grammar(offer)).fullmatch(reply), question
        read.append(read_program(reply, offer, question))
    assert (read[0].target, read[0].room) == (Thing(noun="chair", color="red"), "kitchen")
    assert (read[1].floor, read[1].clauses) == ("upstairs", ())
    assert [(c.relation, c.anchors[0].noun, c.of) for c in read[2].clauses] == [
        ("on", "table", 0),
        ("left of", "sofa", 1),
    ]
    assert read[3].purpose == "where can i wash my hands"
    assert [(c.relation, c.ordinal, c.negated) for c in read[4].clauses] == [("largest", 2, False), ("under", 1, True)]
    assert [anchor.noun for anchor in read[5].clauses[0].anchors] == ["door", "desk"]


@pytest.mark.parametrize(
    ("reply", "reason"),
    [
        ("", "no program"),
        ("[]", "no program"),
        (EMPTY[:-1], "no program"),
        (EMPTY.replace('"room"', '"place"'), "no program"),
        (EMPTY.replace("anything", "sofa"), "'sofa' for target"),
        (EMPTY.replace('"room": "none"', '"room": "attic"'), "'attic' for room"),
        (EMPTY.replace('"floor": "none"', '"floor": "attic"'), "'attic' for floor"),
        (EMPTY.replace('"relation": "none"', '"relation": "kissing"'), "'kissing' for relation"),
        (EMPTY.replace('"none"}', '"near", "anchors": ["sofa"]}', 1), "'sofa' for anchor"),
        (EMPTY.replace('"none"}', '"near", "anchors": ["cup"], "of": "anchor 1"}', 1), "'anchor 1' for of"),
    ],
)
def test_a_reply_that_was_not_offered_is_refused(reply, reason):
    with pytest.raises(QueryError, match=reason):
        read_program(reply, Offer(things={"cup": Thing(noun="cup")}), "the cup")


def test_a_reply_that_says_nothing_leaves_it_to_the_purpose():
    program = read_program(EMPTY, Offer(), "Could you help me, please?")
    assert (program.target, program.purpose) == (Thing(), "could you help me please")
    assert (
        read_program(EMPTY.replace('"floor": "none"', '"floor": "upstairs"'), Offer(floors=("upstairs",)), "x").purpose
        == ""
    )


@pytest.mark.parametrize("letters", ["xqzjvkwx", "1234567890", "a'b-c'd"])
def test_the_longest_reply_fits_its_tokens(model, letters):
    model.load()
    word = (letters * 8)[:MOST_LETTERS]
    offer = Offer({word: Thing(noun=word)}, (word,), (word,), (9,), True)
    join = f'{{"relation": "between", "anchors": ["{word}", "{word}"], "not": true, "of": "anchor 1"}}'
    conditions = ", ".join([join.replace(', "of": "anchor 1"', ""), *[join] * (MOST_CONDITIONS - 1)])
    reply = (
        f' {{"target": "{word}", "conditions": [{conditions}], "room": "{word}", "outside": true, "floor": "{word}"}}'
    )
    assert as_pattern(program_grammar(offer)).fullmatch(reply)
    assert len(model._llama.tokenize(reply.encode(), add_bos=False)) < REPLY_TOKENS


def test_the_model_reads_a_question(model, house, bare):
    before = model.calls
    program = dictated(model, "where is the fridge?", house, no_place)
    assert program.target.noun in ("", "fridge")
    assert dictated(model, "upstairs?", bare, no_place).target == Thing()
    assert model.calls == before + 2


def test_a_context_that_is_too_small_is_refused(house):
    small = LanguageModel(n_ctx=256)
    with pytest.raises(QueryError, match="do not fit the context of 256"):
        dictated(small, "where is the fridge?", house, no_place)
    small.close()
