"""What a layer is: something laid on the moving surface that displaces it along its normals and asks for triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..errors import ParameterError
from ..geometry.interpolation import interpolated
from ..geometry.refinement import Change
from .compression import StrainField, compression_along, principal_compression

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Places on the rest surface, as many as there are (new) vertices.

    Attributes
    ----------
    points, normals : ndarray, shape (n, 3)
        Rest positions, in the unit of the face, and unit normals.
    corners : ndarray of int32, shape (n, 3)
    barycentric : ndarray, shape (n, 3)
        Base vertices around the place and their weights.
    host : ndarray of int32, shape (n,)
        A base triangle that it lies in.

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


@dataclass(frozen=True, eq=False)
class SurfaceState:
    """The bare (moved, not displaced) surface at one moment.

    Attributes
    ----------
    rates : ndarray, shape (k,)
        Contraction rates of the face's muscles; empty where the motion is not driven by muscles.
    vertices : SurfacePoints
        Of all vertices.
    triangles : ndarray of int32, shape (m, 3)
    base, bare : ndarray, shapes (n0, 3) and (n, 3)
        Positions of the base mesh and of the refined one, mm.
    time : float
        Seconds since the beginning.
    directions : ndarray, shape (n, 3), optional
        Unit normals of the bare surface, along which heights displace it.
    strain_field : callable, optional
        Gives the :class:`facewrinkle.layers.compression.StrainField` of the base mesh.

    Notes
    -----
    How far the bare surface is compressed is measured when a layer first asks for it, once for all layers.

    Examples
    --------
    A sheet that is pressed together by a fifth from the side, and what a layer learns of it:

    >>> sheet, triangles = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)
    >>> corners, up = np.repeat(triangles, 3, axis=0), np.tile([0.0, 0, 1], (3, 1))
    >>> sites = SurfacePoints(sheet, up, corners, np.eye(3), np.zeros(3, np.int32))
    >>> field, moved = StrainField(sheet, triangles), sheet * [0.8, 1, 1]
    >>> state = SurfaceState(np.empty(0), sites, triangles, moved, moved, strain_field=lambda: field)
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
    directions: Array | None = None

    @cached_property
    def strain(self) -> Array:
        """Change of the metric (n0, 6) at the base vertices: xx, yy, zz, yz, xz, xy; exactly 0 at rest."""
        return self._field().strain(self.base)

    def compression(self, directions: Array) -> Array:
        """``1 - |F m|`` (n,) along directions (n, 3) or (3,), of which the part in the rest surface counts."""
        return compression_along(*self._tensors, self.vertices.normals, directions)

    @cached_property
    def principal_compression(self) -> tuple[Array, Array]:
        """The largest compression over all tangents (n,), negative where all are stretched, and that unit tangent of
        the rest surface (n, 3).
        """
        return principal_compression(*self._tensors, self.vertices.normals)

    @cached_property
    def _tensors(self) -> tuple[Array, Array]:
        """Change of the metric and rest metric (n, 6) at the sites."""
        where = self.vertices.corners, self.vertices.barycentric
        return interpolated(self.strain, *where), interpolated(self._field().metric, *where)

    def _field(self) -> StrainField:
        if self.strain_field is None:
            raise ParameterError("a SurfaceState measures compression only with a strain_field; it was made without.")
        return self.strain_field()


@dataclass(frozen=True, eq=False)
class Displacement:
    """What a layer adds at a moment.

    Attributes
    ----------
    height : ndarray, shape (n,)
        Along the normals, mm.
    spacing : ndarray, shape (n,)
        Half the wavelength of the finest relief here, in the unit of the face; infinite where it needs no triangles.
    across : ndarray, shape (n, 3)
        Unit direction in which the wavelength is measured.
    active : ndarray of bool, shape (n,)
        Where the relief may be; the mesh is refined nowhere else.
    prefiltering : ndarray, shape (n,), optional
        Added to the heights, mm, for the normals alone: those of `height` would be uneven where it is sharper than
        vertices lie close.

    Examples
    --------
    A furrow at the first of two vertices, where waves 2 mm long run along x; the second needs no triangles:

    >>> across = np.array([[1.0, 0, 0], [0, 0, 0]])
    >>> relief = Displacement(np.array([-0.4, 0]), np.array([1.0, np.inf]), across, np.array([True, False]))
    >>> relief.spacing[relief.active]
    array([1.])
    """

    height: Array
    spacing: Array
    across: Array
    active: npt.NDArray[np.bool_]
    prefiltering: Array | None = None


class Layer(Protocol):
    """A layer follows the mesh (`attach` once, `follow` whenever vertices come and go) and gives its relief of a
    moment.

    Examples
    --------
    Pores, the smallest layer: they are the same at each moment and ask for no triangles.

    >>> class Pores:
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

    def attach(self, face: Face) -> None:
        """Forget everything and prepare for the vertices of `face`, which `follow` will bring."""

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """Drop what belongs to vertices that went, and evaluate the new ones."""

    def displacement(self, state: SurfaceState) -> Displacement:
        """Heights, and where triangles are needed; asked again at the same time where triangles were split for it."""

    def fields(self) -> dict[str, np.ndarray]:
        """Point data of the last moment."""
