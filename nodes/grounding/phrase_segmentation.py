"""Segment a question into phrases: things, relations, places, ordinals and breaks, in their order.

The longest trigger phrase wins; runs of words between triggers and filler words are noun phrases.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from placegraph.nodes.grounding.attributes import COLORS
from placegraph.nodes.grounding.relations import trigger_phrases
from placegraph.nodes.grounding.word_lists import word_list, word_table
from placegraph.runtime.language.word_forms import is_plural, normal_form, singular, tokens

FILLER = frozenset(word_list("filler"))
ANYTHING = frozenset(word_list("any_thing"))
WHOLE_MAP = frozenset(word_list("whole_map"))
ORDINALS: dict[str, int] = word_table("ordinals")
FLOOR_WORDS = frozenset(word_list("floor"))
FLOOR_KINDS = frozenset(("ground", "top", "upper", "lower", "lowest", "highest", "bottom", "main", "last")) | frozenset(
    ORDINALS
)
BREAKS = frozenset(",.;:?!")
CAN_KINDS = frozenset(word_list("kinds_of_can"))
VIEWS = {
    tuple(phrase.split()): "from"
    for phrase in ("seen from", "as seen from", "when seen from", "viewed from", "when viewed from", "looking from")
}
SIDES = {"left": "leftmost", "right": "rightmost", "middle": "middle"}
IDIOMS = word_list("idioms")

# Only these sizes are separated from a noun: "low table" and "high chair" are kinds of things.
SIZES: dict[str, str] = word_table("sizes_before_nouns")

OWNS = r"\b(?:that |which )?(?:has|have|with|holds|holding|carries|carrying) (.{1,60}?) "
INVERSE_PHRASES = (
    (re.compile(OWNS + r"(?:on|on top of) it\b", re.IGNORECASE), r"holding \1"),
    (re.compile(OWNS + r"on top\b(?! of)", re.IGNORECASE), r"holding \1"),
    (re.compile(OWNS + r"(?:next to|near|beside|by) it\b", re.IGNORECASE), r"near \1"),
    (re.compile(OWNS + r"(?:above|over) it\b", re.IGNORECASE), r"under \1"),
    (re.compile(OWNS + r"(?:under|below|underneath) it\b", re.IGNORECASE), r"above \1"),
    (re.compile(r"\bwithout (.{1,60}?)(?: on it| on top)?(?=[,.?!]|$)", re.IGNORECASE), r"not holding \1"),
    (re.compile(OWNS + r"(?:in|inside) it\b", re.IGNORECASE), r"holding \1"),
)


@dataclass
class Phrase:
    """One phrase: `kind` is thing, place, relation, floor, ordinal, to, and, not, or break."""

    kind: str
    text: str = ""
    color: str = ""
    size: str = ""
    plural: bool = False
    number: int = 0
    words: list[str] = field(default_factory=list)


def rewrite_inverse_phrases(text: str) -> str:
    """Invert conditions that are said of the anchor: "with the lamp on it" becomes "holding the lamp"."""
    for pattern, replacement in INVERSE_PHRASES:
        text = pattern.sub(replacement, text)
    return text


def segment(text: str) -> list[Phrase]:
    """Segment a question. Filler words are dropped but end a noun phrase."""
    words, phrases, i = tokens(rewrite_inverse_phrases(text)), [], 0
    triggers = trigger_phrases() | VIEWS
    longest = max(map(len, triggers))
    idioms = [tuple(idiom.split()) for idiom in IDIOMS]
    pending: list[str] = []

    def flush() -> None:
        if pending:
            phrases.extend(_noun_phrase(pending))
            pending.clear()

    while i < len(words):
        idiom = next((idiom for idiom in idioms if words[i : i + len(idiom)] == idiom), None)
        floor = _floor(words, i)
        size = next((n for n in range(longest, 0, -1) if words[i : i + n] in triggers), 0)
        if idiom and len(idiom) >= size:
            flush()
            i += len(idiom)
        elif floor:
            flush()
            phrases.append(Phrase("floor", floor[1]))
            i += floor[0]
        elif size:
            flush()
            phrases.append(Phrase("relation", triggers[words[i : i + size]], words=list(words[i : i + size])))
            i += size
        else:
            i += 1
            _single(words[i - 1], words[i] if i < len(words) else "", pending, phrases, flush)
    flush()
    return phrases


def _single(word: str, following: str, pending: list[str], phrases: list[Phrase], flush: object) -> None:
    """Add one word that starts no trigger phrase: to the pending noun phrase, or as a phrase of its own."""
    assert callable(flush)
    if word in BREAKS:
        flush()
        phrases.append(Phrase("break"))
    elif word in ("and", "not", "isn't", "aren't"):
        flush()
        phrases.append(Phrase("and" if word == "and" else "not"))
    elif word in ORDINALS:
        flush()
        phrases.append(Phrase("ordinal", number=ORDINALS[word]))
    elif word in SIDES and following and following not in FILLER and following not in BREAKS:
        flush()
        phrases.append(Phrase("relation", SIDES[word]))  # "the left chair", "the middle one"
    elif word in ("to", "from") and not pending:
        phrases.append(Phrase("to"))
    elif word in ("to", "from"):
        flush()
        phrases.append(Phrase("to"))
    elif word == "can" and pending and pending[-1] in CAN_KINDS:
        pending.append(word)
    elif word in FILLER:
        flush()
    else:
        pending.append(word)


def _floor(words: tuple[str, ...], i: int) -> tuple[int, str] | None:
    """The number of words and the text of the floor phrase that starts at word i; None when there is none."""
    skip = 0
    while words[i + skip : i + skip + 1] and words[i + skip] in ("on", "at", "in", "the", "from", "of") and skip < 2:
        skip += 1
    rest = words[i + skip : i + skip + 2]
    if rest[:1] and rest[0] in ("upstairs", "downstairs"):
        return skip + 1, rest[0]
    if len(rest) == 2 and rest[0] in FLOOR_KINDS and rest[1] in FLOOR_WORDS:
        return skip + 2, f"{rest[0]} floor"
    if len(rest) == 2 and rest[0] in FLOOR_WORDS and rest[1].isdigit():
        return skip + 2, f"floor {int(rest[1])}"
    return None


def _noun_phrase(words: list[str]) -> list[Phrase]:
    """A run of content words as a noun phrase, with its colour and size separated."""
    noun = [word for word in words if word not in COLORS and word not in SIZES]
    color = next((COLORS[word] for word in words if word in COLORS), "")
    size = next((SIZES[word] for word in words if word in SIZES), "")
    if noun and all(word in ANYTHING for word in noun):
        return [Phrase("thing", "", color, size, plural=singular(noun[-1]) != noun[-1], words=["thing"])]
    if not noun:
        # "the red one", "which is the orange": the colour word is all there is
        return [Phrase("thing", "", color, size, words=list(words))]
    kept = [word for word in noun if word not in ANYTHING]
    text = " ".join(kept)
    return [Phrase("thing", normal_form(text), color, size, is_plural(text), words=kept)]
