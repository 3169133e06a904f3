"""Geometry and registration of views, shared by the nodes that estimate poses."""
