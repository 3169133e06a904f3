"""A request read into a program by the language model with its adapter."""

from __future__ import annotations

from placegraph.nodes.grounding.words import tokens

# What stands before and after a request, alike in training (tools/train/reader.py) and in use.
OPENING = "<|im_start|>request\n"
CLOSING = "\nprogram:"


def asked(text: str) -> str:
    """What stands between OPENING and the reply: the request's words as the grammar knows them."""
    return " ".join(tokens(text)) + CLOSING


def reply(program: str) -> str:
    """A program's text as the model writes it."""
    return f" {program}\n"
