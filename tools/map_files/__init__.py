"""The files of a map folder: what a run writes, and how the other commands read it."""
