"""Rotation and shift between two sets of points, such as those of a head whose face moves too."""

from __future__ import annotations

import numpy as np

from ..array_types import Array


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
