"""The surface that supports a tear: a face or any other, at rest or in a frame, with its down direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy import Eyeball, Face, millimeters
from ..array_types import Array, IntArray
from ..checks import vector
from ..errors import MeshError, ParameterError, check_name, check_range
from ..geometry import BoxTree, interpolated, vertex_normals
from ..mesh import MeshLike, is_frame, rest_of, surface_in


@dataclass(frozen=True, eq=False)
class BoundPoints:
    """Points that move with the triangles they are bound to.

    Attributes
    ----------
    corners : ndarray of int32, shape (n, 3)
        Vertices of the triangle of each point.
    weights : ndarray, shape (n, 3)
        Barycentric coordinates.

    Examples
    --------
    A point on an upright sheet, and where it is when the sheet is 5 mm further in front:

    >>> import pyvista as pv
    >>> sheet = support_surface(pv.Plane(i_size=20, j_size=20))
    >>> bound = sheet.bound(np.array([[3.3, 4.5, 6.0]]))
    >>> bound.at(sheet.points + [0, 0, 5]).round(3)
    array([[3.3, 4.5, 5. ]])
    """

    corners: IntArray
    weights: Array

    def at(self, points: Array) -> Array:
        """Return the points (n, 3) for vertices at `points`."""
        return interpolated(np.ascontiguousarray(points, np.float64), self.corners, self.weights)


@dataclass(frozen=True, eq=False)
class SupportSurface:
    """A surface at rest, or as it is in a frame, as arrays.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int32, shape (m, 3)
    down, forward : ndarray, shape (3,)
        Unit directions, orthogonal: that in which water falls, and away from the surface.
    unit : float
        Millimeters per unit.
    face : Face, optional

    Examples
    --------
    The point of an upright sheet that is nearest to one in front of it, and the directions down and forward:

    >>> import pyvista as pv
    >>> sheet = support_surface(pv.Plane(i_size=20, j_size=20))
    >>> cells, points = sheet.nearest(np.array([[3.3, 4.5, 6.0]]))
    >>> points.round(3), sheet.down, sheet.forward
    (array([[3.3, 4.5, 0. ]]), array([ 0., -1.,  0.]), array([0., 0., 1.]))
    """

    points: Array
    triangles: IntArray
    down: Array
    forward: Array
    unit: float
    face: Face | None = None

    @cached_property
    def normals(self) -> Array:
        """Unit vertex normals (n, 3)."""
        return vertex_normals(self.points, self.triangles)

    @cached_property
    def _tree(self) -> BoxTree:
        return BoxTree(self.points, self.triangles)

    @property
    def size(self) -> float:
        """Diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    def check_size(self, size: float) -> None:
        """Raise a ParameterError for a tear of a size that is too large for the surface."""
        share = 0.15  # of the diagonal
        largest = share * self.size
        if size > largest:
            raise ParameterError(
                f"a tear must be smaller than {share} of the surface, {largest * self.unit:.3g} mm, received "
                f"{size * self.unit:.3g} mm. Are the units of the surface right?"
            )

    def nearest(self, points: Array) -> tuple[IntArray, Array]:
        """Return the triangles (n,) and the points (n, 3) of the surface that are nearest to points (n, 3)."""
        cells, weights, _ = self._tree.closest(points)
        return cells, interpolated(self.points, self.triangles[cells], weights)

    def bound(self, points: Array) -> BoundPoints:
        """Bind the points of the surface that are nearest to points (n, 3)."""
        cells, weights, _ = self._tree.closest(points)
        return BoundPoints(self.triangles[cells], weights)

    def in_frame(self, on: pv.PolyData | None) -> tuple[SupportSurface, Array]:
        """Return the surface as it is in a frame, and the vertices (n, 3) of the frame at rest; None means at rest.

        Raises
        ------
        MeshError
            If `on` is no frame of this surface, or its points are not finite.
        """
        if on is None:
            return self, self.points
        if not isinstance(on, pv.PolyData):
            raise MeshError(f"a frame must be a PolyData, such as a simulation gives, received {type(on).__name__}.")
        points, triangles = np.asarray(on.points, dtype=np.float64), np.asarray(on.regular_faces, dtype=np.int32)
        itself = np.array_equal(points, self.points)  # also a frame that the surface was made from
        rest = rest_of(on) if is_frame(on) and not itself else None
        if rest is None and len(points) != len(self.points):
            raise MeshError(
                f"the frame must have the {len(self.points)} points of the surface at rest, or an array 'rest', "
                f"received {len(points)} points. Is it one of another surface?"
            )
        if not np.isfinite(points).all():
            raise MeshError("the points of the frame must be finite. Did the simulation break down?")
        moved = replace(self, points=points, triangles=triangles)
        return moved, self.points if rest is None else rest

    def start(self, start: Any, allowed: float) -> Array:
        """Return the point (3,) of the surface nearest to `start`, or on the lower lid of an eye, "l" or "r".

        Raises
        ------
        UnknownNameError
            For a name that is not that of an eye.
        ParameterError
            If `start` is not three finite coordinates, or is farther from the surface than `allowed`.
        """
        if isinstance(start, str):
            if self.face is None:
                raise ParameterError("the side of an eye can only be named on a Face; on another surface give a point.")
            return lid_point(self.face, start)
        point = vector("start", start)
        _, found = self.nearest(point[None])
        gap = float(np.linalg.norm(found[0] - point))
        if gap > allowed:
            raise ParameterError(
                f"start must lie on the surface, received {point}, which is {gap:.3g} away from it (at most "
                f"{allowed:.3g} is allowed). Are point and surface in the same unit and coordinates?"
            )
        return np.asarray(found[0])


def support_surface(
    surface: Face | MeshLike, down: npt.ArrayLike | None = None, units: str | float = "mm"
) -> SupportSurface:
    """Return a face or any other mesh as a support surface.

    Parameters
    ----------
    surface : Face, or what :func:`facewrinkle.read_surface` takes
    down : array_like, shape (3,), optional
        Default: down the face; -y on other surfaces.
    units : {"um", "mm", "cm", "dm", "m", "in"} or float
        Unit of a surface that is no Face, which knows its own; or millimeters per unit.

    Examples
    --------
    A sheet in centimeters where z is up:

    >>> import pyvista as pv
    >>> sheet = support_surface(pv.Plane(direction=(0, 1, 0)), down=(0, 0, -1), units="cm")
    >>> sheet.down, sheet.unit, sheet.face is None
    (array([ 0.,  0., -1.]), 10.0, True)
    """
    face = surface if isinstance(surface, Face) and surface.landmarks else None
    if isinstance(surface, Face):
        points, triangles, unit = surface.points, surface.triangles, surface.unit
    else:
        source = surface_in(surface)
        points, triangles = source.points, source.triangles.astype(np.int32)
        if not len(triangles) or not np.isfinite(points).all():
            raise MeshError("a surface for tears needs triangles and finite points.")
        unit = millimeters(units)
    if face is None:
        return SupportSurface(points, triangles, *directions(down), unit)
    return SupportSurface(
        points, triangles, *directions(-face.frame.axes[1] if down is None else down, face.frame.axes[2]), unit, face
    )


def directions(down: npt.ArrayLike | None, forward: Array | None = None) -> tuple[Array, Array]:
    """Return the unit vectors down (default -y) and, orthogonal to it, forward (default +z)."""
    falling = vector("down", (0.0, -1.0, 0.0) if down is None else down)
    length = float(np.linalg.norm(falling))
    if not length > 0.0:
        raise ParameterError("down must not be zero.")
    falling = falling / length
    ahead = np.array([0.0, 0.0, 1.0]) if forward is None else forward
    if np.linalg.norm(np.cross(ahead, falling)) < 1e-3:
        ahead = np.array([1.0, 0.0, 0.0])
    ahead = ahead - (ahead @ falling) * falling
    return falling, ahead / np.linalg.norm(ahead)


def lid_point(face: Face, side: str, along: float = 0.5) -> Array:
    """Return a point on the margin of the lower lid.

    Parameters
    ----------
    face : Face
    side : {"l", "r"}
        The subject's own left or right.
    along : float
        From the inner (0) to the outer (1) corner of the eye.

    Returns
    -------
    ndarray, shape (3,)
        On a closed eye, a point of the line along which its lids meet, which sags between the corners.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> bool(lid_point(face, "l")[0] > lid_point(face, "r")[0])
    True
    """
    sides = {"l": "l", "r": "r", "left": "l", "right": "r"}
    check_name("side", side, sides)
    side, along = sides[side], check_range("along", along, 0.0, 1.0)
    if not face.eyes:
        raise ParameterError("the face has no eyes: it was made without landmarks. Give a point instead.")
    eye = next(eye for eye in face.eyes if eye.side == side)
    inner, outer = face.landmarks[f"eye_{side}_inner"], face.landmarks[f"eye_{side}_outer"]
    opening = face.eyelid_openings.get(eye.side)
    if opening is None:
        return _on_shut_lids(face, eye, inner, outer, along)
    across = (outer - inner) / ((outer - inner) @ (outer - inner))
    margin = face.points[opening.lower]
    position = (margin - inner) @ across
    return np.array([np.interp(along, position, coordinate) for coordinate in margin.T])


def _on_shut_lids(face: Face, eye: Eyeball, inner: Array, outer: Array, along: float) -> Array:
    """Return a point where closed lids meet: they bulge out in front of the line between the corners."""
    width = float(np.linalg.norm(outer - inner))
    point = eye.slit(inner, outer, along)[0]
    seen, _ = face.mesh.ray_trace(point + 2.0 * width * eye.gaze, point - 2.0 * width * eye.gaze)
    if len(seen):
        return np.asarray(seen[np.argmax(seen @ eye.gaze)], dtype=np.float64)
    return np.asarray(support_surface(face).nearest(point[None])[1][0])
