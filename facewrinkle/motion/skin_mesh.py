"""The mesh on which the skin is simulated: the face's own, or on fine scans an even one of a few thousand vertices."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy import EyelidOpening, Face, JointWeights, Lining, Tissue, per_face
from ..array_types import Array, IntArray
from ..errors import check_whole
from ..geometry import Untangling, vertex_areas
from ..geometry.decimation import decimated
from ..geometry.vertex_interpolation import VertexInterpolation
from ..mesh import to_polydata
from .self_contact import lid_ridges

SKIN_VERTICES = 4400
"""Vertices of the skin's mesh on a fine face."""

WORTHWHILE = 1.5
"""A face that has more than this times as many vertices gets a mesh of its own for the skin."""


class SkinMesh:
    """The mesh on which the skin of a face is simulated.

    A face of few vertices is its own mesh. From a finer one, vertices are taken that are close on lids, lips and
    nostrils and far apart on the scalp and the neck; the others follow them smoothly.

    Parameters
    ----------
    face : Face
    vertices : int, optional
        About as many vertices the mesh has, if the face has more than 1.5 times as many. Default: 4,400. None: the face
        is its own mesh.

    Attributes
    ----------
    face : Face
        The face on this mesh, k vertices.
    vertices : ndarray of int, shape (k,), or slice
        Their numbers in the given face.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> head = fw.default_face()
    >>> SkinMesh(head).face is head
    True
    >>> 1000 < len(SkinMesh(head, vertices=1200).vertices) < 1400
    True
    """

    def __init__(self, face: Face, vertices: int | None = SKIN_VERTICES) -> None:
        self.face: Face = face
        self.vertices: IntArray | slice = slice(None)
        self._interpolation: VertexInterpolation | None = None
        self._untangling: Untangling | None = None
        if vertices is None:
            return
        count = check_whole("vertices", vertices, 100, 1e9)
        if face.mesh.n_points > WORTHWHILE * count:
            size = edge_lengths(face, count)
            lines = np.concatenate([lid_margins(face), lid_ridges(face)])
            chosen, triangles = decimated(face.points, face.triangles, size, lines)
            self.face, self.vertices = reduced_face(face, chosen, triangles), chosen
            self._points = face.points_mm
            self._interpolation = VertexInterpolation(face.points, face.triangles, chosen, triangles)
            self._untangling = Untangling(self._points, face.triangles, *self._interpolation.rings)

    @staticmethod
    def of(face: Face, vertices: int | None = SKIN_VERTICES) -> SkinMesh:
        """Return the mesh of a face, which its skins share."""
        if vertices is None or face.mesh.n_points <= WORTHWHILE * check_whole("vertices", vertices, 100, 1e9):
            return SkinMesh(face, vertices)
        return per_face(face, "skin mesh", vertices, lambda: SkinMesh(face, vertices))

    def follow(self, displacement: Array) -> Array:
        """Return the displacement (n, 3) of the given face's vertices from that (k, 3) of the vertices of the mesh.

        The one that is given itself, if the face is its own mesh.
        """
        return displacement if self._interpolation is None else self._interpolation.at(displacement)

    def untangled(self, displacement: Array) -> Array:
        """Return a displacement (n, 3) of the given face's vertices, mm, with triangles turned back that it turns over.

        The mesh of the skin does not turn over, but tiny triangles of vertices that follow where it is crumpled might.
        See :class:`facewrinkle.geometry.untangling.Untangling`.
        """
        if self._untangling is None:
            return displacement
        before = self._points + displacement
        after = self._untangling.untangled(before)
        return displacement if after is before else displacement + (after - before)


def edge_lengths(face: Face, count: int) -> Array:
    """Return the wanted length (n,) of the edges at each vertex, in the unit of the mesh, for fewer vertices than
    the face has.

    On a face of average size they are 1 mm on the margins of lids and the rims of lips, nostrils and holes, grow by
    0.12 mm per mm from there, up to 5 mm, and beyond the face by 0.2 mm per mm, up to 14 mm. At the corners of mouth
    and eyes they are 0.2 mm at most, and 0.16 mm more per mm from there: the skin is crumpled there, and vertices
    between others that move apart cannot follow. All are scaled together to the number of vertices.

    Examples
    --------
    The skin is finest at the lips, and coarsest at the back of the head; mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> length = edge_lengths(face, 1000)
    >>> bool(length[face.points[:, 2].argmin()] > 5.0 * length[face.mesh.find_closest_point(face.landmarks["mouth_l"])])
    True
    """
    from scipy.optimize import brentq  # every command would import it, a tenth of a second, and few scans are so fine

    scale, points = face.frame.scale, face.points
    from_rims = cKDTree(points[_rims(face)]).query(points)[0] / scale
    # Skin farther than 30 mm from every landmark is not of the face.
    beyond = cKDTree(np.array(list(face.landmarks.values()))).query(points)[0] / scale - 30.0
    length = np.minimum(1.0 + 0.12 * from_rims, 5.0) + 0.2 * np.maximum(beyond, 0.0)
    corners = [name.format(side) for name in ("mouth_{}", "eye_{}_inner", "eye_{}_outer") for side in "lr"]
    from_corners = cKDTree(np.array([face.landmarks[name] for name in corners])).query(points)[0] / scale
    length = scale * np.minimum(np.minimum(length, 0.2 + 0.16 * from_corners), 14.0)
    # Two equilateral triangles for each vertex cover the face; where it is coarser, its own vertices are all there are.
    share = vertex_areas(points, face.triangles) / (np.sqrt(0.75) * length**2)
    usual = float(np.sqrt(share.sum() / count))
    factor = brentq(lambda factor: np.minimum(share / factor**2, 1.0).sum() - count, 1e-9 * usual, 2.0 * usual)
    return np.asarray(factor * length)


def _rims(face: Face) -> IntArray:
    """Vertices on the margins of the lids, the rims of lips and nostrils, and all holes but the outer border."""
    edges = face.edges
    inside = face.lining.vertices
    parts = [edges[inside[edges[:, 0]] != inside[edges[:, 1]]].ravel(), lid_margins(face).ravel()]
    loops, points = face.boundary_loops, face.points
    around = [float(np.linalg.norm(points[loop] - points[np.roll(loop, 1)], axis=1).sum()) for loop in loops]
    parts += [loop for loop, length in zip(loops, around, strict=True) if length < max(around)]
    corners = [face.mesh.find_closest_point(face.landmarks[f"mouth_{side}"]) for side in "lr"]
    return np.unique(np.concatenate([*parts, corners]))


def lid_margins(face: Face) -> IntArray:
    """Return the edges (k, 2) of the mesh along the margins of the lids.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> edges = lid_margins(face)
    >>> opening = face.eyelid_openings["l"]
    >>> set(opening.upper) | set(opening.lower) <= set(edges.ravel())
    True
    """
    margins = [margin for opening in face.eyelid_openings.values() for margin in (opening.upper, opening.lower)]
    pairs = [np.stack([margin[:-1], margin[1:]], axis=1) for margin in margins]
    return np.concatenate([np.empty((0, 2), np.int64), *pairs])


# --- a face on some of its vertices -------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class ReducedFace(Face):
    """A face on some of its vertices: what is known of each vertex is that of the whole face, and not found anew.

    Attributes
    ----------
    whole : Face
    vertices : ndarray of int, shape (k,)
        Numbers of the vertices in the whole face, ascending.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.geometry.decimation import decimated
    >>> face = fw.default_face()
    >>> coarse = reduced_face(face, *decimated(face.points, face.triangles, np.full(len(face.points), 10.0)))
    >>> coarse.mesh.n_points < 0.6 * face.mesh.n_points, coarse.landmarks is face.landmarks
    (True, True)
    >>> bool((coarse.tissue.depth == face.tissue.depth[coarse.vertices]).all())
    True
    """

    whole: Face = None  # type: ignore[assignment]  # dataclasses want a default after those of Face
    vertices: IntArray = None  # type: ignore[assignment]

    @cached_property
    def _numbers(self) -> IntArray:
        """Number here of each vertex of the whole face; -1 for those left out."""
        numbers = np.full(self.whole.mesh.n_points, -1, np.int64)
        numbers[self.vertices] = np.arange(len(self.vertices))
        return numbers

    @cached_property
    def joint_weights(self) -> dict[str, JointWeights]:
        """See :class:`Face`."""
        return {name: self._joint(weights) for name, weights in self.whole.joint_weights.items()}

    def _joint(self, weights: JointWeights) -> JointWeights:
        numbers = self._numbers[weights.vertices]
        kept = numbers >= 0
        return dataclasses.replace(
            weights, vertices=numbers[kept], angles=weights.angles[kept], hold=weights.hold[kept]
        )

    @cached_property
    def eyelid_openings(self) -> dict[str, EyelidOpening]:
        """See :class:`Face`."""
        return {side: self._opening(opening) for side, opening in self.whole.eyelid_openings.items()}

    def _opening(self, opening: EyelidOpening) -> EyelidOpening:
        margins = [self._numbers[margin].astype(np.int32) for margin in (opening.upper, opening.lower)]
        rims = tuple(rim[:, margin >= 0] for rim, margin in zip(opening.rims, margins, strict=True))
        upper, lower = (margin[margin >= 0] for margin in margins)
        return dataclasses.replace(opening, upper=upper, lower=lower, rims=(rims[0], rims[1]))

    @cached_property
    def lining(self) -> Lining:
        """See :class:`Face`."""
        return self.whole.lining.of_vertices(self.points, self.vertices)


def reduced_face(face: Face, vertices: IntArray, triangles: npt.NDArray[np.int32]) -> ReducedFace:
    """Return a face on some of its vertices (k,), without its parts, texture and bound hair.

    Parameters
    ----------
    face : Face
    vertices : ndarray of int, shape (k,)
        Numbers of vertices of the face.
    triangles : ndarray of int, shape (m, 3)
        The triangles between them, as numbers 0 to k - 1.
    """
    own = {field.name: getattr(face, field.name) for field in dataclasses.fields(Face)}
    own |= {
        "mesh": to_polydata(face.points[vertices], triangles),
        "tissue": Tissue(*(values[vertices] for values in vars(face.tissue).values())),
        "source_points": vertices if face.source_points is None else face.source_points[vertices],
        "texture": None,
        "bound_hair": {},
        "parts": {},
    }
    reduced = ReducedFace(**own, whole=face, vertices=vertices)
    vars(reduced).update({name: getattr(face, name) for name in ("behind_lips", "mouth_opens", "mouth_half_open")})
    return reduced
