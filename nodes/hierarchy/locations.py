"""Locations: groups of objects that stand close together in one room.

With a `model`, its masks on a bird's-eye image decide, as in the paper: the objects inside a mask are its members. Not
as in the paper: mostly inside suffices, since masks are coarse; the outline is the convex hull of the mask and of the
members that stand on the floor, since a mask also covers what belongs there and was not mapped.

Without one, objects are clustered as for the paper's training labels: DBSCAN on a height band, each object joins the
cluster with most of its points, clusters with few objects are dropped, then small and elongated outlines. Not as in the
paper: DBSCAN runs on coarse cells of the objects' points, room by room, and the outline is that of the closed
bird's-eye mask, which like an alpha shape may be concave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.models_onnx import LocationDetector
from placegraph.nodes.hierarchy.birds_eye_view import birds_eye_image
from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.plan_grid import close_gaps, floor_grid
from placegraph.runtime.arrays import F64, Points
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.vision.clustering import dbscan
from placegraph.runtime.vision.geometry import convex_footprint


class LocationConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Parameters of the location layer. Where the paper states no value it was chosen by hand."""

    band_low_share: float = 0.05  # paper, alpha_min: above the noise of the floor
    band_high_share: float = 0.8  # paper, alpha_max: below lamps
    cell_m: float = 0.1  # points are thinned to cells of this size before they are clustered
    eps_m: float = 0.4  # paper, DBSCAN: a chair pulled out from its table
    min_cells: int = 4  # paper, DBSCAN
    min_objects: int = 2  # paper, c
    min_area_m2: float = 0.25  # paper
    compactness: float = 0.25  # paper, C in 4 pi S / P^2 < C; a 5:1 strip has .44
    close_m: float = 0.2  # in place of the alpha of the alpha shape
    model: str = ""  # a LocationDetector of the manifest; "": objects are clustered
    min_score: float = Field(default=0.3, ge=0, le=1)  # of the model's masks; chosen on maps of three houses
    inside_share: float = Field(default=0.5, gt=0, le=1)  # of an object's points in a mask that make it a member
    stand_m: float = 0.4  # an object that begins higher hangs or lies on another and adds nothing to an outline


@dataclass(frozen=True, eq=False)
class LocationArea:
    """One location: outline (K, 2) in metres, world frame, and the indices of its objects in the given list."""

    outline: F64
    members: tuple[int, ...]


def find_locations(
    objects: Sequence[Points], span: FloorSpan, config: LocationConfig, detector: LocationDetector | None = None
) -> list[LocationArea]:
    """Locations of one room, in the order of their first object.

    objects: the (N, 3) points of each of the room's objects, metres, world frame; detector: the network that
    `config.model` names. Source: paper, "Location Layer", equations 3 to 7.

    Raises:
        ConfigError: the settings name a model and no detector was given.
        ModelError: the network cannot be run.
    """
    if detector is not None:
        return _find_by_network(objects, span, config, detector)
    if config.model:
        raise ConfigError(f"locations: model {config.model!r} is named, but no network was loaded")
    return _find_by_clustering(objects, span, config)


def _find_by_network(
    objects: Sequence[Points], span: FloorSpan, config: LocationConfig, detector: LocationDetector
) -> list[LocationArea]:
    """Each mask of the network, best first, takes the objects mostly inside it that no better one has taken."""
    image, grid = birds_eye_image(objects, span, config.band_high_share)
    if not image.any():
        return []
    detected = detector.locate(image)
    top = span.low_m + config.band_high_share * (span.ceiling_m - span.low_m)
    banded = [xyz[xyz[:, 2] <= top] for xyz in objects]
    free = {i for i, xyz in enumerate(banded) if len(xyz)}
    areas = []
    for mask, score in zip(detected.masks, detected.scores.tolist(), strict=True):
        inside = [i for i in sorted(free) if mask[grid.cells(banded[i])].mean() >= config.inside_share]
        if score < config.min_score or not inside:
            continue
        outline = _outline_with_members(grid.outline(mask), [banded[i] for i in inside], span, config)
        if cv2.contourArea(outline.astype(np.float32)) >= config.min_area_m2:
            free -= set(inside)
            areas.append(LocationArea(outline, tuple(inside)))
    return sorted(areas, key=lambda area: area.members[0])


def _outline_with_members(mask_outline: F64, members: list[Points], span: FloorSpan, config: LocationConfig) -> F64:
    """Convex outline (K, 2) of a mask's outline and of the members that stand on the floor."""
    standing = [xyz[:, :2] for xyz in members if xyz[:, 2].min() <= span.low_m + config.stand_m]
    return np.asarray(convex_footprint(np.concatenate([mask_outline, *standing])), float)


def _find_by_clustering(objects: Sequence[Points], span: FloorSpan, config: LocationConfig) -> list[LocationArea]:
    height = span.ceiling_m - span.low_m
    low, high = span.low_m + config.band_low_share * height, span.low_m + config.band_high_share * height
    banded = [xyz[(xyz[:, 2] >= low) & (xyz[:, 2] <= high)] for xyz in objects]
    owner = np.repeat(np.arange(len(objects)), [len(xyz) for xyz in banded])
    if not len(owner):
        return []
    points = np.concatenate(banded)
    cells, cell_of = np.unique(np.floor(points / config.cell_m).astype(np.int64), axis=0, return_inverse=True)
    labels = dbscan(cells, config.eps_m / config.cell_m, config.min_cells)[cell_of.reshape(-1)]
    members: dict[int, list[int]] = {}
    for i in range(len(objects)):
        votes = labels[(owner == i) & (labels >= 0)]
        if len(votes):
            members.setdefault(int(np.argmax(np.bincount(votes))), []).append(i)
    areas = (_outline([objects[i] for i in group], config) for group in members.values())
    return [
        LocationArea(outline, tuple(group))
        for group, outline in zip(members.values(), areas, strict=True)
        if len(group) >= config.min_objects and outline is not None
    ]


def _outline(objects: list[Points], config: LocationConfig) -> F64 | None:
    xy = np.concatenate(objects)[:, :2]
    cell = config.cell_m / 2
    reach = max(1, round(config.close_m / cell))
    grid = floor_grid(np.concatenate((xy - config.close_m, xy + config.close_m)), cell)
    outline = grid.outline(close_gaps(grid.image(xy), reach))
    area = cv2.contourArea(outline.astype(np.float32))
    length = cv2.arcLength(outline.astype(np.float32), True)
    if area < config.min_area_m2 or 4 * np.pi * area < config.compactness * length**2:
        return None
    return outline
