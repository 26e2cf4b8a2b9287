"""Cross-sections of wrinkled surfaces, cut across the folds, and measurements on them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.anatomy.muscles import LinearMuscle, Muscle, SheetMuscle, SphincterMuscle
from facewrinkle.errors import ParameterError
from facewrinkle.geometry.equations import anisotropy, deepest
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.geometry.topology import unique_edges
from facewrinkle.layers.muscle_wrinkles import MuscleWrinkles

from .surfaces import WrinkledSurface

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Section:
    """A cut through a wrinkled surface, from one end of a wrinkling region to the other; k points.

    Attributes
    ----------
    along : ndarray, shape (k,)
        The muscle's own coordinate across the folds: l or r in mm at rest, psi in radians.
    distance : ndarray, shape (k,)
        Distance along the cut on the bare surface, mm.
    height : ndarray, shape (k,)
        Height of the wrinkled surface over the bare one, along the bare one's normal, mm.
    rest : ndarray, shape (k, 3)
        The same points at rest, mm.
    """

    along: Array
    distance: Array
    height: Array
    rest: Array

    def at(self, along: Array) -> Array:
        """Return the height at other points: straight lines from one point of the cut to the next, as on the mesh."""
        return np.interp(along, self.along, self.height)

    def resampled(self, count: int = 2001) -> Section:
        """Return the same cut at many points; between the original ones it is straight."""
        along = np.linspace(self.along[0], self.along[-1], count)
        rest = np.column_stack([np.interp(along, self.along, x) for x in self.rest.T])
        return Section(along, np.interp(along, self.along, self.distance), self.at(along), rest)


def cut(surface: WrinkledSurface, muscle: Muscle, unit: float = 1.0, across: float = 0.0) -> Section:
    """Cut a wrinkled surface across the folds of a muscle.

    With straight fibers, the cut is the plane through a fiber and the skin's normal; round a sphincter it is an ellipse
    between the borders of its ring. It is made on the surface at rest and follows its material points.

    Parameters
    ----------
    surface : WrinkledSurface
    muscle : Muscle
        The one that makes the folds (`fold_pattern`), in units of `unit` mm.
    across : float
        0 for the central fiber; towards -1 and 1 lie the borders of the region.
    """
    level, along = _level_and_place(surface, muscle, unit, across)
    edges = unique_edges(surface.triangles)[0]
    a, b = edges.T
    level = np.where(level == 0.0, 1e-12, level)
    crossing = (level[a] * level[b] < 0.0) & (np.abs(along[a] - along[b]) < 1.0)  # not through psi = pi
    a, b = a[crossing], b[crossing]
    share = level[a] / (level[a] - level[b])

    def at_cut(values: Array) -> Array:
        s = share if values.ndim == 1 else share[:, None]
        return np.asarray((1.0 - s) * values[a] + s * values[b])

    place, rest, bare = at_cut(along), at_cut(surface.rest), at_cut(surface.bare)
    normal = at_cut(surface.normals)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = ((at_cut(surface.wrinkled) - bare) * normal).sum(axis=1)
    inside = muscle.wrinkling_region(rest / unit)
    low, high = _ends(muscle)
    inside |= _near(rest, rest[inside]) & (place > low - 0.05 * (high - low)) & (place < high + 0.05 * (high - low))
    order = np.flatnonzero(inside)[np.argsort(place[inside], kind="stable")]
    order = order[np.append(True, np.diff(place[order]) > 1e-9 * (high - low))]
    steps = np.linalg.norm(np.diff(bare[order], axis=0), axis=1)
    scale = 1.0 if isinstance(muscle, SphincterMuscle) else unit
    return Section(scale * place[order], np.concatenate([[0.0], np.cumsum(steps)]), height[order], rest[order])


def expected(section: Section, sim: fw.Simulation, surface: WrinkledSurface) -> Array:
    """Return the closed form at the points of a section: W = k0 H At A, summed over the muscles (Eq. 3), bounded by the
    folds that skin of fixed length allows; the compression is that of the simulation.
    """
    layers = [layer for layer in surface.layers if isinstance(layer, MuscleWrinkles)]
    unit = sim.face.unit
    total, asked = np.zeros(len(section.along)), np.zeros(len(section.along))
    for k, name in enumerate(sim.muscles):
        rate, muscle = float(sim.motion.rates[k]), sim.face.muscles[name].fold_pattern
        x = section.rest / unit
        envelope = muscle.envelope(x)
        if rate == 0.0 or not envelope.any():
            continue
        layer = next(layer for layer in layers if layer.draws(muscle))
        own = layer.fields_of(k)
        assert own is not None
        epsilon = _epsilon_at(own, section, surface)
        k0 = layer.depth * muscle.wrinkles.depth * rate * anisotropy(epsilon)
        total += k0 * muscle.unit_amplitude(x)
        if layer.inextensible:
            bound = deepest(2.0 * unit * muscle.half_cycles(x), epsilon)
            swing = k0 * 2.0**muscle.wrinkles.alpha * envelope
            asked += np.divide(swing, bound, out=np.zeros_like(swing), where=bound > 0.0)
    return np.asarray(total / np.maximum(asked, 1.0))


def _epsilon_at(fields: dict[str, np.ndarray], section: Section, surface: WrinkledSurface) -> Array:
    """Epsilon at the points of the section, from the nearest vertices of the region."""
    region = fields["region"]
    away, near = cKDTree(surface.rest[region]).query(section.rest, k=min(6, int(region.sum())))
    weight = 1.0 / np.maximum(away, 1e-9) ** 2
    return np.asarray((weight * fields["epsilon"][region][near]).sum(axis=1) / weight.sum(axis=1))


@dataclass(frozen=True)
class Measured:
    """Wrinkles of one section.

    Attributes
    ----------
    count : int
        Furrows between two others or at the end.
    amplitude : float
        From bulge to furrow, mean over the furrows, mm.
    wavelength : float
        From furrow to furrow, mm.
    narrow : float
        Share of the wavelength in which the skin lies deeper than the mean of crest and furrow: 0.5 for a sine,
        less the sharper the furrows are.
    """

    count: int
    amplitude: float
    wavelength: float
    narrow: float


def measure(distance: Array, height: Array) -> Measured:
    """Return amplitude, wavelength and sharpness of the furrows of a profile, from its points alone."""
    fine = np.linspace(distance[0], distance[-1], 4001)
    z = np.interp(fine, distance, height)
    furrows, _ = find_peaks(-z, prominence=0.35 * np.ptp(z))
    if len(furrows) < 2:
        return Measured(len(furrows), float(np.ptp(z)), np.nan, np.nan)
    crests = np.array([z[a:b].max() for a, b in pairwise(furrows)])
    depths = np.array([z[a] + z[b] for a, b in pairwise(furrows)]) / 2.0
    inner = slice(furrows[0], furrows[-1])
    middle = np.interp(np.arange(furrows[0], furrows[-1]), furrows[:-1], 0.5 * (crests + depths))
    wave = np.diff(fine[furrows]).mean()
    return Measured(len(furrows), float((crests - depths).mean()), float(wave), float((z[inner] < middle).mean()))


def _level_and_place(surface: WrinkledSurface, muscle: Muscle, unit: float, across: float) -> tuple[Array, Array]:
    """Signed distance from the cut and the coordinate along it, of all vertices, in the unit of the muscle."""
    x = surface.rest / unit
    if isinstance(muscle, SphincterMuscle):
        r, psi = muscle.coordinates(x)
        return r - (0.5 * (1.0 + muscle.inner) + 0.5 * across * (1.0 - muscle.inner)), psi
    if not isinstance(muscle, LinearMuscle | SheetMuscle):
        raise ParameterError(f"a {type(muscle).__name__} has no folds to cut across.")
    origin, insertion = (np.atleast_2d(p).mean(axis=0) for p in (muscle.attachment, muscle.insertion))
    fiber = (insertion - origin) / np.linalg.norm(insertion - origin)
    normals = vertex_normals(surface.rest, surface.triangles)
    normal = normals[muscle.wrinkling_region(x)].mean(axis=0)
    side = np.cross(fiber, normal)
    side /= np.linalg.norm(side)
    offset = x - origin
    if isinstance(muscle, SheetMuscle):
        return offset @ side - 0.5 * across * muscle.width, offset @ fiber
    angle = across * muscle.max_angle
    side, fiber = np.cos(angle) * side - np.sin(angle) * fiber, np.cos(angle) * fiber + np.sin(angle) * side
    round_fronts = muscle.wrinkles.fronts == "round"
    return offset @ side, np.linalg.norm(offset, axis=1) if round_fronts else muscle.coordinates(x)[0] * muscle.radius


def _ends(muscle: Muscle) -> tuple[float, float]:
    """Both ends of the wrinkling region, in the coordinate along the cut."""
    if isinstance(muscle, SphincterMuscle):
        return -muscle.beta1, muscle.beta2
    length = muscle.length if isinstance(muscle, SheetMuscle) else muscle.radius  # type: ignore[attr-defined]
    return muscle.wrinkles.start * length, length


def _near(points: Array, others: Array, reach: float = 4.0) -> npt.NDArray[np.bool_]:
    """True for points that lie within `reach` mm of the others."""
    if not len(others):
        raise ParameterError("the cut does not meet the wrinkling region. Choose another place across it.")
    return np.asarray(cKDTree(others).query(points)[0] < reach)
