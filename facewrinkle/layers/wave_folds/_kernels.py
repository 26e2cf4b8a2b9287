"""Inner loop of the wave folds: heights of a moment from the compression along each family's waves."""

from __future__ import annotations

import numpy as np

from ...geometry import compiled, fall, fall_integral
from ..entries import BLUNT, LEAST, TAUT

fallen, fallen_integral = compiled(inline="always")(fall), compiled(inline="always")(fall_integral)
"""The cross-section H in machine code."""

BLUNT_ALPHA, SHARP_ALPHA, SHARP_DEPTH = 0.9, 2.4, 0.15
"""Shape exponents of the faintest and of deep folds, and the depth, in wavelengths, from which folds are sharp."""

FINE = 0.11
"""Half width of the lines of old skin, in wavelengths (a standard deviation)."""

TOLERANCE = 0.08
"""Distance of triangles from the waves that is allowed, mm, with four vertices from crest to furrow."""

NARROWEST = 0.6
"""Least spacing asked for, in wavelengths."""


@compiled(inline="always")
def compressions(strain, i, tangents, p):
    """The compression across the lines of entry p at vertex i, ``1 - |F m|``, and how far it is beyond the onset,
    smoothly from 0.

    Half of the stretch along the lines, which thins skin across them by itself, and the shear along them are taken from
    it: skin that is compressed askew to a line folds less there.
    """
    onset, soft = 0.025, 0.02  # compression at which skin begins to fold, and half the width of the beginning around it
    xx, yy, zz, yz, xz, xy = strain[i, 0], strain[i, 1], strain[i, 2], strain[i, 3], strain[i, 4], strain[i, 5]
    x, y, z = tangents[p, 0], tangents[p, 1], tangents[p, 2]
    sx, sy, sz = xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z
    epsilon = 1.0 - np.sqrt(max(1.0 + x * sx + y * sy + z * sz, 0.0))
    if epsilon <= onset - soft:
        return epsilon, 0.0
    x, y, z = tangents[p, 3], tangents[p, 4], tangents[p, 5]
    shear = x * sx + y * sy + z * sz
    change = xx * x * x + yy * y * y + zz * z * z + 2.0 * (yz * y * z + xz * x * z + xy * x * y)
    pull = min(1.0 - np.sqrt(max(1.0 + change, 0.0)), 0.0)
    e = epsilon + 0.5 * pull - 0.5 * abs(shear) - onset
    if e > soft:
        return epsilon, e
    return epsilon, max(e + soft, 0.0) ** 2 / (4.0 * soft)


@compiled
def share_of(p, first, last, excess, wave):
    """The compression that is left to family p when it competes with those that cross it: families take 0.3 of each
    other's if their lines cross at right angles, and all if they are parallel.
    """
    e = excess[p]
    for q in range(first, last):
        if q != p and excess[q] > 0.0:
            ours = wave[p, 0] ** 2 + wave[p, 1] ** 2 + wave[p, 2] ** 2
            theirs = wave[q, 0] ** 2 + wave[q, 1] ** 2 + wave[q, 2] ** 2
            both = wave[p, 0] * wave[q, 0] + wave[p, 1] * wave[q, 1] + wave[p, 2] * wave[q, 2]
            taken = 0.3 + 0.7 * both * both / (ours * theirs)
            e -= taken * excess[q] * excess[q] / (excess[p] + excess[q])
    return max(e, 0.0)


@compiled
def spacing_for(length, depth):
    """Spacing that waves of a depth ask for: edges h of a quarter of it are off by h^2 (2 pi / length)^2 depth / 16."""
    return max(2.0 / np.pi * length * np.sqrt(16.0 * TOLERANCE / depth), NARROWEST * length)


@compiled
def heights(waves, strain, depth, now, relief, leading):
    """Heights at n vertices with a strain (n, 6), the same with blunt furrows (`shown`), and the spacing needed.

    From bulge to furrow a fold is ``D = S min(0.75 P (2 L / pi) sqrt(e), 0.22 L)`` deep, with P for `depth`: three
    quarters of the deepest that skin of fixed length allows, as the rest shortens or thickens, up to a depth from which
    on walls touch. All folds of a vertex together are no longer than the skin that the compression frees. `leading`
    (n,) gets the deepest entry of each, and `now` the compression of the entries, what is beyond the onset, what is
    left of that to each, depths, shape exponents and heights.
    """
    starts, _, theta, strength, window, length, old, wave, tangents = waves
    epsilon, excess, left, deep, shape, high = now
    height, shown, spacing, across, active, share = relief
    for i in range(len(starts) - 1):
        first, last = np.uint32(starts[i]), np.uint32(starts[i + 1])
        for p in range(first, last):
            epsilon[p], beyond = compressions(strain, i, tangents, p)
            excess[p] = window[p] * beyond
        asked, furrowed, deepest = 0.0, 0.0, first
        for p in range(first, last):
            furrowed += old[p]
            left[p], deep[p], shape[p], high[p] = 0.0, 0.0, BLUNT_ALPHA, 0.0
            if excess[p] == 0.0:
                continue
            left[p] = e = share_of(p, first, last, excess, wave)
            deep[p] = strength[p] * min(depth * 0.75 * 2.0 / np.pi * length[p] * np.sqrt(e), 0.22 * length[p])
            # The arc of the sharpest profile is 1.4 times as long, beyond its chord, as that of a sine.
            if deep[p] > 0.0:
                asked += 1.4 * (0.5 * np.pi * deep[p] / length[p]) ** 2 / epsilon[p]
            if deep[p] > deep[deepest]:
                deepest = p
        leading[i] = deepest
        share[i] = allowed = 1.0 / np.sqrt(max(asked, 1.0))
        total, mild, finest, lead = 0.0, 0.0, np.inf, -1
        for p in range(first, last):
            big, rest = allowed * deep[p], 0.0
            if old[p] > 0.0:
                rest = old[p] * (old[p] / furrowed) * max(0.0, 1.0 + min(epsilon[p], 0.0) / TAUT)
            if big + rest <= 0.0:
                continue
            shape[p], high[p], blunt = fold(theta[p] / np.pi, big, (big + rest) / length[p])
            cut = line(theta[p] / np.pi, rest)
            total += high[p] - cut
            mild += blunt - cut
            curved = big + 2.0 * rest / (2.0 * np.pi * FINE) ** 2  # as a wave with the curvature at the bottom
            wide = spacing_for(length[p], curved) if curved >= LEAST else np.inf
            if wide < finest:
                finest, lead = wide, np.int64(p)
        height[i], shown[i], spacing[i], active[i] = total, mild, finest, lead >= 0
        if lead >= 0:
            norm = np.sqrt(wave[lead, 0] ** 2 + wave[lead, 1] ** 2 + wave[lead, 2] ** 2)
            for c in range(3):
                across[i, c] = wave[lead, c] / norm


@compiled(inline="always")
def fold(s, deep, slope):
    """Shape exponent, height and blunt height, at the place s in its cycle, of a fold that is so deep; by depth over
    wavelength it is sharp, or not.
    """
    if deep <= 0.0:
        return BLUNT_ALPHA, 0.0, 0.0
    alpha = BLUNT_ALPHA + (SHARP_ALPHA - BLUNT_ALPHA) * min(slope / SHARP_DEPTH, 1.0)
    bulge, scale = 0.5 * fallen_integral(2.0, alpha), deep / 2.0**alpha
    mean = (fallen_integral(s + BLUNT, alpha) - fallen_integral(s - BLUNT, alpha)) / (2.0 * BLUNT)
    return alpha, scale * (bulge - fallen(s, alpha)), scale * (bulge - mean)


@compiled(inline="always")
def line(s, deep):
    """How deep a line of old skin lies at the place s in the cycle, below the mean of the skin around it."""
    if deep <= 0.0:
        return 0.0
    w = 0.5 * (1.0 - abs(s)) / FINE
    return deep * (np.exp(-0.5 * w * w) - FINE * np.sqrt(2.0 * np.pi))


@compiled
def waves_at(where, points, ground, stripes, out):
    """Phase, strength and wave vector (p,) of the sum of the plane waves at the corners of the split triangle that each
    of some points lies in, by its barycentric coordinates there.

    `points` are hosts, corners and barycentric coordinates of all points, `where` (p,) numbers of those that are asked
    for; `ground` the base triangles, their row and the level; `stripes` triangles, places, waves, phases and strengths.
    """
    hosts, corners, barycentric = points
    base, row, level = ground
    triangles, places, waves, phases, shares = stripes
    theta, strength, wave = out
    weights = np.empty(3)
    for p in range(len(where)):
        i = where[p]
        weights[:] = 0.0
        for c in range(3):
            for g in range(3):
                if base[hosts[i], c] == corners[i, g]:
                    weights[c] += barycentric[i, g]
        t = row[hosts[i]]
        u, v, w = weights[0], weights[1], weights[2]
        for _ in range(level):  # its corner parts, by their corner first, then the middle one
            u, v, w, part = 2.0 * u, 2.0 * v, 2.0 * w, 3
            if u >= 1.0:
                u, part = u - 1.0, 0
            elif v >= 1.0:
                u, v, w, part = v - 1.0, w, u, 1
            elif w >= 1.0:
                u, v, w, part = w - 1.0, u, v, 2
            else:
                u, v, w = 1.0 - w, 1.0 - u, 1.0 - v
            t = 4 * t + part
        weights[0], weights[1], weights[2] = u, v, w
        lead = triangles[t, np.argmax(weights)]  # its direction is that which the others are counted along
        re, im, kx, ky, kz = 0.0, 0.0, 0.0, 0.0, 0.0
        for c in range(3):
            j = triangles[t, c]
            angle, same = phases[j], 0.0
            for g in range(3):
                place = u * places[triangles[t, 0], g] + v * places[triangles[t, 1], g] + w * places[triangles[t, 2], g]
                angle += waves[j, g] * (place - places[j, g])
                same += waves[j, g] * waves[lead, g]
            signed = weights[c] if same >= 0.0 else -weights[c]
            re += weights[c] * shares[j] * np.cos(angle)
            im += signed * shares[j] * np.sin(angle)
            kx += signed * waves[j, 0]
            ky += signed * waves[j, 1]
            kz += signed * waves[j, 2]
        theta[p], strength[p] = np.arctan2(im, re), np.hypot(re, im)
        wave[p, 0], wave[p, 1], wave[p, 2] = kx, ky, kz
