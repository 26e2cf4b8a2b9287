"""Places where a surface runs through itself: reported, and smoothed on request."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ...array_types import Array, IntArray
from ...geometry import topology
from ...geometry.laplacian import neighbour_mean
from ...geometry.self_intersections import intersection_sites, self_intersections
from .topology_repair import RepairedMesh, degenerate

SMALL = 0.1
"""Places smaller than this share of the surface are smoothed: lips that press on each other are larger."""

ROUNDS = 12
"""The most rounds of smoothing."""

STEPS = 4
"""Smoothing steps in each round."""


def self_intersection_report(points: Array, triangles: NDArray[np.integer]) -> str:
    """Return a sentence that says where a surface runs through itself; empty if it does not."""
    places = intersection_sites(self_intersections(points, triangles), triangles)
    if not places:
        return ""
    where = points[triangles[places[0]]].mean(axis=(0, 1))
    where[np.abs(where) < 1e-6 * np.ptp(points, axis=0).max()] = 0.0
    count = sum(map(len, places))
    at = f"{len(places)} places" if len(places) > 1 else "one place"
    largest = f"the largest, of {len(places[0])}, is" if len(places) > 1 else "it is"
    return (
        f"The surface runs through itself at {at}, with {count} of {len(triangles)} triangles; {largest} about "
        f"({', '.join(f'{x:.4g}' for x in where)})."
    )


def resolved(mesh: RepairedMesh) -> RepairedMesh:
    """Smooth the mesh at small places where it runs through itself, as much as it takes.

    Points at such places move to the mean of their neighbours; if this is not enough, the points around them join in,
    round by round. Places that cannot be resolved are left as they were; so are borders, and places larger than
    `SMALL`.
    """
    triangles, points = mesh.triangles, mesh.points.copy()
    edges, sides = topology.unique_edges(triangles)
    held = np.zeros(len(points), bool)
    held[edges[np.bincount(sides.ravel()) == 1]] = True
    reach = SMALL * float(np.linalg.norm(np.ptp(points[np.unique(triangles)], axis=0)))
    crossed = []
    for place in intersection_sites(self_intersections(points, triangles), triangles):
        if _extent(points[np.unique(triangles[place])]) > reach:
            held[triangles[place]] = True
        else:
            crossed.append(place)
    count, mean, moved = len(crossed), neighbour_mean(edges, len(points)), np.zeros(len(points), bool)
    for again in range(ROUNDS):
        if not crossed:
            break
        near = np.zeros(len(points), bool)
        near[triangles[np.concatenate(crossed)]] = True
        if again:
            near[edges[near[edges].any(axis=1)]] = True
        moved |= near & ~held
        for _ in range(STEPS):
            points[moved] = mean[moved] @ points
        places = intersection_sites(self_intersections(points, triangles), triangles)
        crossed = [place for place in places if not held[triangles[place]].all()]
    if len(crossed) == count:
        return mesh
    label = _pieces(edges[moved[edges].all(axis=1)], len(points))
    failed = np.unique(label[triangles[np.concatenate(crossed)]]) if crossed else np.zeros(0, int)
    moved &= ~np.isin(label, failed)
    points[~moved] = mesh.points[~moved]
    if not moved.any() or degenerate(points, triangles).any():
        return mesh
    far = float(np.linalg.norm(points - mesh.points, axis=1).max())
    return replace(mesh, points=points).reported(
        f"Smoothed the surface where it ran through itself: {int(moved.sum())} points, by {far:.3g} at most; "
        f"places small enough to try: {count}, that stay: {len(crossed)}."
    )


def _extent(places: Array) -> float:
    """Robust size of a set of points, which a few outliers do not change."""
    return 4.0 * float(np.median(np.linalg.norm(places - np.median(places, axis=0), axis=1)))


def _pieces(edges: NDArray[np.integer], n: int) -> IntArray:
    """Number (n,) of the connected piece of the graph that each vertex belongs to."""
    links = csr_array((np.ones(len(edges), np.int8), edges.T), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1])
