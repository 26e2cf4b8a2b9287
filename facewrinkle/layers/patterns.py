"""Pattern functions: formulas on arrays for heights over a plane that form wrinkles, dimples and pouches.

Paper: Lin, Cheng, "Modeling Three Dimensional Animated, Detailed, and Emotional Facial Expressions", Section 3. Each
is z = f(x, y, t) in local coordinates of a selected area; alpha, beta and gamma are parameters, t is time. The phases
of waves have functions of their own. What is read where the print is damaged: docs/theory/patterns.rst.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import ParameterError, check_name, check_positive, check_range, check_whole

PatternFunction = Callable[[npt.ArrayLike, npt.ArrayLike, float], Array]
"""A function of x, y and t."""

Variant = Literal["paper", "fan"]


def angle(x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
    """Return arctan(y / x) in [-pi/2, pi/2]: the same on both sides of the origin, and 0 at it.

    Examples
    --------
    >>> angle([1.0, -1.0, 0.0, 0.0], [1.0, -1.0, 2.0, 0.0]) / np.pi
    array([0.25, 0.25, 0.5 , 0.  ])
    """
    x, y = _plane(x, y)
    return np.asarray(np.arctan2(np.copysign(1.0, x) * y, np.abs(x)))


def forehead(x: npt.ArrayLike, y: npt.ArrayLike, t: float, alpha: float, beta: float) -> Array:
    """Forehead wrinkles: ``exp(alpha sin(x^2 + y^2 - (t sin th - sin(beta th))^2))`` with ``th = arctan(y / x)``.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Local coordinates; x points up the forehead. Use x of about 2 to 4.2, y of -2.5 to 2.5, away from the origin.
    t : float
        Time: runs the wrinkles through their cycle.
    alpha : float
        Depth: from peak to valley it is 2 sinh(alpha).
    beta : float
        Style: 0 to 3 plain arcs, 4 to 5 M-shaped, 8 and more broken.

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    >>> round(float(forehead(1.0, 0.0, 1.2, alpha=0.5, beta=4.0)), 6)
    1.523081
    """
    return np.asarray(np.exp(alpha * np.sin(forehead_phase(x, y, t, beta))))


def forehead_phase(x: npt.ArrayLike, y: npt.ArrayLike, t: float, beta: float) -> Array:
    """Return the phase of the sine in :func:`forehead`, radians."""
    x, y = _plane(x, y)
    th = angle(x, y)
    return np.asarray((x * x + y * y) - (t * np.sin(th) - np.sin(beta * th)) ** 2)


def eye_corner(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    t: float,
    alpha: float,
    beta: float,
    gamma: Array | float,
) -> Array:
    """Wrinkles that fan out from the corner of an eye: ``alpha exp(beta r - t sin(gamma arctan(y / x)))``.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Local coordinates about the corner; x points outwards.
    t : float
        Amplitude of the wrinkles.
    alpha : float
        Depth.
    beta : float
        Decay: below 0 they grow shallower outwards.
    gamma : float or ndarray, shape (n,)
        Number: gamma / 2 on one side. For points on both sides of x = 0 it has to be even, or the surface tears there.
        The paper's is one number; if it falls outwards, the wrinkles curve apart.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    ParameterError
        If `gamma` is not even and points lie on both sides of x = 0.

    Examples
    --------
    >>> round(float(eye_corner(1.0, 0.0, 0.6, alpha=2.0, beta=-0.9, gamma=8)), 6)
    0.813139
    """
    x, y = _plane(x, y)
    odd = np.ravel(gamma)[np.ravel(gamma) % 2.0 != 0.0]
    if odd.size and x.size and x.min() <= 0.0 <= x.max() and x.min() < x.max():
        raise ParameterError(
            f"gamma must be an even number where a pattern lies on both sides of x = 0, received {odd[0]:g}: the "
            f"surface would tear there. Use {max(2 * round(odd[0] / 2), 2)}, or keep to x > 0."
        )
    sine = np.sin(eye_corner_phase(x, y, gamma))
    return np.asarray(alpha * np.exp(beta * np.hypot(x, y) - t * sine))


def eye_corner_phase(x: npt.ArrayLike, y: npt.ArrayLike, gamma: Array | float) -> Array:
    """Return the phase of the sine in :func:`eye_corner`, radians."""
    return np.asarray(gamma * angle(x, y))


def cheek(x: npt.ArrayLike, y: npt.ArrayLike, t: float, alpha: float, beta: float) -> Array:
    """Wrinkles in arcs about the origin: ``alpha sin(beta r + t)``.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Local coordinates.
    t : float
        Phase, radians.
    alpha : float
        Depth: half of peak to valley.
    beta : float
        Number: beta / 2 pi of them per unit length.

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    >>> round(float(cheek(1.0, 0.0, 0.3, alpha=0.5, beta=5.0)), 6)
    -0.416134
    """
    return np.asarray(alpha * np.sin(cheek_phase(x, y, t, beta)))


def cheek_phase(x: npt.ArrayLike, y: npt.ArrayLike, t: float, beta: float) -> Array:
    """Return the phase of the sine in :func:`cheek`, radians."""
    x, y = _plane(x, y)
    return np.asarray(beta * np.hypot(x, y) + t)


def frown(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    t: float,
    alpha: float,
    beta: float,
    variant: Variant = "paper",
) -> Array:
    """Frown lines: ``alpha sin((x / beta) (y + t))``.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Local coordinates; the lines run along y.
    t : float
        The larger, the more parallel they are.
    alpha : float
        Depth: half of peak to valley.
    beta : float
        Distance: 2 pi beta / (y + t) from line to line.
    variant : {"paper", "fan"}
        The lines draw together upwards in "paper", and spread in "fan": ``alpha sin(x / (beta (y + t)))``.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    UnknownNameError
        For an unknown variant.
    ParameterError
        If beta is 0, or y + t is not above 0 everywhere in a fan.

    Examples
    --------
    >>> frown(1.0, 0.5, 1.0, alpha=1.0, beta=3.0 / np.pi)
    array(1.)
    """
    return np.asarray(alpha * np.sin(frown_phase(x, y, t, beta, variant)))


def frown_phase(x: npt.ArrayLike, y: npt.ArrayLike, t: float, beta: float, variant: Variant = "paper") -> Array:
    """Return the phase of the sine in :func:`frown`, radians; errors are those of that function."""
    x, y = _plane(x, y)
    if beta == 0.0:
        raise ParameterError("beta must not be 0: it is the distance of the wrinkles.")
    check_name("variant of frown", variant, get_args(Variant))
    if variant == "fan" and y.size and not (y + t).min() > 0.0:
        raise ParameterError(f"y + t must be above 0 all over a fan, received {(y + t).min():g}. Use a larger t.")
    return np.asarray(x / beta * (y + t) if variant == "paper" else x / (beta * (y + t)))


def dimple(x: npt.ArrayLike, y: npt.ArrayLike, t: float) -> Array:
    """A dimple: ``log(x^2 + y^2 + t)``, deeper as t falls towards 0.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Local coordinates about its centre.
    t : float
        Above 0; :func:`dimple_time` returns the t of a strength.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    ParameterError
        If t is not above 0.

    Examples
    --------
    >>> round(float(dimple(1.0, 0.0, 0.05)), 6)
    0.04879
    """
    _positive(t)
    x, y = _plane(x, y)
    return np.asarray(np.log(x * x + y * y + t))


def dimple_time(strength: float, sharpest: float) -> float:
    """Return the t at which a dimple is `strength` times as deep as at t = `sharpest`; infinite at rest.

    Between its centre and r = 1 a dimple is ``log(1 + 1 / t)`` deep: ``t = 1 / expm1(strength log1p(1 / sharpest))``.

    Examples
    --------
    >>> dimple_time(1.0, 0.05), dimple_time(0.0, 0.05)
    (0.05, inf)
    """
    depth = check_range("strength", strength, 0.0, 10.0) * np.log1p(1.0 / _positive(sharpest))
    return float(1.0 / np.expm1(depth)) if depth > 0.0 else np.inf


def eye_pouch(x: npt.ArrayLike, y: npt.ArrayLike, t: float, alpha: float, beta: float, gamma: int) -> Array:
    """A trembling pouch: ``(cos(x + alpha t) + cos(y + beta t))^gamma / t``.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Local coordinates.
    t : float
        Time, at least 0.01: the formula is singular at 0.
    alpha, beta : float
        Style of the trembling: speed of the bumps along x and y.
    gamma : int
        Height, at least 0; even for bumps that all stick out.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    ParameterError
        If t is below 0.01 or gamma is not a whole number from 0 to 64 (the sum of cosines is negative in places).

    Examples
    --------
    >>> round(float(eye_pouch(0.0, 0.0, 2.0, alpha=1.0, beta=1.0, gamma=2)), 6)
    0.346356
    """
    check_range("t", t, 0.01, np.inf, "The eye pouch grows beyond all bounds as t falls to 0.")
    power = check_whole("gamma", gamma, 0, 64, "An even number makes bumps that stick out.")
    x, y = _plane(x, y)
    return np.asarray((np.cos(x + alpha * t) + np.cos(y + beta * t)) ** power / t)


def _plane(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Array, Array]:
    """x and y as finite arrays of one shape."""
    x, y = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64))
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise ParameterError("x and y must be finite; NaN or infinite coordinates were received.")
    return x, y


def _positive(t: float) -> float:
    return check_positive("t", t, "A dimple is deeper the smaller t is.")
