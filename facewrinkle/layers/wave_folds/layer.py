"""The layer of wave folds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ...anatomy import Face
from ...array_types import Array
from ...checks import finite
from ...errors import ParameterError, check_flag, check_name, check_range, check_whole
from ...geometry import Change, smoothstep
from ..base import Displacement, Layer, SurfacePoints, SurfaceState
from ..entries import Relief, scattered
from ..patterns_on_skin.region import Region
from . import _kernels as kernels
from .families import FAINT, FoldShapes
from .field import Now, WaveField, Waves
from .stripes import Stripes, Style

Motions = Mapping[str, Sequence[str | Mapping[str, float] | npt.ArrayLike]]


def strength_of(seed: int, age: float = 0.0) -> float:
    """Return the factor of the depth of a person's lines: the young differ threefold, from .16 to .47; it rises with
    the age.

    What lines leave of the compression, skin takes by getting thicker: the less it can, the older it is.

    Examples
    --------
    >>> [[round(strength_of(seed, age), 2) for seed in range(5)] for age in (0.0, 1.0)]
    [[0.3, 0.2, 0.39, 0.26, 0.17], [0.81, 0.75, 0.85, 0.78, 0.73]]
    """
    even = (0.6 + seed * 0.6180339887) % 1.0  # multiples of the golden ratio, less whole numbers, lie evenly
    return float((0.47 * 3.0 ** (even - 1.0)) ** (1.0 - 0.82 * age))


class WaveFolds(Layer):
    """The layer of folds that grow where the skin is compressed.

    Lines are waves on the skin, solved once per face: across the directions in which the face's own motions compress
    it, as far apart as its thickness suggests, wandering, branching and ending as on people. In each frame they are as
    deep as the skin is compressed across them now, whatever moves it. Not computed buckling: see :ref:`theory_folds`.

    Parameters
    ----------
    depth : float
        Multiplies the depth of all folds.
    density : float
        Multiplies the number of lines per millimeter.
    length : float
        In [0.5, 2]: below 1, lines fade and return along their way, in shorter pieces; above it, they run on evenly.
    irregularity : float
        0: as parallel and even as the compression lets them be; 1: as on people.
    seed : int
        Another seed is another person's lines, of another strength (:func:`strength_of`); another identity of the head
        keeps them.
    age : float
        In [0, 1]: lines that stay at rest, where the face folds in life. At 0 there are none. Default: the age of the
        face.
    amount : array_like or mapping, optional
        More folds here, none there: factors (n0,) of the depth at the vertices of the mesh; or a mapping to factors
        from landmarks ("glabella"), :class:`facewrinkle.Region`, the subject's "left" or "right", "forehead", "between
        the brows", "crow's feet", "nose", "cheeks", "mouth" or "chin". Elsewhere folds change by no more than the share
        that keeps the volume.
    families : mapping, optional
        Motions by the name of their family; folds of a family lie across their common compression. A motion is the name
        of an action unit or expression, a mixture of them, or positions (n0, 3) of the vertices of the mesh. Default:
        the action units of the face in six groups; for a recording, its shapes, or what its frames have in common.
    inextensible : bool
        If True, folds stay within what skin of fixed length can fold, whatever `depth` is. If False, a `depth` above 1
        exaggerates the folds beyond that.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[WaveFolds()])
    >>> sim.express("surprise")
    >>> *_, frame = sim.run(20)
    >>> bool(np.ptp(frame["W"]) > 0.5)
    True
    >>> WaveFolds(seed=1.5)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: seed must be a whole number, received 1.5.
    """

    timeless = True

    shapes: FoldShapes | None = None
    """The motions that the lines are found from; a :class:`facewrinkle.Simulation` sets them."""

    _shapes_found: tuple[FoldShapes, Face] | None = None
    """The shapes that a simulation found last, and the face that it found them for."""

    def __init__(
        self,
        depth: float = 1.0,
        *,
        density: float = 1.0,
        irregularity: float = 1.0,
        seed: int = 0,
        age: float | None = None,
        amount: Amount | None = None,
        families: Motions | None = None,
        inextensible: bool = True,
        length: float = 1.0,
    ) -> None:
        self.depth = check_range("depth", depth, 0.0, 1e6)
        self.density = check_range("density", density, 0.25, 4.0, "1 is as on people.")
        self.style = Style(
            check_whole("seed", seed, 0, 2**63),
            check_range("irregularity", irregularity, 0.0, 3.0),
            check_range("length", length, 0.5, 2.0, "1 is as on people."),
        )
        self.age = None if age is None else check_range("age", age, 0.0, 1.0, "0 has no lines at rest.")
        self.amount = amount
        if families is not None and not (isinstance(families, Mapping) and families):
            raise ParameterError(
                "families must be a dictionary of names and lists of motions, such as {'brows': ['AU1', 'AU2']}, "
                f"received {families!r}."
            )
        self.families = families
        self.inextensible = check_flag("inextensible", inextensible)

    def prepare(self, face: Face, motions: Callable[[Motions | None], FoldShapes]) -> None:
        """Find the shapes of the face, unless they were set, or found for the same face."""
        own = self._shapes_found
        if self.shapes is None or (own is not None and own[0] is self.shapes and own[1] is not face):
            self.shapes = motions(self.families)
            self._shapes_found = self.shapes, face

    @property
    def lines(self) -> dict[str, Stripes]:
        """The lines of each family, once the layer is on a face."""
        return self._field.lines

    def level_needed(self, face: Face) -> int:
        """Return how often triangles have to be split, at most, to carry the folds on a face."""
        return self._found(face).level_needed(face)

    def _found(self, face: Face, factors: Array | None = None, age: float = 0.0) -> WaveField:
        if self.shapes is None:
            raise ParameterError(
                "WaveFolds finds its lines from motions of the face, and has none. Give it to a Simulation of a face "
                "with muscles or with a recording, or set its `shapes`."
            )
        return WaveField(face, self.shapes, self.density, self.style, factors, age)

    # --- the layer protocol ----------------------------------------------------------------------

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.Layer`.

        Raises
        ------
        ParameterError
            If there are no motions that the lines could be found from, or a family compresses the skin nowhere.
        """
        self._face = face
        self._age = max(face.age, 0.0) if self.age is None else self.age
        self._depth, self._person = self.depth * face.fold_depth, strength_of(self.style.seed, self._age)
        self._amounts = amounts(self.amount, face)
        self._field = self._found(face, self._amounts, self._age)
        if self.families is not None and (lacking := [k for k in self.families if k not in self._field.lines]):
            raise ParameterError(
                f"the motions of the family {lacking[0]!r} compress the skin by less than {FAINT:.0%} everywhere. Name "
                "motions that fold it, or leave the family out."
            )
        self._waves, self._relief = Waves.none(0), Relief.flat(0)

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.Layer`."""
        self._waves = self._waves.followed(change.kept, self._field.at(created))
        n, p = len(self._waves.starts) - 1, len(self._waves.theta)
        self._now, self._relief, self._leading = Now(*np.zeros((6, p))), Relief.flat(n), np.zeros(n, np.int64)

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.Layer`."""
        waves, relief, beyond = self._waves, self._relief, self._beyond
        kernels.heights(
            (waves.starts, *waves.columns), state.strain_at_vertices, self._person * self._depth / beyond,
            tuple(self._now), tuple(relief), self._leading,
        )  # fmt: skip
        relief = relief.leveled(state.areas)
        height, offset = beyond * relief.height, beyond * (relief.shown - relief.height)
        # A fold that is twice as deep needs vertices closer by the root of 2.
        spacing = relief.spacing / (self._face.unit * np.sqrt(beyond))
        return Displacement(height, spacing, relief.across, relief.active, offset)

    @property
    def _beyond(self) -> float:
        """Depth of the folds over that which skin of fixed length can fold."""
        return 1.0 if self.inextensible else max(self._depth, 1.0)

    @property
    def age_shown(self) -> float:
        """The age of the lines: that of the attached face, if no other was given."""
        return self._age

    def explained(self, vertex: int) -> list[dict[str, float]]:
        """Return what the waves of each family add at a vertex in the last frame, and the numbers of their formula.

        A fold is ``D = share S min(0.75 P (2 L / pi) sqrt(e), 0.22 L)`` deep from bulge to furrow (L: wavelength, e:
        the compression that is left to the family, S: its strength, P: the person's, :func:`strength_of`, times the
        depth that was asked for), and ``W = D (b - |s| (1 + s^2)^alpha) / 2^alpha`` high at the phase theta = pi s,
        where b keeps the volume. `share` is what the length of the skin leaves to all families together. Without the
        lines of old skin, and before heights are leveled. Lengths are in mm, "family" is a number.
        """
        waves, now, beyond, share = self._waves, self._now, self._beyond, float(self._relief.share[vertex])
        here = slice(int(waves.starts[vertex]), int(waves.starts[vertex + 1]))
        columns = {
            "family": waves.family[here], "W": beyond * now.height[here], "D": beyond * share * now.deep[here],
            "theta": waves.theta[here], "L": waves.length[here], "S": waves.strength[here],
            "e": now.left[here], "epsilon": now.epsilon[here], "alpha": now.alpha[here],
            "share": np.full(len(now.left[here]), share), "P": np.full(len(now.left[here]), self._person * self._depth),
        }  # fmt: skip
        found = [dict(zip(columns, row, strict=True)) for row in np.transpose([*columns.values()]).tolist()]
        return sorted(found, key=lambda entry: -entry["D"])

    def fields(self) -> dict[str, np.ndarray]:
        """Return "theta", "epsilon" and number ("family", -1 for none) of the family that is deepest at each vertex."""
        some = np.diff(self._waves.starts) > 0
        lead = self._leading[some]
        return {
            "theta": scattered(some, self._waves.theta[lead], 0.0),
            "epsilon": scattered(some, self._now.epsilon[lead], 0.0),
            "family": scattered(some, self._waves.family[lead], -1),
        }


# --- how much of the folds a user asks for, by places --------------------------------------------------------------


Amount = npt.ArrayLike | Mapping[str | Region, float]

REGIONS: Mapping[str, tuple[str, ...]] = {
    "forehead": ("forehead_mid", "brow_l_mid", "brow_r_mid"),
    "between the brows": ("glabella",),
    "crow's feet": ("eye_l_outer", "eye_r_outer"),
    "nose": ("nasion", "sellion", "ala_l", "ala_r"),
    "cheeks": ("malar_l", "malar_r"),
    "mouth": ("mouth_l", "mouth_r", "upper_lip_mid", "lower_lip_mid"),
    "chin": ("pogonion", "menton"),
}
"""Regions with a factor of their own, by the landmarks that they lie around."""

SIDES = ("left", "right")
"""Names of the subject's sides."""


def amounts(asked: Amount | None, face: Face) -> Array | None:
    """Return factors (n0,) of the depth of folds at the base vertices; None where nothing was asked for.

    Raises
    ------
    ParameterError
        For factors that are negative or too large, and for arrays of another length.
    UnknownNameError
        For a name that is none of a side, a region or a landmark of the face.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> smooth = amounts({"glabella": 0.0}, face)
    >>> float(smooth.min()), float(smooth.max())
    (0.0, 1.0)
    >>> uneven = amounts({"left": 0.5, "chin": 2.0}, face)
    >>> float(uneven[face.points[:, 0].argmax()]), float(uneven[face.points[:, 0].argmin()])
    (0.5, 1.0)
    """
    if asked is None:
        return None
    most = 10.0
    if isinstance(asked, Mapping):
        given = {at: check_range(f"the amount of folds at {at}", factor, 0.0, most) for at, factor in asked.items()}
        left, right = given.pop("left", 1.0), given.pop("right", 1.0)
        aside = (face.points - face.frame.origin) @ face.frame.axes[0] / face.frame.pupil_distance
        factors = right + (left - right) * smoothstep(0.5 + 0.5 * aside / 0.15)  # they blend in the middle
        for where, factor in given.items():
            factors *= 1.0 + (factor - 1.0) * _near(where, face)
        return factors
    factors, n = finite("amount", asked), len(face.points)
    if factors.shape != (n,):
        raise ParameterError(
            f"amount must have one factor for each of the {n} vertices of face.mesh, received the shape "
            f"{factors.shape}. Or give a dictionary of landmarks and factors, such as {{'glabella': 0.0}}."
        )
    if not (factors >= 0.0).all() or not (factors <= most).all():
        raise ParameterError(f"amounts must lie in [0, {most:g}], received {factors.min():g} to {factors.max():g}.")
    return factors


def _near(where: str | Region, face: Face) -> Array:
    """Return a weight (n0,) in [0, 1]: 1 at a landmark or in a region, fading around."""
    if isinstance(where, Region):
        return where.laid(face).base_window
    if where in REGIONS:  # of which a face may lack some landmarks
        away = [1.0 - _near(place, face) for place in REGIONS[where] if place in face.landmarks]
        return 1.0 - np.prod(away, axis=0) * np.ones(len(face.points))
    check_name("landmark or region of folds", where, [*face.landmarks, *REGIONS, *SIDES])
    away_from = np.linalg.norm(face.points - face.landmarks[where], axis=1) / face.frame.pupil_distance
    near, far = 0.12, 0.4  # up to the first distance the factor of a landmark holds, and from the second on 1 does
    return 1.0 - smoothstep((away_from - near) / (far - near))
