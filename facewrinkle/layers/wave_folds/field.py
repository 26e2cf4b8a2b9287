"""The lines of a face: the packets of all its families, and their waves at given points."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...anatomy.face import Face, per_face
from ...array_types import Array
from ...errors import ParameterError
from ...geometry import _mesh_kernels as mesh_kernels
from ...geometry.interpolation import interpolated
from ...geometry.normals import vertex_normals
from ..base import SurfacePoints
from ..compression import StrainField
from ..entries import sorted_by_vertex
from .families import FoldShapes, strength_of, tensors_of
from .packets import KEPT, Packets, Style
from .tissue import anatomical, firmness, grain, wavelengths
from .waves import AGED, GONE, LONGEST, WHOLE, Waves, directed

ENOUGH, MOST = 0.2, 4
"""Length of edges that suffices for the default level, in wavelengths, and the highest default level."""

COMPRESSION = "compression"


class Lines:
    """The lines of a face, found from its motions.

    Parameters
    ----------
    face : Face
    shapes : FoldShapes
    density : float
        Lines per millimetre, relative to what the thickness of the skin suggests.
    style : Style

    Attributes
    ----------
    names : tuple of str
        Families that compress the skin somewhere.
    packets : list of Packets
        Of these families.
    compression : list of ndarray, shape (n0,)
        The compression of each family in full motion.
    """

    def __init__(self, face: Face, shapes: FoldShapes, density: float, style: Style) -> None:
        if shapes.lines is not None and (density, style) == (1.0, Style()):
            arrays = dict(shapes.lines)
        else:
            arrays = found_lines(face, shapes, density, style)
        self.names = tuple(arrays["names"].tolist())
        columns = [{name: arrays[f"{name} {k}"] for name in (*KEPT, COMPRESSION)} for k in range(len(self.names))]
        self.packets = [Packets.of_arrays(own) for own in columns]
        self.compression = [own[COMPRESSION] for own in columns]
        sizes = {(len(packets.window), len(packets.zone)) for packets in self.packets}
        if sizes - {(len(face.points), len(face.triangles))}:
            raise ParameterError(
                f"the lines that wave folds were given are not of this face, which has {len(face.points)} vertices and "
                f"{len(face.triangles)} triangles. Give FoldShapes without lines, and they are found."
            )

    @staticmethod
    def of(face: Face, shapes: FoldShapes, density: float, style: Style) -> Lines:
        """Return the lines of a face; those found before are not found anew."""
        return per_face(face, "lines", (shapes, density, style), lambda: Lines(face, shapes, density, style))


def found_lines(face: Face, shapes: FoldShapes, density: float, style: Style) -> dict[str, np.ndarray]:
    """Find the lines of a face; return their arrays."""
    tensors = tensors_of(face, shapes)
    length, under = wavelengths(face) / density, (grain(face), anatomical(face))
    arrays: dict[str, np.ndarray] = {"names": np.array(list(tensors), dtype=np.str_)}
    for k, (family, tensor) in enumerate(tensors.items()):
        packets = Packets(face, family, tensor, length, style, *under)
        arrays |= {f"{name} {k}": getattr(packets, name) for name in KEPT}
        arrays[f"{COMPRESSION} {k}"] = strength_of(tensor)
    return arrays


class WaveField:
    """The waves of all lines at points of a face.

    Parameters
    ----------
    face : Face
    shapes : FoldShapes
    density : float
    style : Style
        See :class:`Lines`.
    amounts : ndarray, shape (n0,), optional
        Factors of the strength at the base vertices.

    Attributes
    ----------
    lines : Lines
        Found on this face, or on the one that the shapes are of.

    Raises
    ------
    ParameterError
        For shapes of a face with other triangles.
    """

    def __init__(
        self,
        face: Face,
        shapes: FoldShapes,
        density: float = 1.0,
        style: Style | None = None,
        amounts: Array | None = None,
    ) -> None:
        self._home = shapes.face or face
        if self._home is not face and not np.array_equal(self._home.triangles, face.triangles):
            raise ParameterError(
                f"the shapes that wave folds were given are of a face of {len(self._home.triangles)} triangles, and "
                f"this one has {len(face.triangles)}, or others. Give a new WaveFolds() to the simulation of each face."
            )
        self.lines = Lines.of(self._home, shapes, density, style or Style())
        self._face, self._unit, self._amounts = face, face.unit, amounts
        self._length = wavelengths(face) / density
        self._places: tuple[Array, Array] | None = None
        if self._home is not face:
            self._places = self._home.points * self._home.unit, vertex_normals(self._home.points, face.triangles)

    @cached_property
    def _metric(self) -> Array:
        return StrainField(self._face.points * self._unit, self._face.triangles).metric

    @cached_property
    def _of_families(self) -> list[Array]:
        """Window, firmness, wavelength and compression (n0, 4) of each family, at the base vertices."""
        firm = firmness(self._face) if self._amounts is None else firmness(self._face) * self._amounts
        return [
            np.stack([packets.window, firm, self._length, most], axis=1)
            for packets, most in zip(self.lines.packets, self.lines.compression, strict=True)
        ]

    def level_needed(self, face: Face) -> int:
        """Return the level at which nine in ten triangles with lines have five edges or more in each wavelength."""
        zones = [packets.zone for packets in self.lines.packets]
        inside = face.triangles[np.any(zones, axis=0)] if zones else face.triangles[:0]
        if not len(inside):
            return 0
        corners = face.points[inside] * self._unit
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
        levels = np.log2(edges / (ENOUGH * self._length[inside].mean(axis=1)))
        return int(np.clip(np.ceil(np.quantile(levels, 0.9)), 1, MOST))

    def at(self, vertices: SurfacePoints) -> Waves:
        """Return the waves at points of the surface."""
        parts = []
        for number, packets in enumerate(self.lines.packets):
            near = np.flatnonzero(packets.zone[vertices.host])
            if not len(near):
                continue
            values = interpolated(self._of_families[number], vertices.corners[near], vertices.barycentric[near])
            folding = (values[:, 0] > 0.0) & (values[:, 1] > 0.0)
            near, values = near[folding], values[folding]
            theta, strength, wave = packets.at(*self._where(vertices, near))
            size = np.sqrt((wave * wave).sum(axis=1))
            some = np.flatnonzero((strength > GONE) & (size > 1e-6))
            if not len(some):
                continue
            window, firm, length, most = values[some].T
            near, theta, strength, wave, size = near[some], theta[some], strength[some], wave[some], size[some]
            strength = firm * np.clip((strength - GONE) / (WHOLE - GONE), 0.0, 1.0)
            own = np.minimum(2.0 * np.pi / size, LONGEST * length)
            old = AGED * own * np.sqrt(most) * strength**2 * window
            family = np.full(len(near), number, np.int32)
            tangents = directed(wave, vertices, near, self._metric)
            parts.append((near, family, theta, strength, np.ascontiguousarray(window), own, old, wave, tangents))
        n = len(vertices.points)
        return Waves(*sorted_by_vertex(*zip(*parts, strict=True), n=n)) if parts else Waves.none(n)

    def _where(self, vertices: SurfacePoints, near: np.ndarray) -> tuple[Array, Array]:
        """Return places, mm, and normals of some vertices on the face that the lines were found on."""
        if self._places is None:
            return np.ascontiguousarray(vertices.points[near] * self._unit), vertices.normals[near]
        at = vertices.corners[near], vertices.barycentric[near]
        places, normals = (interpolated(values, *at) for values in self._places)
        mesh_kernels.normalise(normals)
        return places, normals
