"""The exception tree. Anything raised on purpose is one of these; anything else is a bug.

PlacegraphError
├── ConfigError    a dataflow file, a setting or the wiring is wrong
├── SchemaError    a message, a graph file or a recording does not match its declaration
├── SourceError    frames cannot be read: a missing folder, a broken image, wrong intrinsics
├── ModelError     weights are absent, damaged, or not of the family's layout
└── QueryError     a question cannot be answered because it, or the map, is not usable
"""


class PlacegraphError(Exception):
    """Base of every error that placegraph raises on purpose; its text is written for the person at the terminal."""


class ConfigError(PlacegraphError):
    """A dataflow file, a setting or the wiring is wrong."""


class SchemaError(PlacegraphError):
    """A message, a graph file or a recording does not match its declaration."""


class SourceError(PlacegraphError):
    """Frames cannot be read: a missing folder, a broken image, wrong intrinsics."""


class ModelError(PlacegraphError):
    """Weights are absent, damaged, or not of the family's layout."""


class QueryError(PlacegraphError):
    """A question cannot be answered because it, or the map, is not usable."""
