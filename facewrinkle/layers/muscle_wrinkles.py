"""Wrinkles that contracting muscles fold into the skin over them: W = H A At, summed over the muscles (Eq. 3)."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from ..anatomy import Crease, Face, Muscle
from ..anatomy.eyelids import SHELL
from ..array_types import Array, BoolArray, IntArray
from ..errors import check_flag, check_range
from ..geometry import Change, anisotropy, compiled, deepest, interpolated
from .base import Displacement, Layer, SurfacePoints, SurfaceState, over
from .compression import Activation, StrainField, per_length, tangents_of
from .entries import BLUNT, LEAST, TAUT, Entries, Relief, scattered, sorted_by_vertex


class MuscleWrinkles(Layer):
    """The layer of the paper's wrinkles, mended where they fail as printed (:class:`facewrinkle.PrintedWrinkles`).

    They lie on the skin that is seen: the lining of the mouth and of the sockets has none. Muscles whose folds are a
    :class:`facewrinkle.Crease` have none either: :class:`facewrinkle.Creases` draws these.

    Parameters
    ----------
    depth : float
        Multiplies the depth of all wrinkles.
    inextensible : bool
        If True, wrinkles stay within what skin of fixed length can fold: 2 L sqrt(epsilon) / pi from bulge to furrow
        for a wavelength L, for all muscles over a vertex together (:func:`facewrinkle.geometry.equations.deepest`). If
        False, the amplitude is the paper's, which has no bound.
    waves : bool
        If False, lines that :class:`facewrinkle.WaveFolds` draws are left out (``waves = true`` in the atlas).

    Attributes
    ----------
    rates : ndarray, shape (k,)
        Contraction rates of the last frame. Where the motion has none (a recording), the activation of the muscles by
        measured compression: :class:`facewrinkle.layers.compression.Activation`.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[MuscleWrinkles(depth=0.5)])
    >>> sim.express("frowning")
    >>> [float(frame["W"].max().round(9)) for frame in sim.run(2)][0] >= 0.0
    True
    """

    timeless = True

    def __init__(self, depth: float = 1.0, *, inextensible: bool = True, waves: bool = True) -> None:
        self.depth = check_range("depth", depth, 0.0, 1e6)
        self.inextensible = check_flag("inextensible", inextensible)
        self.waves = check_flag("waves", waves)

    @property
    def leveled(self) -> bool:
        """Whether bulges or furrows are lowered until all hold no net volume, which the profile keeps for even folds
        alone: beside waves, not in the paper's own wrinkles.
        """
        return not self.waves

    def draws(self, pattern: Muscle) -> bool:
        """Tell whether this layer draws the folds of a muscle, given by its fold pattern."""
        return not isinstance(pattern, Crease) and (self.waves or not pattern.wrinkles.waves)

    def patterns(self, face: Face) -> tuple[list[Muscle], BoolArray]:
        """Return the fold patterns of the muscles of a face, and the base triangles (k, m0) that each may touch."""
        return [muscle.fold_pattern for muscle in face.muscles.values()], face.zones

    # --- Eq. 3: W = H A At, with H At computed once, where a new vertex rests --------------------------

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.Layer`."""
        self._face, self._unit = face, face.unit
        self._muscles, touched = self.patterns(face)
        self._drawn = np.array([self.draws(muscle) for muscle in self._muscles], bool)
        fine = np.array([face.fold_depth if m.wrinkles.waves or isinstance(m, Crease) else 1.0 for m in self._muscles])
        self._k0 = self.depth * fine * np.array([m.wrinkles.depth for m in self._muscles])
        # Of these this layer only tells where the region is: their lines are waves of no muscle.
        self._located = np.array(
            [m.wrinkles.waves and not self.waves and not isinstance(m, Crease) for m in self._muscles], bool
        )
        self._kept = np.zeros(len(self._muscles))
        self._outer = outer_skin(face)
        outside = self._outer[face.triangles].any(axis=1)
        self._zones = touched & self._drawn[:, None] & outside
        self._located_zones = touched & self._located[:, None] & outside
        self._metric = StrainField.of(face).metric
        self._activation: Activation | None = None
        self._folds = Folds.none(0)
        self._state: SurfaceState | None = None
        self._vertices: SurfacePoints | None = None
        self._missed = np.empty(0, int)
        self.rates = np.zeros(len(self._muscles))
        self._epsilon, self._relief = np.empty(0), Relief.flat(0)

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.Layer`."""
        new = Folds.at(created, self._muscles, self._zones, self._metric, self._unit, self._outer)
        if not self.inextensible:
            new.steep[:] = 0.0
        self._folds = self._folds.followed(change.kept, new)
        self._vertices = created if self._vertices is None else self._vertices.followed(change.kept, created)
        self._state = None
        self._leading: tuple[BoolArray, dict[str, np.ndarray], tuple[BoolArray, IntArray]] | None = None
        self._epsilon = np.zeros(len(self._folds.muscle))
        self._relief = Relief.flat(len(self._folds.starts) - 1)
        met = np.zeros(len(self._zones), bool)
        full = np.array([2.0**muscle.wrinkles.alpha for muscle in self._muscles])
        met[self._folds.muscle[self._folds.swing > 0.5 * full[self._folds.muscle]]] = True
        self._missed = np.flatnonzero(self._zones.any(axis=1) & ~met)

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.Layer`."""
        folds, relief = self._folds, self._relief
        self._state, self._vertices = state, state.vertices
        self._epsilon = self._compressed(state)
        self.rates = state.rates if len(state.rates) else self._activated(state.strain)
        k0, kept = self._k0 * self.rates, self._k0 * self._kept
        amplitudes((folds.starts, *folds.columns), self._epsilon, k0, kept, tuple(relief))
        self._ask(k0 + kept, state.vertices, relief)
        if self.leveled:
            self._relief = relief = relief.leveled(state.areas)
        return Displacement(relief.height, relief.spacing, relief.across, relief.active, relief.shown - relief.height)

    def _ask(self, k0: Array, vertices: SurfacePoints, relief: Relief) -> None:
        """Ask for triangles where the wrinkling region of a contracting muscle lies between the vertices."""
        for k in self._missed[k0[self._missed] > 0.0]:
            where, muscle = np.unique(self._face.triangles[self._zones[k]]), self._muscles[k]
            relief.spacing[where] = np.minimum(relief.spacing[where], muscle.half_cycles(vertices.points[where]))
            relief.across[where] = muscle.fold_direction(vertices.points[where])
            relief.active[where] = True

    # --- epsilon, from the deformation gradient: in place of Eqs. 8 and 9 ------------------------------

    def _compressed(self, state: SurfaceState) -> Array:
        """Epsilon of all entries."""
        folds, vertices = self._folds, state.vertices
        return compressions(folds.starts, folds.products, state.strain, vertices.corners, vertices.barycentric)

    def _activated(self, strain: Array) -> Array:
        """Activation (k,) at a strain of the base mesh, in place of contraction rates, where the motion has none."""
        if self._activation is None:
            self._activation = Activation(self._face, self._muscles, self._zones, StrainField.of(self._face))
        return self._activation.at(strain)

    # --- what a frame tells -----------------------------------------------------------------------------

    def fields(self) -> dict[str, np.ndarray]:
        """Return lambda, gamma and epsilon of the dominant muscle, its index, and W."""
        contracting = self.rates > 0.0
        if self._leading is None or (self._leading[0] != contracting).any():  # else all but epsilon is as it was
            places = self._located_by(np.flatnonzero(self._located & contracting))
            leading = self._folds.lead(self.rates)
            self._leading = contracting, over(places, self._folds.leading(*leading)), leading
        _, found, (where, lead) = self._leading
        return {**found, "epsilon": scattered(where, self._epsilon[lead], 0.0), "W": self._relief.height.copy()}

    def _located_by(self, some: IntArray) -> dict[str, np.ndarray]:
        """Return the places of all vertices in the regions of some muscles."""
        assert self._vertices is not None
        return located(self._vertices, self._muscles, self._located_zones, some)

    def fields_of(self, muscle: int) -> dict[str, np.ndarray] | None:
        """Return lambda, gamma, epsilon and W of one muscle in its wrinkling region ("region"), 0 elsewhere; None if
        its folds are those of another layer. Where its lines are waves, W is 0.
        """
        if self._located[muscle]:
            found = self._located_by(np.array([muscle]))
            region, epsilon = found.pop("muscle") >= 0, np.zeros(len(found["lambda"]))
            if (state := self._state) is not None:
                compressed = state.compression(self._muscles[muscle].fold_direction(state.vertices.points))
                epsilon = np.where(region, compressed, 0.0)
            return {**found, "epsilon": epsilon, "W": np.zeros_like(epsilon), "region": region}
        if not self._drawn[muscle]:
            return None
        folds, k0 = self._folds, self._k0[muscle] * self.rates[muscle]
        share = anisotropy(self._epsilon) * self._relief.share[folds.vertices]
        return folds.of(muscle, self._epsilon, k0 * folds.height * share)

    def explained(self, vertex: int) -> list[dict[str, float]]:
        """Return what each muscle adds at a vertex in the last frame, and the numbers of its formula.

        ``W = k0 rate H At A share`` (Eq. 3), where H At is the amplitude at k0 = 1, A the share by compression, and
        `share` what the length of the skin leaves of it, all without what old skin keeps at rest. Lengths are in mm,
        "muscle" is a number.
        """
        folds, found = self._folds, []
        for entry in range(folds.starts[vertex], folds.starts[vertex + 1]):
            index = int(folds.muscle[entry])
            height, gathered = float(folds.height[entry]), float(anisotropy(self._epsilon[entry : entry + 1])[0])
            whole = float(self._k0[index] * self.rates[index]) * height * gathered
            share = float(self._relief.share[vertex])
            found.append({
                "muscle": index, "W": whole * share, "k0": float(self._k0[index]), "rate": float(self.rates[index]),
                "H At": height, "A": gathered, "share": share, "epsilon": float(self._epsilon[entry]),
                "lambda": float(folds.coordinates[entry, 0]), "gamma": float(folds.coordinates[entry, 1]),
            })  # fmt: skip
        return sorted(found, key=lambda entry: -abs(entry["W"]))


def outer_skin(face: Face) -> Array:
    """Return 1 (n0,) for the base vertices of the skin that is seen, 0 for those behind lips and lids.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> outer, nose = outer_skin(face), np.linalg.norm(face.points - face.landmarks["nose_tip"], axis=1).argmin()
    >>> float(outer[nose]), bool((outer == 0.0).any())
    (1.0, True)
    """
    if not face.landmarks:
        return np.ones(len(face.points))
    lined, normals = face.lining.vertices.copy(), face.normals
    for eye in face.eyes:
        if eye.side in face.eyelid_openings and eye.side not in face.lid_rims:
            offset = face.points - eye.centre
            near = np.linalg.norm(offset, axis=1) < SHELL * eye.radius
            lined |= near & ((offset * normals).sum(axis=1) < 0.0)
    return np.where(lined, 0.0, 1.0)


def located(
    vertices: SurfacePoints, muscles: list[Muscle], zones: BoolArray, some: npt.NDArray[np.int64]
) -> dict[str, np.ndarray]:
    """Return lambda, gamma and the index of that muscle of `some` in whose wrinkling region each vertex lies, within
    the base triangles (k, m0) that it may touch; of several, the one whose central fiber is nearest, by gamma.

    They are 0, and the index -1, in no region.

    Examples
    --------
    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> points, up = np.array([[0.0, 20, 0], [30, 20, 0]]), np.tile([0.0, 0, 1], (2, 1))
    >>> vertices = SurfacePoints(points, up, np.zeros((2, 3), np.int32), np.full((2, 3), 1 / 3), np.zeros(2, np.int32))
    >>> found = located(vertices, [muscle], np.array([[True]]), np.array([0]))
    >>> found["muscle"].tolist(), found["lambda"].tolist()
    ([0, -1], [0.5, 0.0])
    """
    n = len(vertices.points)
    along, across, nearest, lead = np.zeros(n), np.zeros(n), np.full(n, np.inf), np.full(n, -1, np.int32)
    for k in some.tolist():
        near = np.flatnonzero(zones[k][vertices.host])
        first, second, inside = muscles[k].located(vertices.points[near])
        own = np.flatnonzero(inside & (np.abs(second) <= nearest[near]))
        where = near[own]
        along[where], across[where], nearest[where], lead[where] = first[own], second[own], np.abs(second[own]), k
    return {"lambda": along, "gamma": across, "muscle": lead}


@dataclass(frozen=True, eq=False)
class Folds(Entries):
    """Folds of all muscles, with one entry per vertex and muscle whose wrinkling region it lies in.

    The last one of a vertex is that of the dominant muscle: the entries rise by abs(H At), and where H is 0 by `swing`.

    Attributes
    ----------
    muscle : ndarray of int32, shape (p,)
    coordinates : ndarray, shape (p, 2)
        lambda and gamma (sphincter: r and psi).
    height : ndarray, shape (p,)
        H At at k0 = 1.
    blunt : ndarray, shape (p,)
        The same with H averaged for the shading normals, see `BLUNT`.
    swing : ndarray, shape (p,)
        2^alpha At: from bulge to furrow at k0 = 1.
    steep : ndarray, shape (p,)
        `swing` relative to the deepest fold of this wavelength that skin of fixed length allows at epsilon = 1, 1/mm.
    cycle : ndarray, shape (p,)
        Half cycle u as a length.
    direction : ndarray, shape (p, 3)
        Unit tangent across the folds.
    products : ndarray, shape (p, 6)
        Products of the direction's components over its squared length in the rest metric.

    Examples
    --------
    One muscle, a point in its middle, and one beside it that has no entry:

    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> points, up = np.array([[0.0, 20, 0], [30, 20, 0]]), np.tile([0.0, 0, 1], (2, 1))
    >>> vertices = SurfacePoints(points, up, np.zeros((2, 3), np.int32), np.full((2, 3), 1 / 3), np.zeros(2, np.int32))
    >>> flat = np.array([[1.0, 1, 0, 0, 0, 0]])
    >>> folds = Folds.at(vertices, [muscle], np.array([[True]]), flat, unit=1.0)
    >>> folds.starts.tolist(), folds.coordinates.tolist(), folds.cycle.round(2).tolist()
    ([0, 1, 1], [[0.5, 0.0]], [5.33])
    """

    muscle: IntArray
    coordinates: Array
    height: Array
    blunt: Array
    swing: Array
    steep: Array
    cycle: Array
    direction: Array
    products: Array

    @classmethod
    def at(
        cls,
        vertices: SurfacePoints,
        muscles: list[Muscle],
        zones: BoolArray,
        metric: Array,
        unit: float,
        shares: Array | None = None,
    ) -> Self:
        """Evaluate the muscles at vertices.

        Parameters
        ----------
        vertices : SurfacePoints
        muscles : list of Muscle
            Fold patterns of the face's muscles.
        zones : ndarray of bool, shape (k, m0)
            Base triangles that each muscle may touch.
        metric : ndarray, shape (n0, 6)
            Rest metric at the base vertices.
        unit : float
            Millimeters per unit of the vertices.
        shares : ndarray, shape (n0,), optional
            Share of their depth that folds have at the base vertices; without them, all of it.
        """
        touched, near = np.nonzero(zones[:, vertices.host])
        found = [_of_muscle(k, muscles[k], near[touched == k], vertices.points) for k in np.unique(touched).tolist()]
        parts = [part for part in found if len(part[0])]
        if not parts:
            return cls.none(len(vertices.points))
        where, muscle_of, height, blunt, swing, cycle, coordinates, direction = map(
            np.concatenate, zip(*parts, strict=True)
        )
        at = vertices.corners[where], vertices.barycentric[where]
        if shares is not None:
            part = interpolated(shares[:, None], *at)[:, 0]
            height, blunt, swing = part * height, part * blunt, part * swing
        direction = tangents_of(direction, vertices.normals[where])
        squares = per_length(interpolated(metric, *at), direction)
        steep = swing / deepest(2.0 * unit * cycle, 1.0)
        columns = muscle_of.astype(np.int32), coordinates, height, blunt, swing, steep, cycle, direction, squares
        rising = np.lexsort((swing, np.abs(height)))
        return cls(*sorted_by_vertex(where[rising], *(column[rising] for column in columns), n=len(vertices.points)))

    @classmethod
    def none(cls, n: int) -> Self:
        """Return no entries for n vertices."""
        e, i = np.empty(0), np.empty(0, np.int32)
        coordinates, direction, squares = (np.empty((0, width)) for width in (2, 3, 6))
        return cls(np.zeros(n + 1, np.int32), i, coordinates, e, e, e, e, e, direction, squares)

    def leading(self, where: BoolArray, lead: IntArray) -> dict[str, np.ndarray]:
        """Return lambda and gamma of the dominant muscle at each vertex, and its index, given where one contracts and
        its entries: of the muscles that contract, the last, the one with the largest abs(H At); see `lead`.

        They are 0, and the index -1, where none contracts.
        """
        return {
            "lambda": scattered(where, self.coordinates[lead, 0], 0.0),
            "gamma": scattered(where, self.coordinates[lead, 1], 0.0),
            "muscle": scattered(where, self.muscle[lead], -1),
        }

    def lead(self, rates: Array) -> tuple[BoolArray, IntArray]:
        """Return where a muscle contracts (n,), by the rates (k,), and the last entry of such a muscle there."""
        lead = np.full(len(self.starts) - 1, -1)
        some = np.flatnonzero(rates[self.muscle] > 0.0)
        lead[self.vertices[some]] = some  # of several, the last
        return lead >= 0, lead[lead >= 0]

    def of(self, muscle: int, epsilon: Array, height: Array) -> dict[str, np.ndarray]:
        """Return lambda, gamma, and epsilon and W of the entries (p,), of one muscle, 0 outside of its region; and that
        region.
        """
        entries = np.flatnonzero(self.muscle == muscle)
        region = np.isin(np.arange(len(self.starts) - 1), self.vertices[entries])
        return {
            "lambda": scattered(region, self.coordinates[entries, 0], 0.0),
            "gamma": scattered(region, self.coordinates[entries, 1], 0.0),
            "epsilon": scattered(region, epsilon[entries], 0.0),
            "W": scattered(region, height[entries], 0.0),
            "region": region,
        }


def _of_muscle(k: int, muscle: Muscle, near: npt.NDArray[np.int64], points: Array) -> tuple[npt.NDArray[Any], ...]:
    """Columns of one muscle's entries among the points `near`: their numbers, then those of Folds."""
    envelope = muscle.envelope(points[near])
    inside = envelope > 0.0
    near, envelope = near[inside], envelope[inside]
    x, swing = points[near], 2.0**muscle.wrinkles.alpha * envelope
    return (
        near,
        np.full(len(near), k),
        muscle.height(x) * envelope,
        muscle.height(x, BLUNT) * envelope,
        swing,
        muscle.half_cycles(x),
        np.stack(muscle.coordinates(x), axis=1),
        muscle.fold_direction(x),
    )


@compiled
def compressions(starts, products, strain, corners, barycentric):
    """Return the compression (p,) of all entries at a strain (n0, 6) of the base mesh."""
    epsilon = np.empty(len(products))
    for i in range(len(starts) - 1):
        a, b, c = np.uint32(corners[i, 0]), np.uint32(corners[i, 1]), np.uint32(corners[i, 2])
        for p in range(starts[i], starts[i + 1]):
            change = 0.0
            for k in range(6):
                here = barycentric[i, 0] * strain[a, k] + barycentric[i, 1] * strain[b, k]
                change += (here + barycentric[i, 2] * strain[c, k]) * products[p, k]
            epsilon[p] = 1.0 - np.sqrt(max(1.0 + change, 0.0))
    return epsilon


@compiled
def amplitudes(folds, epsilon, k0, kept, relief):
    """Sum of (k0 A + kept) H At over the entries of each vertex, the same with blunt H (`shown`), and the half cycle of
    the finest fold that matters.

    What is `kept` (k,) of each muscle's folds stays at rest, and goes as the skin is stretched across them. From bulge
    to furrow an entry is k0 A steep / sqrt(epsilon) times as deep as skin of fixed length allows. Where the entries
    together ask for more than that, each gets the `share` for which the skin suffices.
    """
    starts, muscle, _, unit, blunt, swing, steep, cycle, direction, _ = folds
    height, shown, spacing, across, active, share = relief
    for i in range(len(starts) - 1):
        total, mild, asked, finest, lead, on = 0.0, 0.0, 0.0, np.inf, -1, False
        for p in range(starts[i], starts[i + 1]):
            depth, old = k0[muscle[p]], kept[muscle[p]]
            if depth > 0.0 or old > 0.0:
                on = True
                deep = old * max(0.0, 1.0 + min(epsilon[p], 0.0) / TAUT)
                if epsilon[p] > 0.0 and depth > 0.0:
                    new = depth * np.sin(0.5 * np.pi * min(epsilon[p], 1.0))
                    asked += new * steep[p] / np.sqrt(epsilon[p])
                    deep += new
                if deep > 0.0:
                    total += deep * unit[p]
                    mild += deep * blunt[p]
                    # Below 0.4 mm from bulge to furrow it asks for no triangles, unless it stays at rest.
                    if cycle[p] < finest and (deep * swing[p] > 0.4 or old * swing[p] > LEAST):
                        finest, lead = cycle[p], p
        share[i] = 1.0 / max(asked, 1.0)
        height[i], shown[i], spacing[i], active[i] = total * share[i], mild * share[i], finest, on
        if lead >= 0:
            for c in range(3):
                across[i, c] = direction[lead, c]
