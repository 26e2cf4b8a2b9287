"""Cropped hair of the built-in head: hairs that grow away from a whorl, the shorter, the thinner they stand.

Lengths are in mm.
"""

from __future__ import annotations

import numpy as np

from ..geometry import double_areas, smoothstep, unit, vertex_normals
from .head import BoundHairs, Head

SEED = 3
"""All people have the same hairs, in their own colors."""

HAIRS, KNOTS = 45000, 3
"""Hairs on all of the skin, of which those grow that are on the scalp, and points along each."""

WHORL = np.array([8.0, 115.0, -62.0])
"""Hair grows away from here, at the back of the crown."""

ASTRAY = 0.35
"""Deviation of the direction of single hairs from that, radians."""

SHORTEST, LONGEST, FEMININE = 7.0, 16.0, 22.0
"""Least and greatest length of cropped hair where it is dense, and what women and children may have beyond."""

FEWEST = 0.12
"""Share of hair in the color of the skin up to which none grows."""

THIN = 0.2
"""Share of that length that hairs have where hardly any grow."""

SLOPE, BENT = (0.2, 0.6), 0.5
"""Least and largest slope of hairs out of the skin, and the share of it that they lose up to their tips."""

ROUND = 90.0
"""Radius of the scalp that hairs bend around."""


def cropped_hair(head: Head, length: float, sex: float = 0.0) -> BoundHairs | None:
    """Return cropped hair on the skin of a head; None for a shaved one.

    Parameters
    ----------
    head : Head
    length : float
        From the shortest (-1) to the longest (0).
    sex : float
        From feminine or childlike (-1), with longer hair, to masculine.

    Examples
    --------
    >>> from facewrinkle.anatomy.head import load_head
    >>> head = load_head()
    >>> hairs = cropped_hair(head, 0.0)
    >>> roots = hairs.polylines(head.points, head.triangles, np.zeros_like(head.points))[:, 0]
    >>> bool(roots[:, 1].min() > head.landmarks["menton"][1])
    True
    """
    random, points, triangles = np.random.default_rng(SEED), head.points, head.triangles
    area = double_areas(points, triangles)
    triangle = np.sort(random.choice(len(triangles), HAIRS, p=area / area.sum()))
    weights = random.dirichlet(np.ones(3), HAIRS)
    corners = triangles[triangle]
    image = head.paint[1].cover()
    u, v = np.einsum("kc,kci->ik", weights, head.uv[corners])
    columns, rows = (np.minimum((share * len(image)).astype(int), len(image) - 1) for share in (u, 1.0 - v))
    grown = random.uniform(FEWEST, 1.0, HAIRS) < image[rows, columns]
    if not grown.any():
        return None
    triangle, weights, corners = triangle[grown], weights[grown], corners[grown]
    count, along = len(triangle), np.linspace(0.0, 1.0, KNOTS)
    normals = vertex_normals(points, triangles)
    root, up = (np.einsum("kc,kci->ki", weights, values[corners]) for values in (points, normals))
    way = unit(np.cross(np.cross(up, root - WHORL), up))
    turn = random.normal(0.0, ASTRAY, (count, 1))
    way = np.cos(turn) * way + np.sin(turn) * np.cross(up, way)
    dense = smoothstep(np.einsum("kc,kc->k", weights, head.paint[0].cover()[corners]))
    longest = SHORTEST + (LONGEST + FEMININE * max(-sex, 0.0) - SHORTEST) * (1.0 + length)
    reach = longest * (THIN + (1.0 - THIN) * dense[:, None]) * random.uniform(0.6, 1.1, (count, 1))
    slope = random.uniform(*SLOPE, (count, 1))
    flat = np.sqrt(1.0 - slope**2) * reach * along
    heights = slope * reach * (along - BENT * along**2) - (reach * along) ** 2 / (2.0 * ROUND)
    # Hairs go straight ahead in the plane of the triangle in which they are rooted, also past its sides.
    edges = points[corners[:, 1:]] - points[corners[:, :1]]
    steps = np.einsum("kei,ki->ke", np.linalg.pinv(edges.swapaxes(1, 2)), way)
    moved = np.concatenate([-steps.sum(axis=1, keepdims=True), steps], axis=1)
    places = weights[:, None] + flat[..., None] * moved[:, None]
    color = np.asarray(head.paint[0].hair, np.float64)
    return BoundHairs(np.repeat(triangle[:, None], KNOTS, axis=1), places, heights, color)
