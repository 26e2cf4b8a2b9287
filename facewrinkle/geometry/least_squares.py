"""Least squares: a smooth function through or near scattered values (Lin and Cheng, Section 4.2), and the rotation and
shift between two sets of points, such as those of a head whose face moves too.
"""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import FitWarning, ParameterError, check_range, check_whole, warn
from .compilation import compiled

BLOCK = 2**20
"""The largest array holds at most this many numbers at any time."""


def monomials(offset: Array, degree: int) -> Array:
    """The basis b (..., m) of the polynomials of total degree `degree` at offsets (..., d): m = (d + r)! / (d! r!).

    Examples
    --------
    >>> monomials(np.array([2.0, 3.0]), 2)
    array([1., 2., 3., 4., 6., 9.])
    """
    d = offset.shape[-1]
    columns = [np.ones(offset.shape[:-1])]
    for r in range(1, degree + 1):
        columns += [offset[..., list(which)].prod(axis=-1) for which in combinations_with_replacement(range(d), r)]
    return np.stack(columns, axis=-1)


def moving_least_squares(
    x: npt.ArrayLike, points: npt.ArrayLike, values: npt.ArrayLike, degree: int = 1, epsilon: float = 0.0
) -> Array:
    """Values f(x) of polynomials fitted to the values f_i at p_i, each x with weights of its own.

    The paper's normal equations ``f(x) = b(x)^T A^-1 sum_i w_i b(p_i) f_i``, ``A = sum_i w_i b b^T``,
    ``w_i = 1/(|x - p_i|^2 + epsilon^2)``, are solved as the least-squares problem behind them, in a basis that is
    centred at x and scaled: as printed, they lose all digits far from the origin.

    Parameters
    ----------
    x : array_like, shape (q, d)
    points : array_like, shape (n, d)
    values : array_like, shape (n,)
    degree : int
        The degree r. Only with 0 do the results stay between the smallest and the largest value.
    epsilon : float
        A length; 0 interpolates: f(p_i) = f_i.

    Returns
    -------
    ndarray, shape (q,)

    Raises
    ------
    ParameterError
        For shapes that do not fit, numbers that are not finite, an epsilon outside [0, 1e50], or a degree that is not
        a whole number from 0 to 8.

    Warns
    -----
    FitWarning
        If the points do not determine a polynomial of this degree (too few, or on a line): a lower one is fitted.

    Examples
    --------
    >>> points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    >>> moving_least_squares([[0.25, 0.5]], points, [1.0, 3.0, 2.0, 4.0])
    array([2.])
    """
    where, points, values = (np.asarray(a, dtype=np.float64) for a in (x, points, values))
    degree, epsilon = check_whole("degree", degree, 0, 8), check_range("epsilon", epsilon, 0.0, 1e50)
    if where.ndim != 2 or points.ndim != 2 or where.shape[1] != points.shape[1] or values.shape != points.shape[:1]:
        raise ParameterError(
            f"x must be (q, d), points (n, d) and values (n,), received {where.shape}, {points.shape}, {values.shape}."
        )
    if not len(points) or not all(np.isfinite(a).all() for a in (where, points, values)):
        raise ParameterError("x, points and values must be finite, and there must be at least one point.")
    out, lowered = np.empty(len(where)), 0
    size = max(BLOCK // (len(points) * monomials(points[0], degree).size), 1)
    for first in range(0, len(where), size):
        block = slice(first, first + size)
        out[block], low = _fitted(where[block], points, values, degree, epsilon)
        lowered += low
    if lowered:
        warn(
            f"the points do not determine a polynomial of degree {degree} at {lowered} of {len(where)} places; one of "
            "a lower degree was fitted there. Give more points, not all on a line, or ask for a lower degree.",
            FitWarning,
        )
    return out


def _fitted(where: Array, points: Array, values: Array, degree: int, epsilon: float) -> tuple[Array, int]:
    """Values at places (q, d), and the number of places at which the degree had to be lowered."""
    offset = points - where[:, None]
    square = (offset**2).sum(axis=2)
    hit = np.asarray((square == 0.0) & (epsilon == 0.0))
    on_point = np.asarray(hit.any(axis=1))
    weight = np.where(on_point[:, None], hit, 1.0) / np.where(hit, 1.0, square + epsilon**2)
    # Even right next to a point, the others still determine the polynomial.
    weight = np.maximum(weight / weight.max(axis=1, keepdims=True), np.where(on_point[:, None], 0.0, 1e-12))
    out = (weight * values).sum(axis=1) / weight.sum(axis=1)  # degree 0, and the data themselves
    pending = np.flatnonzero(~on_point)
    scale = np.sqrt(square.max(axis=1))
    lowered = 0
    for r in range(degree, 0, -1):
        if not len(pending):
            break
        basis = monomials(offset[pending] / scale[pending, None, None], r)
        root = np.sqrt(weight[pending])
        u, sigma, v = np.linalg.svd(basis * root[..., None], full_matrices=False)
        least = 1e-9 if len(points) >= basis.shape[2] else np.inf  # smaller shares of the largest value count as 0
        enough = np.array(sigma[:, -1] > least * sigma[:, 0], dtype=bool, ndmin=1)
        inverse = np.where(enough[:, None], 1.0 / np.where(enough[:, None], sigma, 1.0), 0.0)
        right = np.einsum("qnk,qn->qk", u, root * values)
        constant = np.einsum("qk,qk->q", v[:, :, 0], inverse * right)  # at its centre a polynomial is its constant
        out[pending[enough]] = constant[enough]
        lowered = max(lowered, int((~enough).sum()))
        pending = pending[~enough]
    return out, lowered


def closest_rotations(covariances: Array) -> Array:
    """Rotations (..., 3, 3) that best turn one set of points into another, each from their cross-covariance.

    The cross-covariance of points x and y (n, 3) about their centroids is ``x.T @ y``, and ``x @ rotation`` is as near
    to y as it can be (Kabsch 1976). Mirrorings are ruled out.

    Parameters
    ----------
    covariances : ndarray, shape (..., 3, 3)

    Returns
    -------
    ndarray, shape (..., 3, 3)

    Examples
    --------
    >>> x = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]])
    >>> quarter = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    >>> np.allclose(closest_rotations(x.T @ (x @ quarter)), quarter)
    True
    """
    left, _, right = np.linalg.svd(covariances)
    left[..., 2] *= np.sign(np.linalg.det(left @ right))[..., None]
    return np.asarray(left @ right)


def rigid_motion(rest: Array, now: Array, tolerance: float, rounds: int = 12) -> Array:
    """Return the rotation and shift that take most points from rest to `now`, as a matrix (4, 4).

    Points that this leaves farther off than the tolerance count little (Geman and McClure's weights, anew after each
    least-squares fit).

    Parameters
    ----------
    rest, now : ndarray, shape (n, 3)
    tolerance : float
    rounds : int
        Number of fits.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> rigid_motion(corners, corners + [0.0, 2.0, 0.0], 0.01)[:3, 3].round(9).tolist()
    [0.0, 2.0, 0.0]
    """
    turn, shift = np.eye(3), np.zeros(3)
    weights = 1.0 / (1.0 + ((now - rest) ** 2).sum(axis=1) / tolerance**2) ** 2
    if weights.mean() < 0.2:  # the head has moved
        weights = np.ones(len(now))
    for _ in range(rounds):
        total = weights.sum()
        before, after = weights @ rest / total, weights @ now / total
        turn = closest_rotations((rest - before).T @ ((now - after) * weights[:, None])).T
        shift = after - turn @ before
        off = ((now - rest @ turn.T - shift) ** 2).sum(axis=1)
        scale = max(tolerance**2, float(np.median(off)))
        weights = 1.0 / (1.0 + off / scale) ** 2
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, shift
    return out


@compiled(inline="always")
def cholesky_solve(matrix, out):
    """Solve in place (m,) with a symmetric positive definite matrix (m, m), whose lower half is overwritten."""
    m = out.shape[0]
    column = np.empty(m)
    for j in range(m):
        matrix[j, j] = np.sqrt(max(matrix[j, j], 1e-300))
        for i in range(j + 1, m):
            column[i] = matrix[i, j] = matrix[i, j] / matrix[j, j]
        for i in range(j + 1, m):
            for k in range(j + 1, i + 1):
                matrix[i, k] -= column[i] * column[k]
    for i in range(m):
        for k in range(i):
            out[i] -= matrix[i, k] * out[k]
        out[i] /= matrix[i, i]
    for i in range(m - 1, -1, -1):
        out[i] /= matrix[i, i]
        for k in range(i):
            out[k] -= matrix[i, k] * out[i]
