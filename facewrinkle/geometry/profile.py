"""The shape of a wrinkle across its furrow, as formulas on arrays.

Paper: Zhang, Sim, Tan, "Realistic and Efficient Wrinkle Simulation Using An Anatomy-based Face Model with
Adaptive Refinement". The amplitude of a wrinkle is ``W = H(w) A(epsilon) At(s)`` (Eq. 3). Lengths in mm, angles in
radians; along a sphincter `w`, `u`, `l` and `start` are angles, `k0` stays a length.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import ParameterError, check_range, check_whole
from .smoothstep import smoothstep

Ends = Literal["continuous", "paper"]
Falloff = Literal["paper", "smoothstep"]

ENDS: tuple[Ends, ...] = ("continuous", "paper")
FALLOFFS: tuple[Falloff, ...] = ("paper", "smoothstep")


def _check_alpha(alpha: float, low: float = 0.0) -> float:
    return check_range(
        "alpha",
        alpha,
        low,
        100.0,
        "Below 0 furrows turn round and bulges sharp. Use values between 1 (soft) and 4 (sharp); the default is 2.",
    )


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
        below = (_below(s + blunt, _check_alpha(alpha)) - _below(s - blunt, alpha)) / (2.0 * blunt)
    else:
        below = np.abs(s) * (1.0 + s * s) ** _check_alpha(alpha)
    return np.asarray(bulge_height(k0, alpha) - k0 * below)


def _below(s: Array, alpha: float) -> Array:
    """Integral from 0 to s of ``|t| (1 + t^2)^alpha``, which is repeated from [-1, 1] with the period 2."""
    cycles = np.round(0.5 * s)
    within = s - 2.0 * cycles
    full = (2.0 ** (alpha + 1.0) - 1.0) / (alpha + 1.0)
    part = ((1.0 + within * within) ** (alpha + 1.0) - 1.0) / (2.0 * (alpha + 1.0))
    return np.asarray(cycles * full + np.copysign(part, within))


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
        if middle * (1.0 + middle * middle) ** alpha < ratio:
            low = middle
        else:
            high = middle
    return high


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
    if ends not in ENDS:
        raise ParameterError(f"ends must be one of {', '.join(ENDS)}, received {ends!r}.")
    shift = 0.0 if ends == "paper" else u * (1.0 - zero_crossing(_check_alpha(alpha)))
    return np.mod(np.asarray(l, dtype=np.float64) - start + shift, 2.0 * u)


def attenuation(s: npt.ArrayLike, falloff: Falloff = "paper") -> Array:
    """Lateral fade At from 1 inside (s <= 0) to 0 at the border (s >= 1) of the region (Eqs. 11, 13, 17).

    Parameters
    ----------
    s : array_like
        Normalised position in the outer band.
    falloff : {"paper", "smoothstep"}
        "paper" is ``1 - (s + s^3) / 2``, continuous in value only; "smoothstep" is ``1 - 3 s^2 + 2 s^3``, continuous
        in slope.

    Examples
    --------
    >>> attenuation([0.0, 0.5, 1.0])
    array([1.    , 0.6875, 0.    ])
    """
    if falloff not in FALLOFFS:
        raise ParameterError(f"falloff must be one of {', '.join(FALLOFFS)}, received {falloff!r}.")
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


def anisotropy(epsilon: npt.ArrayLike) -> Array:
    """Share A of the amplitude at compression epsilon (Eq. 10): ``sin(pi epsilon / 2)``, 0 where the skin is stretched.

    Examples
    --------
    >>> anisotropy([-0.5, 0.0, 1.0])
    array([0., 0., 1.])
    """
    return np.sin(0.5 * np.pi * np.clip(np.asarray(epsilon, dtype=np.float64), 0.0, 1.0))


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
