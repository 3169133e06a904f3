"""Geometry, registration and features of views: what the nodes that estimate poses share."""
