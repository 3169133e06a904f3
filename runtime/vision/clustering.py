"""Density clusters of points (DBSCAN) with a KD-tree."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from placegraph.runtime.arrays import I64, Points


def dbscan(points: Points, eps: float, min_points: int) -> I64:
    """Cluster labels (N,) of points (N, D), numbered from 0 by their first point; -1 is noise.

    A core point has at least `min_points` points within `eps`, itself included.
    Source: Ester et al. 1996. Not as in the paper: a border point joins its nearest core point's cluster, which makes
    the result independent of the order of visits.
    """
    labels = np.full(len(points), -1, np.int64)
    if not len(points):
        return labels
    pairs = cKDTree(points).query_pairs(eps, output_type="ndarray")
    degree = 1 + np.bincount(pairs.ravel(), minlength=len(points))
    core = np.flatnonzero(degree >= min_points)
    if not len(core):
        return labels
    position = np.full(len(points), -1)
    position[core] = np.arange(len(core))
    core_pairs = position[pairs[(position[pairs] >= 0).all(axis=1)]]
    links = coo_matrix(
        (np.ones(len(core_pairs), bool), (core_pairs[:, 0], core_pairs[:, 1])), shape=(len(core), len(core))
    )
    _, core_labels = connected_components(links, directed=False)
    border = np.flatnonzero(degree < min_points)
    upper_bound = np.nextafter(eps, np.inf)  # scipy excludes the bound itself, which a core point's reach includes
    distance, nearest = cKDTree(points[core]).query(points[border], distance_upper_bound=upper_bound)
    labels[core] = core_labels
    near = np.isfinite(distance)
    labels[border[near]] = core_labels[nearest[near]]
    return _number_by_first_point(labels)


def _number_by_first_point(labels: I64) -> I64:
    unique, first = np.unique(labels[labels >= 0], return_index=True)
    renumber = np.empty(len(unique), np.int64)
    renumber[np.argsort(first)] = np.arange(len(unique))
    renumbered = labels.copy()
    renumbered[labels >= 0] = renumber[labels[labels >= 0]]
    return renumbered


def main_clusters(points: Points, eps: float, min_points: int, share: float) -> I64:
    """Indices of the points in all clusters with at least `share` of the largest one's size; empty if all are noise."""
    labels = dbscan(points, eps, min_points)
    if not (labels >= 0).any():
        return np.zeros(0, np.int64)
    sizes = np.bincount(labels[labels >= 0])
    return np.flatnonzero((labels >= 0) & (sizes >= share * sizes.max())[labels])
