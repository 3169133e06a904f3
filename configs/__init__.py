"""Dataflow files that come with placegraph."""
