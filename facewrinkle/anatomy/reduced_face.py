"""A face on some of its vertices."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..array_types import IntArray
from ..mesh import to_polydata
from .cavities import Lining
from .eyelid_opening import EyelidOpening
from .face import Face
from .muscles import JointWeights
from .skull import Tissue


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
    def behind_lips(self) -> float:
        """See :class:`Face`."""
        return self.whole.behind_lips

    @cached_property
    def lining(self) -> Lining:
        """See :class:`Face`."""
        return self.whole.lining.of_vertices(self.points, self.vertices)


def reduced_face(face: Face, vertices: IntArray, triangles: npt.NDArray[np.int32]) -> ReducedFace:
    """Return a face on some of its vertices (k,), without its parts, texture and eyebrows.

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
        "brows": None,
        "parts": {},
    }
    return ReducedFace(**own, whole=face, vertices=vertices)
