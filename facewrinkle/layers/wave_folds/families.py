"""Families of folds: motions of a face that compress its skin in the same directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from ...anatomy import Face
from ...array_types import Array
from ...checks import finite
from ...errors import ParameterError
from ...geometry import neighbor_mean, smoothstep, unit, vertex_areas
from ..compression import StrainField, dyads, orthonormal_tangents, principal, shortening

GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "forehead": ("AU1", "AU2"),
        "brows": ("AU4",),
        "eyes": ("AU6", "AU7", "AU43", "AU45"),
        "cheeks": ("AU9", "AU10", "AU12"),
        "chin": ("AU15", "AU17"),
    }
)
"""Action units whose compressions agree, by the name of their family: within a family their directions differ by 20 to
30 degrees where both are strong, between AU1 and AU4 by 65.
"""

FAINT, FULL = 0.03, 0.10
"""Compression at full motion below which a family has no lines, and from which it has all."""


@dataclass(frozen=True, eq=False)
class FoldShapes:
    """The shapes of a face in full motion, by family: what wave folds are found from.

    Attributes
    ----------
    families : mapping of str to list of ndarray, shape (n0, 3)
        Positions of the base vertices, mm.
    face : Face, optional
        The face whose shapes they are, from which its lines are carried to others. Default: the one on which they are
        used.
    lines : mapping of str to ndarray, optional
        Arrays of the lines that were found from the shapes at the default density and style.

    Examples
    --------
    A face that is pressed together from above, and one from the sides, without names:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> pressed = [face.points * squeeze for squeeze in ([1, 0.8, 1], [0.8, 1, 1], [1, 0.9, 1])]
    >>> {name: len(shapes) for name, shapes in FoldShapes.grouped(face, pressed).families.items()}
    {'motion 1': 2, 'motion 2': 1}
    """

    families: Mapping[str, Sequence[Array]]
    face: Face | None = None
    lines: Mapping[str, npt.NDArray[Any]] | None = None

    @classmethod
    def grouped(cls, face: Face, shapes: Sequence[Array]) -> FoldShapes:
        """Group shapes (n0, 3) by the directions in which they compress the skin, the strongest first.

        There are six families at most. Shapes share one if the mean sin^2 of the angle between their compressions,
        where both are strong, is less than 0.35 (36 degrees).
        """
        strain = StrainField.of(face)
        area = vertex_areas(face.points, face.triangles)
        basis = orthonormal_tangents(strain.metric, face.normals)
        found = [_compressions(strain, basis, shape) for shape in shapes]
        power = [float((area * squared).sum()) for squared, _ in found]
        families: list[list[int]] = []
        for k in sorted(range(len(shapes)), key=lambda k: -power[k]):
            if power[k] <= 1e-6 * area.sum():
                continue
            asked = [max(_askew(area, found[k], found[other]) for other in family) for family in families]
            if asked and (min(asked) < 0.35 or len(families) == 6):
                families[int(np.argmin(asked))].append(k)
            else:
                families.append([k])
        return cls({f"motion {i + 1}": [shapes[k] for k in family] for i, family in enumerate(families)})


def _compressions(strain: StrainField, basis: tuple[Array, Array], positions: Array) -> tuple[Array, Array]:
    """Return the squared compression beyond 0.02 (n0,), which leaves no line, whatever the skin, and its direction
    (n0, 3), by an orthonormal basis.
    """
    values, where, _ = principal(strain.strain(np.ascontiguousarray(positions)), *basis)
    return np.maximum(shortening(values[:, 0]) - 0.02, 0.0) ** 2, unit(where)


def _askew(area: Array, one: tuple[Array, Array], other: tuple[Array, Array]) -> float:
    """Mean sin^2 of the angle between two compressions where both are strong; 0 where they never are."""
    weight = area * np.sqrt(one[0] * other[0])
    if weight.sum() < 1e-3 * area @ np.maximum(one[0], other[0]):
        return 0.0
    aligned = (one[1] * other[1]).sum(axis=1) ** 2
    return float((weight * (1.0 - aligned)).sum() / weight.sum())


def tensors_of(face: Face, shapes: FoldShapes) -> dict[str, Array]:
    """Return the tensor (n0, 6) of each family that compresses the skin at all: ``sum (eps - 0.02)^2 m m^T``.

    The sum runs over the shapes of the family; eps is the principal compression, m its direction. Averaged with the
    neighbors three times, which evens out what single triangles show.

    Raises
    ------
    ParameterError
        If a shape does not have the vertices of the face.
    """
    strain, sides = StrainField.of(face), face.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    around = neighbor_mean(sides, len(face.points))  # each neighbor counts once for every triangle in which it is one
    basis = orthonormal_tangents(strain.metric, face.normals)
    found = {}
    for name, positions in shapes.families.items():
        total = np.zeros_like(strain.metric)
        for moved in positions:
            array = finite(f"a motion of the family {name!r}", moved)
            if array.shape != face.points.shape:
                raise ParameterError(
                    f"a motion of the family {name!r} must be positions of the {len(face.points)} vertices of "
                    f"face.mesh, received an array of the shape {array.shape}."
                )
            squared, where = _compressions(strain, basis, array)
            some = np.flatnonzero(squared)
            total[some] += squared[some, None] * dyads(where[some])
        for _ in range(3):
            total = 0.5 * (total + around @ total)
        if window_of(strength_of(total)).any():
            found[name] = total
    return found


def strength_of(tensor: Array) -> Array:
    """Return the compression (n,) that a tensor (n, 6) stands for: the root of its trace."""
    return np.sqrt(np.maximum(tensor[:, :3].sum(axis=1), 0.0))


def window_of(compression: Array) -> Array:
    """Return the window (n,) of a family, 1 where its motions compress the skin well and 0 where they hardly do."""
    return smoothstep((compression - FAINT) / (FULL - FAINT))
