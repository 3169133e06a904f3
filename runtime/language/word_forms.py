"""Words of a question or a tag: tokens, singular forms, and the synonyms that word embeddings miss."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from importlib import resources

TOKEN = re.compile(r"[a-z0-9]+(?:['-][a-z0-9]+)*|[,.;:?!]")
IRREGULAR = {
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
KEEP_S = ("ss", "us", "is", "as")  # glass, cactus, chassis, canvas are singular already
TAKES_ES = ("shes", "ches", "xes", "sses", "zes")  # dishes, benches, boxes, glasses


def tokens(text: str) -> tuple[str, ...]:
    """Lower-case words of ASCII letters, digits, ' and -, and punctuation marks, in order; other script is left out."""
    plain = unicodedata.normalize("NFKD", text.replace("\u2019", "'")).lower()
    plain = "".join(mark for mark in plain if not unicodedata.combining(mark))
    return tuple(word.removesuffix("'s") for word in TOKEN.findall(plain))


@cache
def singular(word: str) -> str:
    """The singular of an English noun by its ending; a word that is no plural comes back as it is."""
    if word in IRREGULAR:
        return IRREGULAR[word]
    if len(word) < 4 or not word.endswith("s") or word.endswith(KEEP_S):
        return word
    if word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-2] if word.endswith(TAKES_ES) else word[:-1]


@cache
def normal_form(phrase: str) -> str:
    """A noun phrase as it is compared: words joined by spaces, the last one singular."""
    words = [word for word in tokens(phrase.replace("-", " ").replace("_", " ")) if word[0].isalnum()]
    return " ".join([*words[:-1], singular(words[-1])]) if words else ""


def is_plural(phrase: str) -> bool:
    """Whether the last word of a noun phrase is a plural."""
    last = phrase.split(" ")[-1]
    return singular(last) != last


def words_of(file: str) -> frozenset[str]:
    """The words of a text file of this package; lines that start with # are remarks."""
    return frozenset(word for line in _lines(file) for word in line.split())


def _lines(file: str) -> list[str]:
    text = resources.files(__package__).joinpath(file).read_text(encoding="utf-8")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


@cache
def synonyms() -> dict[str, frozenset[str]]:
    """Names of the same kind of thing, by normal form, with and without the spaces of compounds.

    Read from synonyms.txt: one set a line, separated by commas.
    """
    found: dict[str, frozenset[str]] = {}
    for line in _lines("synonyms.txt"):
        if ":" in line:
            continue
        group = frozenset(form for name in line.split(",") for form in _forms(name))
        for name in group:
            found[name] = found.get(name, frozenset()) | group
    return found


@cache
def kinds() -> dict[str, frozenset[str]]:
    """What a wider word may stand for, by normal form; the lines `wider: one, other` of synonyms.txt."""
    found: dict[str, frozenset[str]] = {}
    for line in _lines("synonyms.txt"):
        if ":" in line:
            wider, members = line.split(":")
            group = frozenset(form for name in members.split(",") for form in _forms(name))
            for name in _forms(wider):
                found[name] = found.get(name, frozenset()) | group
    return found


def _forms(name: str) -> tuple[str, str]:
    whole = normal_form(name)
    return whole, whole.replace(" ", "")
