"""Inner loops of the wave packets: places, neighbours, aligned phases, and the waves at a point."""

from __future__ import annotations

import numpy as np

from ...geometry.compilation import njit

FACING = 0.3
"""Packets act on each other, and on points, only where the cosine of their normals is larger than this."""

FINEST = 64
"""Places of packets are whole multiples of this share of a triangle's sides: 1 / 64."""


@njit(cache=True)
def lattice(points, triangles, chosen, reach, count_only, host, weights, code):
    """Place a lattice on each of the chosen triangles, no coarser than `reach` (n,) there; return the number of places.

    A side has 1, 2, 4, ... intervals, so that a finer lattice holds the places of a coarser one: on another face with
    the same triangles most places stay. `code` (p,) numbers the place in its triangle whatever the lattice, after the
    level at which it appears.
    """
    total = 0
    for f in chosen:
        longest, needed = 0.0, np.inf
        for s in range(3):
            a, b = triangles[f, s], triangles[f, (s + 1) % 3]
            square = 0.0
            for c in range(3):
                square += (points[a, c] - points[b, c]) ** 2
            longest = max(longest, np.sqrt(square))
            needed = min(needed, reach[a])
        m = 1
        while m < FINEST and longest > m * needed:
            m *= 2
        for i in range(m + 1):
            for j in range(m + 1 - i):
                if not count_only:
                    step = FINEST // m
                    u, v = i * step, j * step
                    level, size = 0, FINEST
                    while u % size or v % size:
                        size //= 2
                        level += 1
                    host[total] = f
                    weights[total, 0], weights[total, 1] = i / m, j / m
                    weights[total, 2] = (m - i - j) / m
                    code[total] = (level * (FINEST + 1) + u) * (FINEST + 1) + v
                total += 1
    return total


@njit(cache=True)
def cell_of(x, y, z, low, cell, dims):
    """Number of the cell of a grid that holds a point; points outside belong to the cells of the border."""
    i = min(max(int(np.floor((x - low[0]) / cell)), 0), dims[0] - 1)
    j = min(max(int(np.floor((y - low[1]) / cell)), 0), dims[1] - 1)
    k = min(max(int(np.floor((z - low[2]) / cell)), 0), dims[2] - 1)
    return i, j, k


@njit(cache=True)
def thinned(where, radius, order, low, cell, dims):
    """Mark the points (p,) of a greedy choice in a given order: none within `radius` (p,) of one taken before.

    Cells of the grid list those that were taken, however many points there are.
    """
    taken = np.zeros(len(where), np.bool_)
    last, before = np.full(dims[0] * dims[1] * dims[2], -1), np.full(len(where), -1)
    for q in order:
        i, j, k = cell_of(where[q, 0], where[q, 1], where[q, 2], low, cell, dims)
        free = True
        for a in range(max(i - 1, 0), min(i + 2, dims[0])):
            for b in range(max(j - 1, 0), min(j + 2, dims[1])):
                for c in range(max(k - 1, 0), min(k + 2, dims[2])):
                    o = last[(a * dims[1] + b) * dims[2] + c]
                    while free and o >= 0:
                        square = 0.0
                        for d in range(3):
                            square += (where[q, d] - where[o, d]) ** 2
                        free = square >= radius[q] * radius[q]
                        o = before[o]
        if free:
            taken[q] = True
            n = (i * dims[1] + j) * dims[2] + k
            before[q] = last[n]
            last[n] = q
    return taken


@njit(cache=True)
def neighbours(x, n, reach, own, low, cell, dims, start, items, points, normals, count_only, first, second):
    """Pairs of packets (j, i) within the reach (m,) of j whose normals agree, as rows of CSR; return their number.

    The grid holds the packets i at `points` with `normals`: the packets themselves (`own`) or their mirror images.
    """
    total = 0
    for j in range(len(x)):
        ci, cj, ck = cell_of(x[j, 0], x[j, 1], x[j, 2], low, cell, dims)
        for a in range(max(ci - 1, 0), min(ci + 2, dims[0])):
            for b in range(max(cj - 1, 0), min(cj + 2, dims[1])):
                for c in range(max(ck - 1, 0), min(ck + 2, dims[2])):
                    cube = (a * dims[1] + b) * dims[2] + c
                    for s in range(start[cube], start[cube + 1]):
                        i = items[s]
                        if own and i == j:
                            continue
                        square, facing = 0.0, 0.0
                        for d in range(3):
                            square += (x[j, d] - points[i, d]) ** 2
                            facing += n[j, d] * normals[i, d]
                        if square < reach[j] * reach[j] and facing > FACING:
                            if not count_only:
                                second[total] = i
                            total += 1
        if not count_only:
            first[j + 1] = total
    return total


@njit(cache=True)
def turns(x, d, k, sigma, first, second, points, directions, weight, turn, flip):
    """Weights of pairs by their distance across and along the lines of j, and the phase from i to j.

    The wave is conjugated where the directions of the two point away from each other (`flip` is -1).
    """
    for j in range(len(x)):
        for q in range(first[j], first[j + 1]):
            i = second[q]
            square, ours, theirs, same = 0.0, 0.0, 0.0, 0.0
            for c in range(3):
                e = x[j, c] - points[i, c]
                square += e * e
                ours += e * d[j, c]
                theirs += e * directions[i, c]
                same += d[j, c] * directions[i, c]
            s = 1.0 if same >= 0.0 else -1.0
            flip[q] = s
            turn[q] = 0.5 * (k[i] * theirs + s * k[j] * ours)
            across, along = sigma[j, 0], sigma[j, 1]
            weight[q] = np.exp(-0.5 * (ours * ours / across**2 + max(square - ours * ours, 0.0) / along**2))


@njit(cache=True)
def align(phase, first, second, weight, turn, flip, sweeps):
    """Gauss-Seidel sweeps, to and fro, that lower ``sum w |psi_j - psi_i exp(i omega_ij)|^2`` over unit psi."""
    m = len(phase)
    re, im, c, s = np.empty(m), np.empty(m), np.empty(len(turn)), np.empty(len(turn))
    for j in range(m):  # loops compile faster than expressions of arrays
        re[j], im[j] = np.cos(phase[j]), np.sin(phase[j])
    for q in range(len(turn)):
        c[q], s[q] = weight[q] * np.cos(turn[q]), weight[q] * np.sin(turn[q])
    for sweep in range(sweeps):
        for t in range(m):
            j = t if sweep % 2 == 0 else m - 1 - t
            a, b = 0.0, 0.0
            for q in range(first[j], first[j + 1]):
                i = second[q]
                a += re[i] * c[q] - im[i] * s[q]
                b += flip[q] * (re[i] * s[q] + im[i] * c[q])
            size = np.hypot(a, b)
            if size > 0.0:
                re[j], im[j] = a / size, b / size
    for j in range(m):
        phase[j] = np.arctan2(im[j], re[j])


@njit(cache=True)
def waves_at(places, normals, x, n, d, k, share, sigma, phase, low, cell, dims, start, items, theta, strength, wave):
    """Phase, strength and wave vector of the sum of all packets within a cell's width of each place; 0 without any."""
    around, squares = np.empty(len(x), np.int64), np.empty(len(x))
    for p in range(len(places)):
        theta[p], strength[p] = 0.0, 0.0
        wave[p, 0], wave[p, 1], wave[p, 2] = 0.0, 0.0, 0.0
        ci, cj, ck = cell_of(places[p, 0], places[p, 1], places[p, 2], low, cell, dims)
        nearest, lead, count = cell * cell, -1, 0
        for a in range(max(ci - 1, 0), min(ci + 2, dims[0])):
            for b in range(max(cj - 1, 0), min(cj + 2, dims[1])):
                for c in range(max(ck - 1, 0), min(ck + 2, dims[2])):
                    cube = (a * dims[1] + b) * dims[2] + c
                    for s in range(start[cube], start[cube + 1]):
                        j = items[s]
                        square, facing = 0.0, 0.0
                        for g in range(3):
                            square += (places[p, g] - x[j, g]) ** 2
                        if square >= cell * cell:
                            continue
                        for g in range(3):
                            facing += n[j, g] * normals[p, g]
                        if facing <= FACING:
                            continue
                        around[count], squares[count] = j, square
                        count += 1
                        if square < nearest:  # its direction is that which the others are counted along
                            nearest, lead = square, j
        re, im, total, kx, ky, kz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for q in range(count):
            j, square = around[q], squares[q]
            ours, same = 0.0, 0.0
            for g in range(3):
                ours += (places[p, g] - x[j, g]) * d[j, g]
                same += d[j, g] * d[lead, g]
            across, along = sigma[j, 0], sigma[j, 1]
            w = np.exp(-0.5 * (ours * ours / across**2 + max(square - ours * ours, 0.0) / along**2))
            w *= (1.0 - square / (cell * cell)) ** 2
            sign = 1.0 if same >= 0.0 else -1.0
            angle = phase[j] + k[j] * ours
            re += w * share[j] * np.cos(angle)
            im += w * share[j] * sign * np.sin(angle)
            total += w
            kx += w * sign * k[j] * d[j, 0]
            ky += w * sign * k[j] * d[j, 1]
            kz += w * sign * k[j] * d[j, 2]
        if total > 1e-9:
            theta[p] = np.arctan2(im, re)
            strength[p] = np.hypot(re, im) / total
            wave[p, 0], wave[p, 1], wave[p, 2] = kx / total, ky / total, kz / total


@njit(cache=True)
def directed(wave, normals, corners, barycentric, metric, tangents):
    """Tangents (p, 6) across each wave, and along it, of unit length in the rest metric (n0, 6)."""
    first, second, g = np.empty(3), np.empty(3), np.empty(6)
    for p in range(len(wave)):
        n = normals[p]
        up = wave[p, 0] * n[0] + wave[p, 1] * n[1] + wave[p, 2] * n[2]
        for c in range(3):
            first[c] = wave[p, c] - up * n[c]
        size = max(np.sqrt(first[0] ** 2 + first[1] ** 2 + first[2] ** 2), 1e-12)
        for c in range(3):
            first[c] /= size
        second[0] = n[1] * first[2] - n[2] * first[1]
        second[1] = n[2] * first[0] - n[0] * first[2]
        second[2] = n[0] * first[1] - n[1] * first[0]
        for k in range(6):
            g[k] = 0.0
            for c in range(3):
                g[k] += barycentric[p, c] * metric[corners[p, c], k]
        for k, v in enumerate((first, second)):
            square = g[0] * v[0] ** 2 + g[1] * v[1] ** 2 + g[2] * v[2] ** 2
            square += 2.0 * (g[3] * v[1] * v[2] + g[4] * v[0] * v[2] + g[5] * v[0] * v[1])
            size = np.sqrt(max(square, 1e-6))
            for c in range(3):
                tangents[p, 3 * k + c] = v[c] / size
