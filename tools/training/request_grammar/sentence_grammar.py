"""Whole requests as people say them: openers, statements, order of the parts, several sentences."""

from __future__ import annotations

from placegraph.nodes.grounding.program import ANYTHING, SAME_KIND, Condition, Thing
from placegraph.tools.training.request_grammar.context_grammar import ContextGrammar
from placegraph.tools.training.request_grammar.phrase_grammar import NounPhrase, Phrase, PhraseGrammar, fitting_article
from placegraph.tools.training.request_grammar.phrase_tables import (
    NUMBERS,
    ORDINALS,
    PHRASES,
    TEMPLATES,
    WEIGHTS,
    WORDS,
)

CLASHING = (
    {"leftmost", "rightmost", "nth", "middle"}, {"largest", "smallest", "tallest", "shortest",
    "longest"}, {"highest", "lowest"},
    {"frontmost", "backmost"}, {"corner", "center"}, {"closest", "farthest"},
)  # fmt: skip


def _contradicts(new: list[Condition], said: list[Condition]) -> bool:
    """Whether nobody would say both of one thing: the left one on the right."""
    names = {condition.name for condition in said}
    unanchored = {condition.name for condition in new if not condition.things}
    return any(unanchored & group and names & group for group in CLASHING) or bool(unanchored & names)


class SentenceGrammar:
    """Draws whole requests."""

    def __init__(self, speaker: PhraseGrammar) -> None:
        self.say = speaker
        self.around = ContextGrammar(speaker)

    def request(self) -> tuple[str, Thing]:
        """A request in lower case and the target that it means."""
        luck = self.say.random.random()
        if luck < 0.02:
            return self._purpose_request()
        if luck < 0.05:
            return self._what_request()
        phrase = self._target()
        if luck < 0.13:
            text, conditions = self._of_several(phrase)
        elif luck < 0.30:
            text, conditions = self._statement(phrase)
        elif luck < 0.37:
            text, conditions = self._relation_first(phrase)
        elif luck < 0.43:
            text, conditions = self._afterthought(phrase)
        else:
            text, conditions = self._noun_phrase_request(phrase)
        text, conditions = self.around.add_place(text, conditions)
        text, conditions = self.around.add_viewpoint(text, conditions)
        return self.around.add_fillers(text), Thing(noun=phrase.noun, conditions=tuple(conditions))

    # the target ------------------------------------------------------------------------------------------------------

    def _target(self) -> NounPhrase:
        say = self.say
        phrase = NounPhrase(noun=SAME_KIND if say.chance(0.02) else say.noun())
        say.target_noun = "" if phrase.noun == SAME_KIND else phrase.noun
        if say.chance(0.27):
            self._rank_before(phrase)
            if say.chance(0.1):  # the front middle pillow
                self._rank_before(phrase)
        if say.chance(0.3):
            said, conditions = say.adjectives(say.random.choice((1, 1, 1, 2, 2, 3)))
            at = 0 if say.chance(0.15) else len(phrase.before)
            phrase.before[at:at] = said
            phrase.conditions[at:at] = conditions
        is_bare = not phrase.conditions
        count = say.random.choices((0, 1, 2, 3), (0.04, 1, 0.33, 0.06) if is_bare else (0.45, 1, 0.2, 0.03))[0]
        for _ in range(count):
            luck = say.random.random()
            behind = say.position() if luck < 0.27 else say.possession() if luck < 0.41 else say.relation(0)
            if not _contradicts(
                behind.conditions, [*phrase.conditions, *(c for part in phrase.behind for c in part.conditions)]
            ):
                phrase.behind.append(behind)
        return phrase

    def _rank_before(self, phrase: NounPhrase) -> None:
        say = self.say
        name = say.weighted(WEIGHTS["rank"])
        if _contradicts([Condition(name=name)], phrase.conditions):
            return
        word = say.pick(PHRASES["rank"][name])
        luck = say.random.random()
        if luck < 0.06 and name not in ("middle", "alone"):
            number = say.random.choice((2, 2, 3))
            phrase.before.append(f"{say.random.choice(ORDINALS[number])} {word}")
            phrase.conditions.append(Condition(name=name, number=number))
        elif luck < 0.12:
            number = say.random.choice((1, 2, 3, 4))
            phrase.before.append("first" if number == 1 else say.random.choice(ORDINALS[number]))
            phrase.conditions.append(Condition(name="nth", number=number))
        elif luck < 0.2 and name in ("closest", "farthest"):
            text, thing = say.anchor(1)
            link = say.random.choice(("to",) if name == "closest" else ("from", "away from"))
            phrase.before.append(word)
            phrase.behind.append(
                Phrase(f"{link} {text}", f"{link} {text}", [Condition(name=name, things=(thing,))], True)
            )
        else:
            phrase.before.append(word)
            phrase.conditions.append(Condition(name=name))

    def _joined(self, text: str, behind: list[Phrase], *, anchored: bool = False) -> tuple[str, list[Condition]]:
        """The phrases of the target one after another, with a separator after an anchor."""
        say, conditions = self.say, []
        for i, phrase in enumerate(behind):
            if anchored:
                link = say.random.choice(TEMPLATES["links_after_anchor"])
                if phrase.text.startswith(("that ", "which ")):  # after a comma these would refer to the anchor
                    link = say.random.choice((" and ", ", and ", " and is "))
                verb = link.rstrip().endswith(("is", "it's"))
                said = phrase.predicate if verb and not phrase.predicate.startswith("|") else phrase.text
                if verb and phrase.predicate.startswith("|"):
                    link = (
                        " and " if phrase.text.startswith(("that ", "which ")) else say.random.choice((", ", " and "))
                    )
                text += link + said
            else:
                text += (" " if i == 0 or say.chance(0.6) else say.random.choice((", ", " and "))) + phrase.text
            conditions += phrase.conditions
            anchored = phrase.ends_in_anchor
        return text, conditions

    # forms -----------------------------------------------------------------------------------------------------------

    def _noun_phrase_request(self, phrase: NounPhrase) -> tuple[str, list[Condition]]:
        say = self.say
        text = fitting_article(say.article(0.08) + phrase.head)
        text, conditions = self._joined(text, phrase.behind)
        if say.chance(0.1) and not phrase.conditions and phrase.behind:
            text = f"which {phrase.noun} is {self._verb(phrase.behind[0])}" if len(phrase.behind) == 1 else text
        elif say.chance(0.55):
            text = say.pick(TEMPLATES["openers"]).format(text)
        return text, [*phrase.conditions, *conditions]

    @staticmethod
    def _verb(phrase: Phrase) -> str:
        return phrase.text if phrase.predicate.startswith("|") else phrase.predicate

    def _statement(self, phrase: NounPhrase) -> tuple[str, list[Condition]]:
        """A statement: this desk is near the door; the correct lamp is on the left."""
        say = self.say
        if not phrase.behind:
            phrase.behind.append(say.relation(0))
        subject = say.pick(TEMPLATES["subjects"]).format(phrase.head)
        first = phrase.behind[0]
        verb = first.predicate.removeprefix("|") if first.predicate.startswith("|") else self._is(first.predicate)
        conditions = [*phrase.conditions, *first.conditions]
        text, more = self._joined(f"{subject} {verb}", phrase.behind[1:], anchored=first.ends_in_anchor)
        return text, conditions + more

    def _is(self, predicate: str) -> str:
        plain = not predicate.startswith(("one ", "not ", "NOT ", "the "))
        verbs = ("is", "is", "is", "is the one", "is the one that is", "should be") if plain else ("is",)
        return f"{self.say.random.choice(verbs)} {predicate}"

    def _relation_first(self, phrase: NounPhrase) -> tuple[str, list[Condition]]:
        """On the left bed, the middle pillow; under the desk by the door, it is the second tower."""
        say = self.say
        first = say.relation(0)
        while (
            first.conditions[0].kind != "relation"
            or first.conditions[0].negated
            or first.text.startswith(("that", "which"))
        ):
            first = say.relation(0)
        link = say.random.choice(TEMPLATES["links_after_relation"])
        text, conditions = self._joined(f"{first.predicate}{link}{phrase.head}", phrase.behind)
        return text, [*first.conditions, *phrase.conditions, *conditions]

    def _of_several(self, phrase: NounPhrase) -> tuple[str, list[Condition]]:
        """The larger of the two lamps; of the three windows, the middle one; in a row of five chairs, the second."""
        say = self.say
        several = say.plural(phrase.noun)
        number = say.random.choice((0, 2, 2, 2, 3, 3, 3, 4, 5, 6))
        counted = f"{say.random.choice(NUMBERS[number])} " if number else ""
        count = [Condition(name="count", number=number)] if number else []
        article = say.random.choice(("the ", "the ", "these ", "") if number else ("the ", "the ", "these "))
        phrase.noun = several
        if not phrase.before:
            self._rank_before(phrase)
        first = phrase.conditions
        behind, conditions = self._joined("", phrase.behind)
        before = " ".join(phrase.before)
        luck = say.random.random()
        if luck < 0.45:
            if phrase.behind and phrase.behind[0].text.startswith(("to ", "from ", "away ")):
                phrase.behind = []
                first, behind, conditions = [*first, Condition(name="alone")], " by itself", []
                before = f"{before} one" if before else "one"
                return f"the {before}{behind} of {article}{counted}{several}", [*first, *count]
            return f"the {before}{' one' if say.chance(0.3) else ''} of {article}{counted}{several}{behind}", [
                *first,
                *count,
                *conditions,
            ]
        opening = say.random.choice(TEMPLATES["group_openings"])
        opening = (
            "of" if opening in ("in a row of", "there are", "in the group of", "looking at") and not number else opening
        )
        article = "" if opening in ("in a row of", "there are") else article
        one = say.random.choice(TEMPLATES["one_of_group"])
        if opening == "there are":
            one = one.replace(" the {}", " pick the {}") if one.startswith(" the") else one
        return f"{opening} {article}{counted}{several}{one.format(before)}{behind}", [*count, *first, *conditions]

    def _afterthought(self, phrase: NounPhrase) -> tuple[str, list[Condition]]:
        """The mug on the table, the blue one. The chair near the door. It is red."""
        say = self.say
        text, conditions = self._joined(f"the {phrase.head}", phrase.behind)
        said, adjectives = say.adjectives(say.random.choice((1, 1, 2)))
        adjective = " ".join(said)
        tail = say.random.choice(TEMPLATES["afterthoughts"])
        if tail.startswith(" that") and phrase.behind:
            tail = ", the {} one"
        if tail.endswith("color"):
            said, adjectives = [say.pick(WORDS["colors"])], []
            adjectives = [Condition(name="is", words=said[0])]
            adjective = said[0]
        elif len(said) > 1 and "one" not in tail:
            adjective = " and ".join(said)
        text = say.pick(TEMPLATES["openers"]).format(text) if say.chance(0.3) else text
        return text + tail.format(adjective), [*phrase.conditions, *conditions, *adjectives]

    def _purpose_request(self) -> tuple[str, Thing]:
        say = self.say
        purpose = say.pick(WORDS["purposes"])
        opening = say.pick(TEMPLATES["purposes"])
        text, conditions = self.around.add_place(opening.format(purpose), [Condition(name="for", words=purpose)])
        return self.around.add_fillers(text), Thing(noun=ANYTHING, conditions=tuple(conditions))

    def _what_request(self) -> tuple[str, Thing]:
        """What is under the bed?"""
        say = self.say
        phrase = say.relation(0)
        while phrase.conditions[0].negated or phrase.text.startswith(("that", "which")):
            phrase = say.relation(0)
        opening = say.pick(TEMPLATES["what"])
        return self.around.add_fillers(opening.format(phrase.predicate)), Thing(
            noun=ANYTHING, conditions=tuple(phrase.conditions)
        )
