"""What a layer is: something laid on the moving surface that displaces it along its normals and asks for triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..geometry.refinement import Change

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Sites:
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
    """

    points: Array
    normals: Array
    corners: IntArray
    barycentric: Array
    host: IntArray


@dataclass(frozen=True, eq=False)
class Moment:
    """The bare (moved, not displaced) surface at one moment.

    Attributes
    ----------
    rates : ndarray, shape (k,)
        Contraction rates of the face's muscles.
    sites : Sites
        Of all vertices.
    triangles : ndarray of int32, shape (m, 3)
    base, bare : ndarray, shapes (n0, 3) and (n, 3)
        Positions of the base mesh and of the refined one, mm.
    """

    rates: Array
    sites: Sites
    triangles: IntArray
    base: Array
    bare: Array


@dataclass(frozen=True, eq=False)
class Relief:
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
    """

    height: Array
    spacing: Array
    across: Array
    active: npt.NDArray[np.bool_]


class Layer(Protocol):
    """A layer follows the mesh (`attach` once, `follow` whenever vertices come and go) and gives its relief of a
    moment.
    """

    def attach(self, face: Face) -> None:
        """Forget everything and prepare for the vertices of `face`, which `follow` will bring."""

    def follow(self, change: Change, created: Sites) -> None:
        """Drop what belongs to vertices that went, and evaluate the new ones."""

    def relief(self, moment: Moment) -> Relief:
        """Heights, and where triangles are needed."""

    def fields(self) -> dict[str, np.ndarray]:
        """Point data of the last moment."""
