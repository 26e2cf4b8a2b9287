"""Layers: each displaces the moving surface along its normals and asks for the triangles that this needs.

What layers return is checked: they may be anyone's, and loops in machine code trust the lengths of arrays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from ..anatomy import Face
from ..array_types import Array, BoolArray, IntArray
from ..checks import plain_and_finite
from ..errors import LARGEST, ParameterError, type_of
from ..geometry import Change, RedGreenForest, frozen, interpolated, normalize, vertex_areas
from ..mesh.arrays import ARRAYS
from .compression import StrainField, compression_along, principal_compression

FINEST = 8
"""The most times that a triangle is ever split."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of the surface at rest: where the vertices of the refined mesh lie, or those that were just created.

    Attributes
    ----------
    points, normals : ndarray, shape (n, 3)
        Rest positions, in the unit of the face, and unit normals.
    corners : ndarray of int32, shape (n, 3)
        Base vertices around each point.
    barycentric : ndarray, shape (n, 3)
        Their weights.
    host : ndarray of int32, shape (n,)
        A base triangle that the point lies in.

    Examples
    --------
    The middle of the first triangle of a mesh:

    >>> points, triangles = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]]), np.array([[0, 1, 2]], np.int32)
    >>> thirds, up = np.full((1, 3), 1 / 3), np.array([[0.0, 0, 1]])
    >>> middle = SurfacePoints(thirds @ points, up, triangles, thirds, np.zeros(1, np.int32))
    >>> interpolated(points, middle.corners, middle.barycentric).round(9)
    array([[1., 1., 0.]])
    """

    points: Array
    normals: Array
    corners: IntArray
    barycentric: Array
    host: IntArray

    def __post_init__(self) -> None:
        for name in ("corners", "barycentric"):  # read-only always, else machine code is made for both
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @classmethod
    def of_forest(cls, forest: RedGreenForest, points: Array, normals: Array, first: int = 0) -> Self:
        """Return the vertices of a refined mesh, from number `first` on, given base vertices and normals (n0, 3)."""
        corners, barycentric = forest.corners[first:], forest.barycentric[first:]
        upright = interpolated(normals, corners, barycentric)
        normalize(upright)
        return cls(interpolated(points, corners, barycentric), upright, corners, barycentric, forest.host[first:])

    def taken(self, some: slice | IntArray) -> Self:
        """Return some of the points."""
        return type(self)(*(column[some] for column in vars(self).values()))

    def followed(self, kept: slice | IntArray, new: Self) -> Self:
        """Return the points that live on, then the new ones."""
        columns = zip(vars(self.taken(kept)).values(), vars(new).values(), strict=True)
        return type(self)(*map(np.concatenate, columns))


@dataclass(frozen=True, eq=False)
class SurfaceState:
    """The bare surface (moved, but not displaced by layers) at one time.

    Attributes
    ----------
    rates : ndarray, shape (k,)
        Contraction rates of the face's muscles; empty where the motion is not driven by muscles.
    vertices : SurfacePoints
        All vertices, at rest.
    triangles : ndarray of int32, shape (m, 3)
    base, bare : ndarray, shape (n0, 3) and (n, 3)
        Positions of the base mesh and of the refined one, mm.
    time : float
        Seconds since the start.
    strain_field : callable, optional
        Returns the :class:`facewrinkle.layers.compression.StrainField` of the base mesh.

    Notes
    -----
    The compression of the bare surface is measured when a layer first asks for it, once for all layers.

    Examples
    --------
    A sheet compressed by a fifth along x:

    >>> sheet, triangles = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)
    >>> corners, up = np.repeat(triangles, 3, axis=0), np.tile([0.0, 0, 1], (3, 1))
    >>> vertices = SurfacePoints(sheet, up, corners, np.eye(3), np.zeros(3, np.int32))
    >>> field, moved = StrainField(sheet, triangles), sheet * [0.8, 1, 1]
    >>> state = SurfaceState(np.empty(0), vertices, triangles, moved, moved, strain_field=lambda: field)
    >>> state.compression(np.array([1.0, 0, 0])).round(9)
    array([0.2, 0.2, 0.2])
    """

    rates: Array
    vertices: SurfacePoints
    triangles: IntArray
    base: Array
    bare: Array
    time: float = 0.0
    strain_field: Callable[[], StrainField] | None = None

    @cached_property
    def strain(self) -> Array:
        """Change of the metric (n0, 6) at the base vertices: xx, yy, zz, yz, xz, xy; exactly 0 at rest."""
        return self._field().strain(self.base)

    @cached_property
    def strain_at_vertices(self) -> Array:
        """The same (n, 6), interpolated at all vertices."""
        return interpolated(self.strain, self.vertices.corners, self.vertices.barycentric)

    @cached_property
    def areas(self) -> Array:
        """A third of the area of the triangles around each vertex (n,) of the bare surface, mm^2."""
        return vertex_areas(self.bare, self.triangles)

    def compression(self, directions: Array) -> Array:
        """Return ``1 - |F m|`` (n,) along directions (n, 3) or (3,); only their part in the rest surface counts."""
        return compression_along(self.strain_at_vertices, self._metric, self.vertices.normals, directions)

    @cached_property
    def principal_compression(self) -> tuple[Array, Array]:
        """The largest compression over all tangents (n,), negative where all are stretched, and the unit tangent of
        the rest surface that has it (n, 3).
        """
        return principal_compression(self.strain_at_vertices, self._metric, self.vertices.normals)

    @cached_property
    def _metric(self) -> Array:
        """Rest metric (n, 6) at the vertices."""
        return interpolated(self._field().metric, self.vertices.corners, self.vertices.barycentric)

    def _field(self) -> StrainField:
        if self.strain_field is None:
            raise ParameterError("a SurfaceState measures compression only with a strain_field; it was made without.")
        return self.strain_field()


@dataclass(frozen=True, eq=False)
class Displacement:
    """Heights that a layer adds to the bare surface at one time, and the triangles that they need.

    Attributes
    ----------
    height : ndarray, shape (n,)
        Along the normals, mm.
    spacing : ndarray, shape (n,)
        Half the wavelength of the finest detail at each vertex, in the unit of the face; infinite where none is needed.
    across : ndarray, shape (n, 3)
        Unit direction in which the wavelength is measured.
    active : ndarray of bool, shape (n,)
        True where the layer may displace the surface; the mesh is refined nowhere else.
    shading_offset : ndarray, shape (n,), optional
        Added to `height`, mm, only for the shading normals: those that a frame is drawn with. The points do not move.
        A layer whose details are sharper than the mesh gives the difference to its heights averaged over the distance
        of the vertices (prefiltered); the normals of the heights themselves would be uneven along a sharp furrow.
    undeformed : bool
        True for heights along the normals of the undeformed surface that no bound lowers, as printed (Section 4.3). It
        holds if all layers say so.

    Examples
    --------
    A furrow at the first of two vertices, where waves 2 mm long run along x; the second needs no triangles:

    >>> across = np.array([[1.0, 0, 0], [0, 0, 0]])
    >>> furrow = Displacement(np.array([-0.4, 0]), np.array([1.0, np.inf]), across, np.array([True, False]))
    >>> furrow.spacing[furrow.active]
    array([1.])
    """

    height: Array
    spacing: Array
    across: Array
    active: BoolArray
    shading_offset: Array | None = None
    undeformed: bool = False


class Layer(ABC):
    """A layer follows the mesh (`attach` once, `follow` whenever vertices come and go) and displaces it.

    Derive from this class. `attach`, `follow`, `displacement` and `fields` must be written, or Python refuses to make
    the layer; all else has a default.

    Attributes
    ----------
    age_shown : float, optional
        The age, in [0, 1], of lines that the layer draws, which pictures show in the relief of the skin, too.
    timeless : bool
        True if the same surface always has the same heights and fields: while it does not move, the layer is not asked
        for them again. Default: False.

    Examples
    --------
    Pores, the smallest layer: they never change and ask for no triangles.

    >>> class Pores(Layer):
    ...     def attach(self, face):
    ...         self.height = np.empty(0)
    ...     def follow(self, change, created):
    ...         pit = np.sin(3.0 * created.points).prod(axis=1) > 0.5
    ...         self.height = np.concatenate([self.height[change.kept], -0.05 * pit])
    ...     def displacement(self, state):
    ...         n = len(self.height)
    ...         return Displacement(self.height, np.full(n, np.inf), np.zeros((n, 3)), np.zeros(n, bool))
    ...     def fields(self):
    ...         return {"pores": self.height}
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> frame = fw.Simulation(face, layers=[Pores()], motion=fw.Still(face)).step()
    >>> float(frame["pores"].min()), float(frame["W"].min())
    (-0.05, -0.05)
    """

    timeless: bool = False

    def __repr__(self) -> str:
        plain = {name: value for name, value in vars(self).items() if isinstance(value, int | float | str)}
        words = (f"{name}={value!r}" for name, value in plain.items() if not name.startswith("_"))
        return f"{type(self).__name__}({', '.join(words)})"

    @property
    def age_shown(self) -> float | None:
        """The age of the lines; None if there are none."""
        return None

    def prepare(self, face: Face, motions: Callable[[Any], Any]) -> None:  # noqa: B027 (by default, nothing)
        """Take what is needed of the motions of the face, before levels are asked for; default: nothing.

        ``motions(families)`` finds the shapes of the face in full motion:
        :func:`facewrinkle.simulation.fold_layers.fold_shapes`.
        """

    def level_needed(self, face: Face) -> int:
        """Return how often triangles have to be split, at most, to carry the layer on a face; default: 0."""
        return 0

    def check_level(self, needed: int, level: int) -> None:  # noqa: B027 (by default, nothing)
        """Warn, or raise a ParameterError, if triangles that are split `level` times cannot carry a layer that needs
        another number, see `level_needed`; default: neither.
        """

    @abstractmethod
    def attach(self, face: Face) -> None:
        """Forget everything and prepare for `face`, whose vertices come with the first call of `follow`."""

    @abstractmethod
    def follow(self, change: Change, created: SurfacePoints) -> None:
        """Keep what belongs to the vertices that live on (``change.kept``), and evaluate the new ones."""

    @abstractmethod
    def displacement(self, state: SurfaceState) -> Displacement:
        """Return the heights and the spacing they need; called again at the same time after triangles were split."""

    @abstractmethod
    def fields(self) -> dict[str, np.ndarray]:
        """Return arrays for the point data of the frame, as of the last call of `displacement`."""

    def fields_of(self, muscle: int) -> dict[str, np.ndarray] | None:
        """Return the same of the folds of one muscle, given by its number; None, the default, if none are its own."""
        return None


# --- what layers return -------------------------------------------------------------------------------


def displacement_of(layer: Layer, state: SurfaceState) -> Displacement:
    """Return the displacement by a layer; raise a ParameterError that names it for arrays of another shape or type.

    Heights, shading offsets and directions must be finite, spacings greater than 0.

    Examples
    --------
    >>> class Broken:
    ...     def displacement(self, state):
    ...         return Displacement(np.zeros(2), np.ones(2), np.zeros((2, 3)), np.zeros(2, bool))
    >>> place = SurfacePoints(*np.zeros((2, 1, 3)), np.zeros((1, 3), np.int32), np.ones((1, 3)), np.zeros(1, np.int32))
    >>> displacement_of(Broken(), SurfaceState(np.empty(0), place, place.corners, place.points, place.points))
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: the spacing of a layer (Broken) must have the shape (1,), received (2,).
    """
    found, n = layer.displacement(state), len(state.bare)
    if not isinstance(found, Displacement):
        raise ParameterError(
            f"displacement() of a layer ({type(layer).__name__}) must return a Displacement, received "
            f"{type_of(found)}. Return Displacement(height, spacing, across, active) of facewrinkle.layers.base."
        )
    checked: dict[str, Any] = {
        "spacing": np.asarray(found.spacing, np.float64, order="C"),
        "active": np.asarray(found.active, bool, order="C"),
    }
    called = f"of a layer ({type(layer).__name__})"
    if not (checked["spacing"] > 1.0 / LARGEST).all():
        raise ParameterError(f"the spacing {called} must be greater than 0. Infinity asks for no triangles.")
    for name in ("height", "across", "shading_offset"):
        if name != "shading_offset" or found.shading_offset is not None:
            checked[name] = plain_and_finite(f"the {name} {called}", getattr(found, name))
    for name, values in checked.items():
        shape = (n, 3) if name == "across" else (n,)
        if values.shape != shape:
            raise ParameterError(f"the {name} {called} must have the shape {shape}, received {values.shape}.")
    return replace(found, **checked)


def fields_of(layer: Layer, n: int) -> dict[str, npt.NDArray[Any]]:
    """Return the point data of a layer on n vertices; raise a ParameterError that names it for anything else.

    Examples
    --------
    >>> class Broken:
    ...     def fields(self):
    ...         return {"depth": np.zeros(2)}
    >>> fields_of(Broken(), 3)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: the field 'depth' of a layer (Broken) must have a number, or a row of numbers,
    for each of the 3 vertices, received float64 of the shape (2,).
    """
    found, out = layer.fields(), dict[str, npt.NDArray[Any]]()
    if not isinstance(found, Mapping):
        raise ParameterError(
            f"fields() of a layer ({type(layer).__name__}) must return a dictionary of names and arrays, received "
            f"{type_of(found)}. Return {{}} if there are none."
        )
    for name, given in found.items():
        values = np.asarray(given)
        rows = values.dtype.kind in "biuf" and values.ndim in (1, 2) and len(values) == n and values.shape[1:] != (0,)
        asked, shape = "a number, or a row of numbers,", values.shape
        if name in ("Normals", "rest"):  # all other arrays of a frame have one number for each vertex
            asked, shape = "three numbers", (n, 3)
        elif name in ARRAYS:
            asked, shape = "a number", (n,)
        if not rows or values.shape != shape:
            raise ParameterError(
                f"the field {name!r} of a layer ({type(layer).__name__}) must have {asked} for each of the {n} "
                f"vertices, received {values.dtype} of the shape {values.shape}."
            )
        out[name] = values
    return out


def over(below: Mapping[str, npt.NDArray[Any]], fields: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Return the point data of a layer, with that of the layers below where it has none itself: no muscle, no strain.

    Examples
    --------
    >>> below = {"muscle": np.array([3, -1]), "lambda": np.array([0.5, 0.0])}
    >>> found = over(below, {"muscle": np.array([-1, 4]), "lambda": np.array([0.0, 0.2])})
    >>> found["muscle"].tolist(), found["lambda"].tolist()
    ([3, 4], [0.5, 0.2])
    """
    of_muscle = fields["muscle"] >= 0 if "muscle" in fields and "muscle" in below else None
    out = dict(fields)
    for name in ("lambda", "gamma", "epsilon", "muscle"):
        if name in fields and name in below:
            own = fields[name] != 0 if of_muscle is None else of_muscle
            out[name] = np.where(own, fields[name], below[name])
    return out
