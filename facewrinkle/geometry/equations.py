"""The equations of Zhang, Sim and Tan, 1 to 19, in the order of their paper, as formulas on arrays.

"Realistic and Efficient Wrinkle Simulation Using an Anatomy-based Face Model with Adaptive Refinement", 2005. The
amplitude of a wrinkle is ``W = H(w) A(epsilon) At(s)``, summed over the muscles (Eq. 3); the layers
:class:`facewrinkle.PrintedWrinkles` and :class:`facewrinkle.MuscleWrinkles` put it together. Lengths in mm, angles in
radians; along a sphincter `w`, `u`, `l` and `start` are angles, `k0` stays a length.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from ..array_types import Array, IntArray
from ..errors import ParameterError, check_range, check_whole
from .compilation import compiled
from .interpolation import smoothstep

Ends = Literal["continuous", "paper"]
Falloff = Literal["paper", "smoothstep"]


LEAST_COSINE = 0.1
"""Least denominator of the split criterion, which as printed grows beyond all bounds where normals stand upright."""


def _check_alpha(alpha: float, low: float = 0.0) -> float:
    return check_range(
        "alpha",
        alpha,
        low,
        100.0,
        "Below 0 furrows turn round and bulges sharp. Use values between 1 (soft) and 4 (sharp); the default is 2.",
    )


# --- Section 3.2, linear muscles: Eqs. 1 to 11 ---------------------------------------------------------


def linear_coordinates(along: Array, angle: Array, radius: float, max_angle: float) -> tuple[Array, Array]:
    """Return lambda and gamma of points in the area of influence of a linear muscle (Eqs. 1 and 2).

    ``lambda = l / R`` and ``gamma = phi_i / phi``.

    Parameters
    ----------
    along : ndarray, shape (n,)
        l, the distance from the attachment along the central fiber: ``|x - mA| cos(phi_i)``.
    angle : ndarray, shape (n,)
        phi_i, the angle at the attachment between the central fiber and the point.
    radius, max_angle : float
        R and phi, length and half opening angle of the cone.

    Examples
    --------
    >>> linear_coordinates(np.array([20.0]), np.array([0.25]), radius=40.0, max_angle=0.5)
    (array([0.5]), array([0.5]))
    """
    return along / radius, angle / max_angle


def shape(w: float | npt.ArrayLike, u: float, k0: float | Array = 1.0, alpha: float = 2.0, blunt: float = 0.0) -> Array:
    """Cross-section H of a wrinkle (Eqs. 4 and 15): furrows at w = 0 and 2u, the bulge at w = u.

    ``H(w) = d - k0 |s| (1 + s^2)^alpha`` with ``s = (w - u) / u``; its integral over [0, 2u] is zero.

    Parameters
    ----------
    w : array_like
        Position within the cycle, in [0, 2u].
    u : float
        Half cycle, > 0, in the unit of `w`.
    k0 : float or array
        Furrow depth factor, mm.
    alpha : float
        Shape exponent, >= 0; sharp furrows need > 0.
    blunt : float
        In [0, 1]: each height is replaced by the mean of those within this many half cycles on either side. That keeps
        the volume, and rounds the bottom of the furrow.

    Returns
    -------
    ndarray
        Height in mm, shape of `w`.

    Raises
    ------
    ParameterError
        If `alpha` is not in [0, 100], `blunt` not in [0, 1], or `u` not positive.

    Examples
    --------
    >>> shape([0.0, 1.0, 2.0], 1.0, k0=1.0, alpha=1.0)
    array([-1.25,  0.75, -1.25])
    >>> shape([0.0, 1.0, 2.0], 1.0, k0=1.0, alpha=1.0, blunt=1.0)
    array([0., 0., 0.])
    """
    if not u > 0.0:
        raise ParameterError(f"the half cycle u must be positive, received {u!r}.")
    s = (np.asarray(w, dtype=np.float64) - u) / u
    if check_range("blunt", blunt, 0.0, 1.0) > 0.0:
        below = (fall_integral(s + blunt, _check_alpha(alpha)) - fall_integral(s - blunt, alpha)) / (2.0 * blunt)
    else:
        below = fall(s, _check_alpha(alpha))
    return np.asarray(bulge_height(k0, alpha) - k0 * below)


def fall(s, alpha):  # type: ignore[no-untyped-def]
    """Return how far H falls from the top of the bulge (Eq. 4): ``|s| (1 + s^2)^alpha``, at k0 = 1 and s in [-1, 1].

    Numbers or arrays; loops in machine code take the compiled form.

    Examples
    --------
    >>> float(fall(-1.0, 2.0))
    4.0
    """
    return np.abs(s) * (1.0 + s * s) ** alpha


def fall_integral(s, alpha):  # type: ignore[no-untyped-def]
    """Return the integral from 0 to s of :func:`fall`, which is repeated from [-1, 1] with the period 2.

    Over a period it is twice the height of the bulge (Eq. 7), so that H takes no volume.

    Examples
    --------
    >>> float(fall_integral(2.0, 1.0)) == 2.0 * bulge_height(1.0, 1.0)
    True
    """
    cycles = np.rint(0.5 * s)
    within = s - 2.0 * cycles
    period = (2.0 * 2.0**alpha - 1.0) / (alpha + 1.0)
    part = ((1.0 + within * within) ** (alpha + 1.0) - 1.0) / (2.0 * (alpha + 1.0))
    return cycles * period + np.copysign(part, within)


def half_cycle(length: float, lambda_w: float, n: int) -> float:
    """Half cycle u of n wrinkles in the wrinkling region (Eq. 5): ``u = (1 - lambda_w) length / (2 n)``.

    `length` is R for a linear muscle, Ls for a sheet. For a sphincter (Eq. 16) pass beta1 + beta2 and lambda_w = 0.

    Examples
    --------
    >>> half_cycle(40.0, 0.25, 3)
    5.0
    """
    check_whole("the number of wrinkles", n, 1, 1e9)
    check_range("lambda_w", lambda_w, 0.0, 1.0 - 1e-9, "At 1 no wrinkling region is left.")
    return (1.0 - lambda_w) * length / (2.0 * n)


def phase(l: npt.ArrayLike, start: float, u: float, alpha: float, ends: Ends = "continuous") -> Array:
    """Position w in [0, 2u) within the cycle of a point at distance l along the muscle (Eqs. 6 and 16).

    Parameters
    ----------
    l : array_like
        Distance along the muscle (an angle for a sphincter).
    start : float
        Start of the wrinkling region: lambda_w R, or -beta1.
    u : float
        Half cycle.
    alpha : float
        Shape exponent, which decides where H crosses zero.
    ends : {"continuous", "paper"}
        "continuous" starts the cycle at the zero of H, so that W is 0 at both ends of the region. "paper" starts at the
        bottom of a furrow, as printed, so that W jumps there.

    Examples
    --------
    >>> phase([10.0, 12.0, 15.0], 10.0, 2.0, alpha=2.0, ends="paper")
    array([0., 2., 1.])
    """
    if ends not in get_args(Ends):
        raise ParameterError(f"ends must be one of {', '.join(get_args(Ends))}, received {ends!r}.")
    shift = 0.0 if ends == "paper" else u * (1.0 - zero_crossing(_check_alpha(alpha)))
    return np.mod(np.asarray(l, dtype=np.float64) - start + shift, 2.0 * u)


def bulge_height(k0: float | Array, alpha: float) -> float | Array:
    """Height d of the bulge that makes a wrinkle keep its volume (closed form of Eq. 7).

    Parameters
    ----------
    k0 : float or array
        Furrow depth factor, mm.
    alpha : float
        Shape exponent, >= -1.

    Returns
    -------
    float or array
        ``d = k0 (2^(alpha+1) - 1) / (2 (alpha + 1))``, and its limit ``k0 ln(2) / 2`` at alpha = -1, in mm.

    Raises
    ------
    ParameterError
        If `alpha` is not in [-1, 100].

    Examples
    --------
    >>> bulge_height(1.0, 1.0)
    0.75
    """
    x = _check_alpha(alpha, low=-1.0) + 1.0
    log2 = float(np.log(2.0))
    ratio = log2 if x == 0.0 else float(np.expm1(x * log2)) / x if x < 0.5 else (2.0**x - 1.0) / x
    return k0 * (0.5 * ratio)


class EdgeWeights:
    """Compression along a direction, from the shortening of the edges around some vertices of a mesh (Eqs. 8-9).

    ``tau_ij = (L_ij - |x_i - x_j|) / L_ij``, ``epsilon_i = sum tau_ij |cos theta_ij| / sum |cos theta_ij|``, where
    theta_ij is the angle of an edge in the deformed mesh. The absolute value is not printed in the paper but needed:
    with the signed cosine the denominator vanishes on every symmetric ring.

    Parameters
    ----------
    rest : ndarray, shape (n, 3)
    rings : tuple of ndarray
        Neighbors of each vertex, as (indptr, indices).
    vertices : ndarray of int, shape (p,)
        Those at which compression is measured; one may come several times.

    Examples
    --------
    One direction at the first vertex, two at the second; the sheet is compressed by a fifth along x:

    >>> from facewrinkle.geometry.topology import vertex_rings
    >>> sheet = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> directions = np.array([[1.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> weights = EdgeWeights(sheet, vertex_rings([[0, 1, 2]]), np.array([0, 1, 1]))
    >>> weights.epsilon(sheet * [0.8, 1, 1], directions).round(3)
    array([0.2  , 0.159, 0.094])
    """

    def __init__(self, rest: Array, rings: tuple[IntArray, IntArray], vertices: IntArray) -> None:
        offsets, neighbors = rings
        counts = np.diff(offsets)[vertices]
        self._owner = np.repeat(np.arange(len(vertices)), counts)
        place = np.arange(len(self._owner)) - np.repeat(np.cumsum(counts) - counts, counts)
        self._i = vertices[self._owner]
        self._j = neighbors[offsets[self._i] + place]
        self._length = np.linalg.norm(rest[self._j] - rest[self._i], axis=1)
        self._n = len(vertices)

    def epsilon(self, deformed: Array, directions: Array) -> Array:
        """Return the compression (p,) in the deformed mesh (n, 3) along unit directions (p, 3) there.

        1 where all edges have shrunk to nothing, below 0 where the skin is stretched. Exactly c under a uniform scaling
        by 1 - c; about 2c/3 under a slight uniaxial compression by c in an isotropic ring.
        """
        edge = deformed[self._j] - deformed[self._i]
        length = np.linalg.norm(edge, axis=1)
        along = np.abs((edge * directions[self._owner]).sum(axis=1))
        weight = np.divide(along, length, out=np.ones_like(length), where=length > 0.0)  # a point has no direction
        total, weighted = (
            np.bincount(self._owner, values, self._n) for values in (weight, weight * (1.0 - length / self._length))
        )
        return np.asarray(weighted / np.where(total > 0.0, total, 1.0), np.float64)


def anisotropy(epsilon: npt.ArrayLike) -> Array:
    """Share A of the amplitude at compression epsilon (Eq. 10): ``sin(pi epsilon / 2)``, 0 where the skin is stretched.

    Examples
    --------
    >>> anisotropy([-0.5, 0.0, 1.0])
    array([0., 0., 1.])
    """
    return np.sin(0.5 * np.pi * np.clip(np.asarray(epsilon, dtype=np.float64), 0.0, 1.0))


def attenuation(s: npt.ArrayLike, falloff: Falloff = "paper") -> Array:
    """Lateral fade At from 1 inside (s <= 0) to 0 at the border (s >= 1) of the region (Eqs. 11, 13, 17).

    Parameters
    ----------
    s : array_like
        Normalized position in the outer band.
    falloff : {"paper", "smoothstep"}
        "paper" is ``1 - (s + s^3) / 2``, continuous in value only; "smoothstep" is ``1 - 3 s^2 + 2 s^3``, continuous
        in slope.

    Examples
    --------
    >>> attenuation([0.0, 0.5, 1.0])
    array([1.    , 0.6875, 0.    ])
    """
    if falloff not in get_args(Falloff):
        raise ParameterError(f"falloff must be one of {', '.join(get_args(Falloff))}, received {falloff!r}.")
    if falloff == "smoothstep":
        return 1.0 - smoothstep(s)
    s = np.clip(np.asarray(s, dtype=np.float64), 0.0, 1.0)
    return np.asarray(1.0 - 0.5 * (s + s**3))


def band(x: npt.ArrayLike, inner: float, outer: float) -> Array:
    """Position s of x in the band from `inner` (s = 0) to `outer` (s = 1); a band of zero width is a hard edge.

    Examples
    --------
    >>> band([1.0, 2.5, 3.0], 2.0, 3.0)
    array([-1. ,  0.5,  1. ])
    """
    x = np.asarray(x, dtype=np.float64)
    if outer == inner:
        return np.where(x <= inner, 0.0, 1.0)
    return (x - inner) / (outer - inner)


# --- Section 3.3, sheet muscles: Eqs. 12 and 13, which is Eq. 11 with the distance from the fiber -------


def sheet_coordinates(along: Array, across: Array, length: float, width: float | Array) -> tuple[Array, Array]:
    """Return lambda and gamma of points in the area of influence of a sheet muscle (Eq. 12).

    ``lambda = l / Ls`` and ``gamma = 2 h / Ws``.

    Parameters
    ----------
    along, across : ndarray, shape (n,)
        l and h, the distances from the attachment line and from the central fiber.
    length, width : float, or width of shape (n,)
        Ls and Ws.

    Examples
    --------
    >>> sheet_coordinates(np.array([30.0]), np.array([5.0]), length=40.0, width=20.0)
    (array([0.75]), array([0.5]))
    """
    return along / length, 2.0 * across / width


# --- Section 3.4, sphincter muscles: Eqs. 14 to 18; 15 and 16 are 4 to 6 with angles, 17 is 11 ---------


def sphincter_coordinates(s: Array, t: Array, semi_major: float, semi_minor: float) -> tuple[Array, Array]:
    """Return the relative radius r and the angle psi of points about the centre of a sphincter muscle (Eq. 14).

    ``r = sqrt((s / a)^2 + (t / b)^2)``, and psi is the angle from the major axis.

    Parameters
    ----------
    s, t : ndarray, shape (n,)
        Lateral and vertical coordinate in the plane of the muscle.
    semi_major, semi_minor : float
        a and b.

    Examples
    --------
    >>> r, psi = sphincter_coordinates(np.array([20.0, 0.0]), np.array([0.0, 30.0]), 40.0, 30.0)
    >>> r.tolist(), psi.round(3).tolist()
    ([0.5, 1.0], [0.0, 1.571])
    """
    return np.hypot(s / semi_major, t / semi_minor), np.arctan2(t, s)


def ring_attenuation(r: Array, inner: float, core: float, falloff: Falloff = "paper") -> Array:
    """Return the fade At on the inner and the outer band of a sphincter's wrinkling region (Eqs. 17 and 18).

    The bands have the width ``dr = (ac - a') / a``, with ac chosen so that they never overlap:
    ``dr = (1 - core) (1 - rw) / 2``.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Relative radius, in [rw, 1].
    inner : float
        rw = a' / a, inner radius of the region.
    core : float
        Share of the ring without attenuation, in [0, 1].
    falloff : {"paper", "smoothstep"}
        See :func:`attenuation`.

    Examples
    --------
    >>> ring_attenuation(np.array([0.5, 0.75, 1.0]), inner=0.5, core=0.5)
    array([0., 1., 0.])
    """
    dr = 0.5 * (1.0 - core) * (1.0 - inner)
    inside = attenuation(band(-r, -inner - dr, -inner), falloff)
    return inside * attenuation(band(r, 1.0 - dr, 1.0), falloff)


# --- Section 4, refinement: Eq. 19 -----------------------------------------------------------------------


@compiled(inline="always")
def split_criterion(rest, now):  # type: ignore[no-untyped-def]
    """Return how far an edge has bent (Eq. 19).

    ``gamma = (n0i . n0j - ni . nj) / (n0i . n0j)``. The denominator is at least `LEAST_COSINE`. An edge
    is split where gamma exceeds gamma_c.

    Parameters
    ----------
    rest, now : float
        Cosines ``n0i . n0j`` and ``ni . nj`` between the normals at the ends of the edge, at rest and of the wrinkled
        surface.

    Examples
    --------
    A bend of 14 degrees:

    >>> round(split_criterion(1.0, np.cos(np.radians(14.0))), 3)
    0.03
    """
    return (rest - now) / max(abs(rest), LEAST_COSINE)


# --- beyond the paper ------------------------------------------------------------------------------------


@lru_cache(maxsize=256)
def zero_crossing(alpha: float) -> float:
    """The s0 in (0, 1) at which the cross-section crosses zero: ``s0 (1 + s0^2)^alpha = d / k0``.

    Examples
    --------
    >>> round(zero_crossing(2.0), 12)
    0.614616206437
    """
    ratio, low, high = float(bulge_height(1.0, _check_alpha(alpha))), 0.0, 1.0
    while low < (middle := 0.5 * (low + high)) < high:  # to the last bit; importing SciPy's solvers takes .2 s
        if fall(middle, alpha) < ratio:
            low = middle
        else:
            high = middle
    return high


def deepest(wavelength: npt.ArrayLike, epsilon: npt.ArrayLike) -> Array:
    """The greatest height, from furrow to bulge, of the folds of inextensible skin that is compressed by epsilon.

    A wave of length L whose arc is longer than its chord by the share epsilon measures ``2 L sqrt(epsilon) / pi`` from
    its lowest to its highest point (a sine, to second order in its slope); 0 where the skin is stretched. In the unit
    of `wavelength`.

    Examples
    --------
    >>> deepest(10.0, [-0.1, 0.0, 0.25]).round(3)
    array([0.   , 0.   , 3.183])
    """
    return np.asarray(2.0 / np.pi * np.asarray(wavelength) * np.sqrt(np.clip(epsilon, 0.0, 1.0)))
