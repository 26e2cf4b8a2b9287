"""Vertices that carry a pattern: those that are selected, and the valid ones among them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ...anatomy.face import Face
from ...array_types import Array, BoolArray
from ...errors import MeshError, unknown_name
from ...geometry.morton import morton_order
from ...geometry.topology import vertex_rings


def valid_vertices(chart: Array, inside: BoolArray, share: float, seed: int) -> Array:
    """Return 1 for ``round(share N)`` of the N vertices inside, chosen at random but evenly over the area, else 0.

    The vertices are put in the order of Morton's curve, which fills the plane, and cut into as many runs as vertices
    are to be chosen; each run gives one. A refined mesh interpolates these values, so that
    nothing is drawn again.

    Parameters
    ----------
    chart : ndarray, shape (n, 2)
    inside : ndarray of bool, shape (n,)
    share : float
    seed : int

    Examples
    --------
    >>> grid = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0)), axis=-1).reshape(-1, 2)
    >>> chosen = valid_vertices(grid, np.ones(64, bool), 0.25, seed=1)
    >>> int(chosen.sum()), int(chosen[(grid < 4).all(axis=1)].sum())
    (16, 4)
    """
    candidates = np.flatnonzero(inside)
    count = round(share * len(candidates))
    if share == 1.0 or count == 0:
        return np.full(len(chart), float(share == 1.0))
    uv = np.nan_to_num(chart[candidates])
    low, span = uv.min(axis=0), np.maximum(np.ptp(uv, axis=0), 1e-300)
    order = morton_order(((uv - low) / span * 65535.0).astype(np.int64), bits=16)
    edges = np.arange(count + 1) * len(candidates) // count
    drawn = edges[:-1] + (np.random.default_rng(seed).random(count) * np.diff(edges)).astype(int)
    out = np.zeros(len(chart))
    out[candidates[order[drawn]]] = 1.0
    return out


def selection_weights(select: npt.ArrayLike | str, face: Face, border: float) -> Array:
    """Return the weights (n,) of a selection: as painted, or rising from 0 to 1 over the share `border` of its depth.

    Parameters
    ----------
    select : array_like or str
        See :class:`facewrinkle.Region`.
    face : Face
    border : float

    Raises
    ------
    UnknownNameError
        If the mesh has no such point data.
    MeshError
        If the selection does not fit the mesh.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> weights = selection_weights(face.points[:, 1] > 40.0, face, border=0.5)
    >>> float(weights.min()), float(weights.max())
    (0.0, 1.0)
    """
    if isinstance(select, str):
        if select not in face.mesh.point_data:
            raise unknown_name("point data", select, face.mesh.point_data)
        values = np.asarray(face.mesh.point_data[select])
    else:
        values = _on_face(np.asarray(select), face)
    if values.shape != (len(face.points),):
        raise MeshError(
            f"a selection must have one value for each of the {len(face.points)} points, received {values.shape}."
        )
    if not np.isfinite(values).all() or values.min() < 0.0 or values.max() > 1.0:
        raise MeshError("a selection must be vertices, bools, or weights in [0, 1]; others, or NaN, were received.")
    if not (values > 0).any():
        raise MeshError("the selection holds no vertex.")
    if values.dtype.kind == "f":
        return values.astype(np.float64)
    chosen = values.astype(bool)
    if chosen.all():
        return np.ones(len(chosen))
    inward = cKDTree(face.points[~chosen]).query(face.points)[0]
    offsets, ring = vertex_rings(face.triangles, len(chosen))
    step = np.linalg.norm(face.points[ring] - np.repeat(face.points, np.diff(offsets), axis=0), axis=1)
    return np.clip(inward / max(border * inward.max(), float(np.median(step))), 0.0, 1.0)


def _on_face(values: np.ndarray, face: Face) -> np.ndarray:
    """A selection of the original mesh's vertices, as one of the face's."""
    if values.size == 0:
        raise MeshError("the selection holds no vertex.")
    numbers = face.source_points
    if numbers is not None and numbers.min() < 0:
        raise MeshError(
            "the mesh of this face was reconstructed: it has other vertices than the one that was given. Select "
            "vertices of face.mesh, by weights or bools of all of them."
        )
    given = len(face.points) if numbers is None else int(numbers.max()) + 1
    if values.dtype.kind in "iu" and values.ndim == 1:
        if len(values) and (values.min() < 0 or (numbers is None and values.max() >= given)):
            raise MeshError(f"selected vertices must be 0 to {given - 1}, received {values.min()} to {values.max()}.")
        return np.isin(np.arange(given) if numbers is None else numbers, values)
    if values.dtype.kind not in "bf" or values.ndim != 1:
        raise MeshError(f"a selection must be vertices, bools or weights, received {values.dtype} of {values.shape}.")
    return values[numbers] if numbers is not None and len(values) >= given else values
