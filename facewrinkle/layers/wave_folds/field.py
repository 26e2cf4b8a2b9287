"""The lines of a face: the packets of all its families, and their waves at given points."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from ...anatomy.face import Face
from ..base import Array, SurfacePoints
from ..compression import StrainField
from .families import FoldShapes, strength_of, tensors_of
from .packets import Packets, Style
from .tissue import anatomical, firmness, grain, wavelengths
from .waves import AGED, GONE, LONGEST, WHOLE, Waves, directed

ENOUGH, MOST = 0.2, 4
"""Length of edges that suffices for the default level, in wavelengths, and the highest default level."""

_FOUND: WeakKeyDictionary[Face, dict[tuple[FoldShapes, float, Style], WaveField]] = WeakKeyDictionary()
"""Lines that were found before, by the face that they are on."""


class WaveField:
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
    """

    def __init__(self, face: Face, shapes: FoldShapes, density: float, style: Style) -> None:
        tensors = tensors_of(face, shapes)
        self.names = tuple(tensors)
        self._unit = face.unit
        self._metric = StrainField(face.points * face.unit, face.triangles).metric
        self._length = wavelengths(face) / density
        self._firm = firmness(face)
        under = grain(face), anatomical(face)
        self.packets = [Packets(face, name, tensor, self._length, style, *under) for name, tensor in tensors.items()]
        self._compression = [strength_of(tensor) for tensor in tensors.values()]

    @classmethod
    def of(cls, face: Face, shapes: FoldShapes, density: float, style: Style) -> WaveField:
        """Return the lines of a face; those found before are not found anew."""
        known, key = _FOUND.setdefault(face, {}), (shapes, density, style)
        if key not in known:
            known[key] = cls(face, shapes, density, style)
        return known[key]

    def level_needed(self, face: Face) -> int:
        """Return the level at which nine in ten triangles with lines have five edges or more in each wavelength."""
        zone = np.any([packets.zone for packets in self.packets], axis=0) if self.packets else np.zeros(0, bool)
        inside = face.triangles[: len(zone)][zone]
        if not len(inside):
            return 0
        corners = face.points[inside] * self._unit
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
        levels = np.log2(edges / (ENOUGH * self._length[inside].mean(axis=1)))
        return int(np.clip(np.ceil(np.quantile(levels, 0.9)), 1, MOST))

    def at(self, vertices: SurfacePoints, amounts: Array | None = None) -> Waves:
        """Return the waves at points of the surface; their strength is multiplied by amounts (n0,)."""
        places = np.ascontiguousarray(vertices.points * self._unit)
        firm = self._firm if amounts is None else self._firm * amounts
        parts = []
        for number, packets in enumerate(self.packets):
            near = np.flatnonzero(packets.zone[vertices.host])
            corners, weights = vertices.corners[near], vertices.barycentric[near]
            window, firmly, length, most = (
                (values[corners] * weights).sum(axis=1)
                for values in (packets.window, firm, self._length, self._compression[number])
            )
            theta, strength, wave = packets.at(places[near], np.ascontiguousarray(vertices.normals[near]))
            number_of_wave = np.linalg.norm(wave, axis=1)
            some = (window > 0.0) & (strength > GONE) & (firmly > 0.0) & (number_of_wave > 1e-6)
            near, window, firmly, length, most, theta, strength, wave, number_of_wave = (
                v[some] for v in (near, window, firmly, length, most, theta, strength, wave, number_of_wave)
            )
            strength = firmly * np.clip((strength - GONE) / (WHOLE - GONE), 0.0, 1.0)
            own = np.minimum(2.0 * np.pi / number_of_wave, LONGEST * length)
            old = AGED * own * np.sqrt(most) * strength**2 * window
            family = np.full(len(near), number, np.int32)
            products = directed(wave, vertices, near, self._metric)
            parts.append((near, family, theta, strength, window, own, old, wave, *products))
        return Waves.of(parts, len(places))
