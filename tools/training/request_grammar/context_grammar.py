"""The context of a request: room and floor, viewpoint, greetings, fillers."""

from __future__ import annotations

from placegraph.nodes.grounding.program import Condition, Thing
from placegraph.tools.training.request_grammar.phrase_grammar import MAX_DEPTH, PhraseGrammar
from placegraph.tools.training.request_grammar.phrase_tables import ENTERING, ORDINALS, PHRASES, TEMPLATES, WORDS

SIDED = frozenset(
    ("leftmost", "rightmost", "left", "right", "front", "behind", "frontmost", "backmost", "middle", "nth")
)


class ContextGrammar:
    """Draws what is said around a target."""

    def __init__(self, speaker: PhraseGrammar) -> None:
        self.say = speaker

    def add_place(self, text: str, conditions: list[Condition]) -> tuple[str, list[Condition]]:
        """Adds a room or floor, before or after the request."""
        say = self.say
        conditions = list(conditions)
        if say.chance(0.12):
            said, condition = self._room()
            text, conditions = self._attach(text, conditions, said, condition)
        if say.chance(0.06):
            floor = say.pick(WORDS["floors"])
            if floor in ("upstairs", "downstairs"):
                links = ["{}"]
            else:
                links = ["on the {}", *(("on the {}", "on {}") if floor[-1].isdigit() else ("of the {}", "on the {}"))]
            said = say.random.choice(links).format(floor)
            text, conditions = self._attach(text, conditions, said, Condition(name="floor", words=floor))
        return text, conditions

    def _attach(
        self, text: str, conditions: list[Condition], said: str, condition: Condition
    ) -> tuple[str, list[Condition]]:
        if self.say.chance(0.18):
            said = said.removeprefix("that is ").removeprefix("located ")
            link = self.say.random.choice((", ", " , ", " "))
            return f"{said}{link}{text}", [condition, *conditions]
        return f"{text} {said}", [*conditions, condition]

    def _room(self) -> tuple[str, Condition]:
        say = self.say
        room = say.pick(WORDS["rooms"] if say.chance(0.75) else WORDS["areas"])
        inner: list[Condition] = []
        said = room
        luck = say.random.random()
        if luck < 0.12:
            number = say.random.choice((1, 2, 2, 3))
            said = f"{'first' if number == 1 else ORDINALS[number][0]} {room}"
            inner.append(Condition(name="nth", number=number))
        elif luck < 0.2:
            look = say.pick(("large", "small", "big", "white", "blue", "green", "other", "guest", "yellow"))
            said = f"{look} {room}"
            inner.append(Condition(name="is", words=look))
        elif luck < 0.26:
            name = say.weighted({"largest": 1, "smallest": 1})
            said = f"{say.pick(PHRASES['rank'][name])} {room}"
            inner.append(Condition(name=name))
        if say.chance(0.12):
            text, thing = say.anchor(MAX_DEPTH, simple=True)
            name, link = say.random.choice(
                (("with", "with"), ("near", "next to"), ("with", "that has"), ("near", "near"))
            )
            said, inner = f"{said} {link} {text}", [*inner, Condition(name=name, things=(thing,))]
        thing = Thing(noun=room, conditions=tuple(inner))
        if say.chance(0.07):
            link = say.random.choice(TEMPLATES["not_in_room"])
            return link.format(said), Condition(name="room", things=(thing,), negated=True)
        return say.random.choice(TEMPLATES["room_links"]).format(said), Condition(name="room", things=(thing,))

    def add_viewpoint(self, text: str, conditions: list[Condition]) -> tuple[str, list[Condition]]:
        """Adds a viewpoint, more often where the target has a side."""
        say = self.say
        if not say.chance(0.33 if SIDED & {condition.name for condition in conditions} else 0.05):
            return text, conditions
        luck = say.random.random()
        if luck < 0.1:
            said, noun = say.random.choice(ENTERING)
            view = Condition(name="from", things=(Thing(noun=noun),))
            return self._attach_view(text, conditions, said, view, first=say.chance(0.7))
        if say.chance(0.3) and say.target_noun:
            noun = say.plural(say.target_noun) if say.chance(0.8) else say.target_noun
            anchor, thing = f"{'the ' if say.chance(0.85) else ''}{noun}", Thing(noun=noun)
        else:
            anchor, thing = say.anchor(2, noun="door" if luck > 0.75 and say.chance(0.35) else "")
        first = say.chance(0.7)
        name, options = "looking", PHRASES["viewpoint"]["looking_first" if first else "looking_last"]
        if luck > 0.75:
            name, options = "from", PHRASES["viewpoint"]["from"]
        if luck > 0.95:
            name, options = "back", PHRASES["viewpoint"]["back"]
        return self._attach_view(
            text, conditions, say.pick(options).format(anchor), Condition(name=name, things=(thing,)), first=first
        )

    def _attach_view(
        self, text: str, conditions: list[Condition], said: str, view: Condition, *, first: bool
    ) -> tuple[str, list[Condition]]:
        say = self.say
        if not first:
            return f"{text}{say.random.choice((' ', ', '))}{said}", [*conditions, view]
        lead = say.random.choice(TEMPLATES["links_after_viewpoint"])
        pronouns = ("it", "this", "they", "i am", "which", "where", "what", "of ", "out of")
        if text.startswith(pronouns) or text.split()[0] in ("find", "choose"):
            lead = say.random.choice((", ", ", ", " ", ". "))
        return f"{said}{lead}{text}", [view, *conditions]

    def add_fillers(self, text: str) -> str:
        """Adds greetings, fillers and punctuation."""
        say = self.say
        if say.chance(0.07):
            text = f"{say.pick(TEMPLATES['greetings'])} {text}"
        if say.chance(0.09):
            text = f"{text}{say.random.choice((' ', ', '))}{say.pick(TEMPLATES['endings'])}"
        return " ".join(text.split()) + say.random.choice(("", "", ".", ".", ".", "?" if say.chance(0.3) else ""))
