"""Words of a question or a tag: tokens, singular forms, and the synonyms that word embeddings miss."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from importlib import resources

TOKEN = re.compile(r"[a-z0-9]+(?:['-][a-z0-9]+)*|[,.;:?!]")
IRREGULAR_SINGULARS = {
    "shelves": "shelf",
    "bookshelves": "bookshelf",
    "knives": "knife",
    "loaves": "loaf",
    "leaves": "leaf",
    "mice": "mouse",
    "people": "person",
    "feet": "foot",
    "scissors": "scissors",
    "stairs": "stairs",
    "clothes": "clothes",
    "lens": "lens",
    "gas": "gas",
    "series": "series",
}
SINGULAR_ENDINGS = ("ss", "us", "is", "as")  # glass, cactus, chassis, canvas are singular already
ES_PLURALS = ("shes", "ches", "xes", "sses", "zes")  # dishes, benches, boxes, glasses


def tokens(text: str) -> tuple[str, ...]:
    """Lower-case words of ASCII letters, digits, ' and -, and punctuation marks, in order; the rest is dropped."""
    plain = unicodedata.normalize("NFKD", text.replace("\u2019", "'")).lower()
    plain = "".join(mark for mark in plain if not unicodedata.combining(mark))
    return tuple(word.removesuffix("'s") for word in TOKEN.findall(plain))


@cache
def singular(word: str) -> str:
    """The singular of an English noun by its ending; other words are returned unchanged."""
    if word in IRREGULAR_SINGULARS:
        return IRREGULAR_SINGULARS[word]
    if len(word) < 4 or not word.endswith("s") or word.endswith(SINGULAR_ENDINGS):
        return word
    if word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-2] if word.endswith(ES_PLURALS) else word[:-1]


@cache
def normal_form(phrase: str) -> str:
    """The form in which noun phrases are compared: lower-case words joined by spaces, the last one singular."""
    words = [word for word in tokens(phrase.replace("-", " ").replace("_", " ")) if word[0].isalnum()]
    return " ".join([*words[:-1], singular(words[-1])]) if words else ""


def is_plural(phrase: str) -> bool:
    """Whether the last word of a noun phrase is a plural."""
    last = phrase.split(" ")[-1]
    return singular(last) != last


@cache
def synonyms() -> dict[str, frozenset[str]]:
    """Names of the same kind of thing, by normal form, with and without the spaces of compounds (synonyms.txt)."""
    groups: dict[str, frozenset[str]] = {}
    for line in _lines("synonyms.txt"):
        if ":" not in line:
            group = _spellings(line)
            for name in group:
                groups[name] = groups.get(name, frozenset()) | group
    return groups


@cache
def hyponyms() -> dict[str, frozenset[str]]:
    """Narrower names that a wider word may stand for, by normal form of the wider word (synonyms.txt)."""
    groups: dict[str, frozenset[str]] = {}
    for line in _lines("synonyms.txt"):
        if ":" in line:
            wider, narrower = line.split(":")
            for name in _spellings(wider):
                groups[name] = groups.get(name, frozenset()) | _spellings(narrower)
    return groups


def _lines(file: str) -> list[str]:
    text = resources.files(__package__).joinpath(file).read_text(encoding="utf-8")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def _spellings(names: str) -> frozenset[str]:
    """Normal forms of names that commas separate, each also without its spaces."""
    forms = [normal_form(name) for name in names.split(",")]
    return frozenset(forms) | {form.replace(" ", "") for form in forms}
