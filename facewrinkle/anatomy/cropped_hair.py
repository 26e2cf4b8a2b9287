"""Cropped hair and beard of the built-in head: hairs that grow away from a place, the shorter, the thinner they stand.

Lengths are in mm.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..array_types import Array, IntArray
from ..geometry import double_areas, smoothstep, unit, vertex_normals
from .head import BoundHairs, Head
from .identity import hair_cover
from .landmarks import FaceFrame, frame_of
from .long_hair import towards_tie

SEED = 3
"""All people have the same hairs, in their own colors."""

HAIRS, KNOTS = 80000, 3
"""Hairs on all of the skin, of which those grow that are on the scalp, and points along each."""


def cropped_hair(
    head: Head, length: float, sex: float = 0.0, combed: float = 0.0, border: float = np.inf
) -> BoundHairs | None:
    """Return cropped hair on the skin of a head; None for a shaved one.

    Parameters
    ----------
    head : Head
    length : float
        From the shortest (-1) to the longest (0).
    sex : float
        From feminine or childlike (-1), with longer hair, to masculine.
    combed : float
        From hair that is longer on top and combed aside (-1), past hair that grows as it does, to hair combed back.
    border : float
        Width of the border of the scalp, along which alone it grows, before hair that is tied: it is combed to the tie.

    Examples
    --------
    >>> from facewrinkle.anatomy.head import load_head
    >>> head = load_head()
    >>> hairs = cropped_hair(head, 0.0)
    >>> roots = hairs.polylines(head.points, head.triangles, np.zeros_like(head.points))[:, 0]
    >>> bool(roots[:, 1].min() > head.landmarks["menton"][1])
    True
    """
    random, points, triangles, tied = np.random.default_rng(SEED), head.points, head.triangles, border < np.inf
    area = double_areas(points, triangles)
    triangle = np.sort(random.choice(len(triangles), HAIRS, p=area / area.sum()))
    weights = random.dirichlet(np.ones(3), HAIRS)
    corners = triangles[triangle]
    cover = np.einsum("kc,kc->k", weights, head.paint[0].cover()[corners])
    roots, up = (np.einsum("kc,kci->ki", weights, of[corners]) for of in (points, vertex_normals(points, triangles)))
    image = head.paint[1].cover()
    u, v = np.einsum("kc,kci->ik", weights, head.uv[corners])
    columns, rows = (np.minimum((share * len(image)).astype(int), len(image) - 1) for share in (u, 1.0 - v))
    grown = random.uniform(0.12, 1.0, HAIRS) < image[rows, columns]  # the share of hair in the color of the skin
    if tied:
        grown &= hair_cover(roots, head.landmarks, frame_of(head.landmarks)) < border
    if not grown.any():
        return None
    triangle, weights, roots, up, cover = (part[grown] for part in (triangle, weights, roots, up, cover))
    styled = 1.0 if tied else 1.0 - (1.0 - abs(combed)) ** 2
    top = smoothstep((up[:, 1] - 0.25) / 0.5)  # by the upward parts of the normals
    # Where it is dense; women and children may have 22 mm beyond, and combed hair 42 mm on top of the head, where it
    # would stand out of hair that is tied.
    least, most = 7.0, 16.0 + 22.0 * max(-sex, 0.0) + 42.0 * styled * top * (not tied)
    longest = least + (most - least) * (1.0 + length)
    if tied:
        comb = towards_tie(combed)
    else:
        # Hair is combed back, or to both sides of a parting 22 mm to the left of the middle, 16 mm wide.
        way = np.array([0.0, 0.3, -1.0])
        if combed < 0.0:
            way = top[:, None] * np.tanh((roots[:, :1] - 22.0) / 8.0) * [1.0, 0.0, 0.25]
        comb = unit(roots - [8.0, 115.0, -62.0])  # hair grows away from its whorl, at the back of the crown
        comb += 3.0 * styled * way  # a comb is three times as strong
    longest *= 0.2 + 0.8 * smoothstep(cover)  # a fifth of the length where hardly any grow
    return grown_hairs(head, triangle, weights, comb, longest, random, 1.0 - 0.4 * styled, down=not tied)


def grown_hairs(
    head: Head,
    triangle: IntArray,
    weights: Array,
    comb: Array,
    longest: Array,
    random: np.random.Generator,
    loose: float = 1.0,
    down: bool = True,
) -> BoundHairs:
    """Return hairs in the color of a head's that are rooted in triangles (k,) with weights (k, 3).

    They grow along the skin as it lets them of the ways `comb` (k, 3) or (3,), of random lengths around `longest` (k,),
    and the more slope and stray, the more `loose` they are; those of the sides also grow `down`.
    """
    points, triangles = head.points, head.triangles
    corners = triangles[triangle]
    count, along = len(triangle), np.linspace(0.0, 1.0, KNOTS)
    normals = vertex_normals(points, triangles)
    up = np.einsum("kc,kci->ki", weights, normals[corners])
    way = unit(np.cross(np.cross(up, comb), up))
    way[:, 1] -= down * np.abs(up[:, 0])
    way = unit(np.cross(np.cross(up, way), up))
    turn = random.normal(0.0, 0.35 * loose, (count, 1))  # radians: single hairs go astray
    way = np.cos(turn) * way + np.sin(turn) * np.cross(up, way)
    reach = longest[:, None] * random.uniform(0.6, 1.1, (count, 1))
    slope = loose * random.uniform(0.2, 0.6, (count, 1))  # out of the skin
    flat = np.sqrt(1.0 - slope**2) * reach * along
    # They lose all of the slope up to their tips, and bend around a scalp of a radius of 90 mm.
    heights = slope * reach * (along - 0.5 * along**2) - (reach * along) ** 2 / (2.0 * 90.0)
    # Hairs go straight ahead in the plane of the triangle in which they are rooted, also past its sides.
    edges = points[corners[:, 1:]] - points[corners[:, :1]]
    steps = np.einsum("kei,ki->ke", np.linalg.pinv(edges.swapaxes(1, 2)), way)
    moved = np.concatenate([-steps.sum(axis=1, keepdims=True), steps], axis=1)
    places = weights[:, None] + flat[..., None] * moved[:, None]
    color = np.asarray(head.paint[0].hair, np.float64)
    return BoundHairs(np.repeat(triangle[:, None], KNOTS, axis=1), places, heights, color)


def beard(where: Array, landmarks: Mapping[str, Array], frame: FaceFrame) -> Array:
    """Return the density (0 to 1) of a beard at local points: on jaw, chin and upper lip, fading out around them."""
    mouth, nose, jaw, chin, ear = (
        frame.local_mm(landmarks[name]) for name in ("mouth_l", "subnasale", "gonion_l", "menton", "zygion_l")
    )
    x, y, z = np.abs(where[:, 0]), where[:, 1], where[:, 2]
    # From the nose past the corner of the mouth to the hair before the ear, and under the jaw.
    ends = [0.0, 14.0, mouth[0] + 8.0, jaw[0], 90.0]
    top = np.interp(x, ends, [nose[1] + 1.0, nose[1], mouth[1] + 12.0, ear[1], ear[1] + 40.0])
    top += 2.5 * np.sin(0.19 * z + 0.7) + 1.5 * np.sin(0.43 * z)  # nobody's edge is straight
    fade = np.interp(x, ends[:3], [7.0, 7.0, 20.0])
    bottom = np.interp(z, [jaw[2], chin[2]], [jaw[1] - 14.0, chin[1] - 12.0])
    return np.asarray(
        smoothstep((top - y) / fade) * smoothstep((y - bottom) / 12.0) * smoothstep((z - jaw[2] + 20.0) / 20.0)
    )


def beard_hairs(head: Head, fullness: float) -> BoundHairs:
    """Return the hairs of a beard on the skin of a head.

    Parameters
    ----------
    head : Head
    fullness : float
        From stubble (0) to a full beard (1).

    Examples
    --------
    >>> from facewrinkle.anatomy.head import load_head
    >>> hairs = beard_hairs(load_head(), 0.5)
    >>> hairs.triangles.shape == (len(hairs.triangles), hairs.heights.shape[1])
    True
    """
    random, frame = np.random.default_rng(SEED), frame_of(head.landmarks)
    corner, upper, lower = (frame.local_mm(head.landmarks[n]) for n in ("mouth_l", "upper_lip_mid", "lower_lip_mid"))
    corners = frame.local_mm(head.points)[head.triangles]
    rise = np.array([0.0, 3.0, 0.0])  # hairs fade out 3 mm above the shade of a shaved beard
    share = beard(corners.reshape(-1, 3) - rise, head.landmarks, frame).reshape(-1, 3).max(axis=1)
    share *= double_areas(head.points, head.triangles)
    count = 33000  # of which those grow that stand where a beard is dense
    triangle = random.choice(len(share), count, p=share / share.sum())
    weights = random.dirichlet(np.ones(3), count)
    where = np.einsum("kc,kci->ki", weights, corners[triangle])
    mouth = 0.5 * np.array([2.0 * corner[0], upper[1] - lower[1]]) + [1.0, 0.0]  # none grow 1 mm beside the lips
    off_lips = np.linalg.norm((where[:, :2] - [0.0, 0.5 * (upper[1] + lower[1])]) / mouth, 3, axis=1) - 1.0
    # Nobody's grows evenly: it varies from vertex to vertex, and thins out over the border.
    uneven = random.uniform(-1.0, 1.0, (len(head.points), 4))
    thin, *whirl = np.einsum("kc,kci->ik", weights, uneven[head.triangles[triangle]])
    dense = beard(where - rise, head.landmarks, frame) * smoothstep(10.0 * off_lips)
    thinnest = 0.7  # share of hairs that the barest places within a beard have
    dense *= thinnest + (1.0 - thinnest) * smoothstep(0.6 + thin)
    grown = random.uniform(0.0, 1.0, count) < dense
    stubble, full = 0.5, 11.0  # mean lengths, mm, where a beard is dense
    longest = stubble + fullness**2 * (full - stubble) * dense[grown]
    comb = unit(where[grown] - frame.local_mm(head.landmarks["sellion"])) + 0.4 * np.transpose(whirl)[grown]
    # They stand off the skin and go astray more than hair of the head: some break the outline of the jaw.
    return grown_hairs(head, triangle[grown], weights[grown], comb, longest, random, loose=1.4)
