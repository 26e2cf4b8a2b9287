"""Compression of creases: each takes in the skin of its whole width, and is as deep as that is compressed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..anatomy.muscles import Crease, Muscle
from ..array_types import Array, BoolArray
from ..geometry import closest_point as closest
from ..geometry.normals import vertex_normals
from ..geometry.refinement import frozen
from . import _kernels as kernels
from .compression import along, products

PLACES = 17
"""Number of places along a crease at which its compression is measured."""

ACROSS = (-0.125, 0.0, 0.125, 0.25)
"""Distances from the furrow, in widths, of the points whose compression is averaged there: over furrow and crest."""


EVEN = 0.2
"""Skin of a crease is compressed as one over this share of its length to either side (a standard deviation)."""


class Gathered:
    """The compression across the creases of a face, by the place along them.

    A crease is one fold. Its furrow and its crest are the same skin, so that both get the same compression, and no
    volume is made where the strain changes across the fold. Along it the compression is averaged with Gaussian weights:
    where skin folds deeply, it takes the skin beside it along.

    Parameters
    ----------
    face : Face
    muscles : list of Muscle
        Fold patterns of the face's muscles.
    zones : ndarray of bool, shape (k, m0)
        Base triangles that each muscle may touch.
    metric : ndarray, shape (n0, 6)
        Rest metric at the base vertices.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.layers.compression import StrainField
    >>> face = fw.default_face()
    >>> field = StrainField(face.points, face.triangles)
    >>> patterns = [muscle.fold_pattern for muscle in face.muscles.values()]
    >>> found = Gathered(face, patterns, face.zones, field.metric)
    >>> bool(found.epsilon(field.strain(0.9 * face.points)).round(9).min() == 0.1)
    True
    """

    def __init__(self, face: Face, muscles: list[Muscle], zones: BoolArray, metric: Array) -> None:
        points, triangles = face.points, face.triangles
        upright = vertex_normals(points, triangles)
        own = [k for k, muscle in enumerate(muscles) if isinstance(muscle, Crease) and zones[k].any()]
        self._row = np.full(len(muscles), -1)
        self._row[own] = np.arange(len(own))
        self._spans = np.array([getattr(muscle, "span", (0.0, 1.0)) for muscle in muscles]).reshape(-1, 2)
        corners, weights, tensors = [np.empty((0, 3), np.int32)], [np.empty((0, 3))], [np.empty((0, 6))]
        for k in own:
            crease, near = muscles[k], np.flatnonzero(zones[k])
            assert isinstance(crease, Crease)
            places = crease.points_at(*np.meshgrid(np.linspace(*crease.span, PLACES), ACROSS, indexing="ij"))
            inside = triangles[near]
            found = [closest.closest(points, inside, place) for place in places]
            at = inside[[triangle for triangle, _, _ in found]]
            share = np.array([barycentric for _, barycentric, _ in found])
            normal, rest = (np.einsum("pc,pck->pk", share, values[at]) for values in (upright, metric))
            across = crease.fold_direction(places)
            across -= (across * normal).sum(axis=1, keepdims=True) * normal / (normal**2).sum(axis=1, keepdims=True)
            corners.append(at)
            weights.append(share)
            tensors.append(products(across) / along(rest, across)[:, None])
        # Read-only, as those of vertices are: machine code for both is the same.
        self._corners, self._weights = frozen(np.concatenate(corners).astype(np.int32)), frozen(np.concatenate(weights))
        self._products = np.concatenate(tensors)
        self._starts = np.arange(len(self._products) + 1, dtype=np.int32)
        self._out = np.empty(len(self._products))
        places = np.linspace(0.0, 1.0, PLACES)
        even = np.exp(-0.5 * ((places[:, None] - places) / EVEN) ** 2)
        self._even = even / even.sum(axis=1, keepdims=True)

    def epsilon(self, strain: Array) -> Array:
        """Return the compression (creases, places) at a strain (n0, 6) of the base mesh."""
        kernels.strain_epsilon(self._starts, self._corners, self._weights, strain, self._products, self._out)
        return np.asarray(self._out.reshape(-1, PLACES, len(ACROSS)).mean(axis=2) @ self._even.T)

    def put(self, strain: Array, muscle: npt.NDArray[np.integer], coordinates: Array, epsilon: Array) -> None:
        """Write the compression of those entries that lie on creases into the compression (p,) of all.

        Entries are given by their muscles (p,) and their coordinates (p, 2) there: lambda, and one that is not used.
        """
        if len(self._products):
            kernels.put_gathered(muscle, coordinates, self._row, self._spans, self.epsilon(strain), epsilon)
