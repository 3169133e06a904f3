"""Shared by all processes; knows no particular node."""
