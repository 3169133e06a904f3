"""Generates questions about a house that have exactly one right answer, with their text and program."""
