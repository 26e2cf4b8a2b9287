"""Long hair of the built-in head: a sheet that falls from a parting or is combed to a knot or tail, with locks over it.

Lengths are in mm. Hair is opaque, and a hair of the sheet is a row of its points: any program shows it as pictures do.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from ..array_types import Array, IntArray
from ..geometry import BoxTree, ring_quads, smoothstep, unit, vertex_normals
from ..mesh import COLORS, to_polydata
from .head import Head
from .identity import hair_cover
from .landmarks import frame_of
from .parts import ALONG, Part

STRAND_AT = "strand_at"
"""Array of its mesh: the number of the strand at each point, counted across locks, and how far along its length."""

SEED = 5
"""All people have the same locks; how these are cut, fall and curl is their own."""

COLUMNS, LOCKS, STRANDS, BABY_HAIRS = 200, 90, 60, 60
"""Hairs that the sheet is made of, in order around the head, locks over it, loose hairs over these, and short ones that
grow along the hairline before a parting.
"""

TRESS = 8
"""Hairs of the sheet that part from the others and thin to a tip where it falls."""

KNOTS, LOCK_HAIRS = 23, 3
"""Points along each of them, and hairs side by side in a lock."""

ROOTS_DENSER = 1.4
"""Exponent that gathers the points of the sheet near the parting, where it bends."""

STEP, STEPS = 8.0, 42
"""Length and number of the pieces in which hair grows."""

COMBED = 65.0
"""Length over which hair keeps to the way it was combed."""

ROUNDING, LEAST = 1.5, 4.5
"""Edges of the hull under the hair are rounded over the first length, which lets up to some 4 mm of them stand out of
it; no hair is lower than the second.
"""

HEM = -36.0
"""Height of the hem over the chin at length 1."""

BORDER = 28.0
"""Width of the border of the scalp on which single hairs grow before hair that is tied back."""


class RoundedHull:
    """A convex hull of points, of 240 planes, with rounded edges: what hair slides down on.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    rounding : float
        Length over which edges are rounded.

    Examples
    --------
    Above a ball:

    >>> import pyvista as pv
    >>> ball = RoundedHull(np.asarray(pv.Sphere(radius=80.0).points))
    >>> height, normals = ball(np.array([[0.0, 120.0, 0.0]]))
    >>> bool(abs(height[0] - 40.0) < 5.0), normals.round(1) + 0.0
    (True, array([[0., 1., 0.]]))
    """

    def __init__(self, points: Array, rounding: float = ROUNDING) -> None:
        self.rounding, count = rounding, 240
        share = 1.0 - (2.0 * np.arange(count) + 1.0) / count
        turn, radius = np.pi * (1.0 + 5.0**0.5) * np.arange(count), np.sqrt(1.0 - share**2)
        self.directions = np.stack([radius * np.cos(turn), share, radius * np.sin(turn)], axis=1)
        self.supports = (points @ self.directions.T).max(axis=0)

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Return heights (...) of points (..., 3) above the hull, and its normals (..., 3) there."""
        beyond = (points @ self.directions.T - self.supports) / self.rounding
        most = beyond.max(axis=-1, keepdims=True)
        near = np.exp(beyond - most)
        return self.rounding * (most[..., 0] + np.log(near.sum(axis=-1))), unit(near @ self.directions)

    def above(self, least: float | Array, points: Array) -> Array:
        """Return points (..., 3), of which those that are lower over the hull than the least height are raised."""
        height, normals = self(points)
        return np.asarray(points + np.maximum(least - height, 0.0)[..., None] * normals)

    def reached(self, starts: Array, ways: Array) -> Array:
        """Return the points (..., 3) of the hull that are reached from inside along ways (..., 3)."""
        speed = ways @ self.directions.T
        far = np.where(speed > 0.1, self.supports - starts @ self.directions.T, np.inf) / np.maximum(speed, 0.1)
        return np.asarray(starts + far.min(axis=-1)[..., None] * ways)


def long_hair(head: Head, length: float, combed: float = 0.0) -> Part:
    """Return hair that falls from a parting or is tied back, the same for the same head, length and comb.

    The rounder the face, the farther aside the parting; the denser the hair, the fuller and the more wavy. A fringe is
    cut at the brows, and the hair behind it in steps down to the hem.

    Parameters
    ----------
    head : Head
    length : float
        From the mouth (0) to below the chin (1).
    combed : float
        From a fringe over the forehead (-1) to hair that falls behind the cheeks (0); above, it is tied back, the
        higher, the greater: in a knot up to a length of 0.4, else in a tail.

    Examples
    --------
    Does it reach below the chin?

    >>> from facewrinkle.anatomy.head import load_head
    >>> head = load_head()
    >>> [bool(long_hair(head, length).mesh.bounds[2] < head.landmarks["menton"][1]) for length in (0.2, 1.0)]
    [False, True]
    """
    random, marks, points = np.random.default_rng(SEED), head.landmarks, head.points
    if combed > 0.0:
        # It lies on the hull, with edges hardly rounded, of all that is less than 4 mm outside of the hairline, or than
        # 18 mm where it is 60 mm behind the zygion, clear of the ears.
        bare = np.where(points[:, 2] < marks["zygion_l"][2] - 60.0, 18.0, 4.0)
        hull = RoundedHull(points[hair_cover(points, marks, frame_of(marks)) > -bare], rounding=0.4)
        parts = _tied(random, head, hull, length, combed)
    else:
        # Hair slides over the face up to 45 mm forward of the zygion, and over all that is above the brows.
        behind = (points[:, 1] > marks["menton"][1]) & (points[:, 2] < marks["zygion_l"][2] + 45.0)
        hull = RoundedHull(points[behind | (points[:, 1] > marks["glabella"][1])])
        lines, ends = _fallen(random, head, hull, length, combed)
        # The shortest locks lack up to 0.3 of the length: short hair is cut straight, long hair in layers.
        parts = _bundle(random, hull, lines, ends, falls=True, layers=0.3 * length)
        parts.append(_baby_hairs(random, head, hull))
    places, tints, strands = (
        np.concatenate([part[k].swapaxes(1, 2).reshape(-1, *part[k].shape[3:]) for part in parts]) for k in range(3)
    )
    mesh = to_polydata(places, _triangles([points.shape[:2] for points, *_ in parts]))
    colors = np.asarray(head.paint[0].hair) * tints[:, None]
    mesh.point_data[STRAND_AT] = strands.astype(np.float32)
    ways = [unit(np.gradient(part[0], axis=2)).swapaxes(1, 2).reshape(-1, 3) for part in parts]
    mesh.point_data[ALONG] = np.concatenate(ways).astype(np.float32)
    # Normals lean to those of the hull: light varies hair by hair, not lock by lock, and no lock that twists is dark.
    mesh.point_data["Normals"] = unit(vertex_normals(places, mesh.regular_faces) + 1.5 * hull(places)[1])
    mesh.point_data[COLORS] = np.rint(np.clip(colors, 0.0, 255.0)).astype(np.uint8)
    return Part(mesh, follows="skull")


def towards_tie(high: float) -> Array:
    """Return the direction (3,) to the tie from the middle of the head; see `combed` of :func:`long_hair`."""
    rise = np.radians(80.0 * high - 20.0)
    return np.array([0.0, np.sin(rise), -np.cos(rise)])


def _tied(
    random: np.random.Generator, head: Head, hull: RoundedHull, length: float, high: float
) -> list[tuple[Array, Array, Array]]:
    """Return the :func:`_bundle` of hairs that are combed from the hairline to a tie, and of the knot or tail there."""
    marks, dense, aside = head.landmarks, 0.5 + 0.5 * head.paint[0].density, np.array([1.0, 0.0, 0.0])
    # Hair is combed along great circles about a point, which is here from the middle between the zygions.
    back = towards_tie(high)
    up = np.cross(back, aside)
    turn, angle = np.linspace(2.0 * np.pi, 0.0, COLUMNS)[:, None, None], np.linspace(0.1, 3.0, STEPS)[:, None]
    ways = np.cos(angle) * back + np.sin(angle) * (np.sin(turn) * aside - np.cos(turn) * up)
    middle, scalp, inside = _scalp(head, hull, ways)
    # The sheet begins 10 mm inside the hairline.
    first = _outermost(inside - 10.0) - random.uniform(0.0, 0.3, COLUMNS)
    along = np.linspace(1.0, 0.0, KNOTS)
    lines = _between(scalp, first[:, None] * along)
    # It comes out of the skin, and lies on the hull from 45 mm inside the hairline.
    off = smoothstep((_between(inside[..., None], first[:, None] * along)[..., 0] - 10.0) / 35.0)
    lift = 1.5 + (0.5 + 3.0 * dense) * off * (1.0 + 0.1 * _even(random, (COLUMNS,), 2.0)[:, None])
    lines += (lift - (1.0 - off) * _gap(head, lines))[..., None] * unit(lines - middle)
    combed = _bundle(random, hull, lines, np.full(COLUMNS, KNOTS - 1.0))
    tie, thick = hull.reached(middle, back), 12.0 * (0.7 + 0.6 * dense)  # radius of a tail, and of what is wound
    grown = np.linspace(0.0, 1.0, STEPS + 1)[:, None]
    if length > 0.4:  # a tail, else a knot: a ring
        (core,), last = _grown(
            hull,
            tie[None],
            1.5 * back[None],
            np.array([COMBED]),
            np.array([thick]),
            marks["menton"][[1]] + HEM * length,
        )
    else:
        around, last = 2.0 * np.pi * grown, np.array([float(STEPS)])
        core = tie + 0.5 * thick * back + 16.0 * (np.cos(around) * up + np.sin(around) * aside)
    strands, wound = 72, 9.0  # around either, by this angle in radians
    turn = np.linspace(2.0 * np.pi, 0.0, strands)[:, None, None] + wound * grown
    lines = core + thick * (np.cos(turn) * back + np.sin(turn) * np.cross(unit(np.gradient(core, axis=0)), back))
    hanging = _bundle(random, RoundedHull(lines.reshape(-1, 3)), lines, np.repeat(last, strands))
    return combed + [(hull.above(0.8, points), tints, numbers) for points, tints, numbers in hanging]


def _gap(head: Head, lines: Array) -> Array:
    """Return how far points (..., 3) are from the skin."""
    return BoxTree(head.points, head.triangles).closest(lines.reshape(-1, 3))[2].reshape(lines.shape[:-1])


def _bundle(
    random: np.random.Generator,
    hull: RoundedHull,
    lines: Array,
    ends: Array,
    falls: bool = False,
    layers: float = 0.0,
) -> list[tuple[Array, Array, Array]]:
    """Return points (k, hairs, KNOTS, 3), tints (k, hairs, KNOTS) and strands (..., 2) of hairs side by side.

    They are those of a sheet of lines (n, s, 3), of locks over it, and of loose hairs over these. The shortest of the
    locks lack a share of their length by their `layers`. Hair that `falls` from a parting is looser than tied hair,
    dark at its roots and below, and begins more evenly: there most roots differ by less than 5 mm.
    """
    loose, darker, power = (4.0, 0.4, 0.85) if falls else (2.0, 0.0, 1.0)
    columns, t = len(lines), np.linspace(0.0, 1.0, KNOTS)
    count, strands = round(LOCKS * columns / COLUMNS), round(STRANDS * columns / COLUMNS)
    dark = 1.0 - darker * np.maximum(1.0 - 5.0 * t, 0.0)
    under = 27.0 * layers / STEP  # how much shorter than the longest locks the sheet is
    sheet = _between(lines, (ends - under)[:, None] * t**ROOTS_DENSER)
    across = np.linspace(-1.0, 1.0, LOCK_HAIRS)
    over = ((np.arange(count) + random.uniform(0.0, 1.0, count)) / count * columns).astype(int)
    wide = random.uniform(1.0, 4.5, count)  # half the width
    # The farthest locks stand off half as far as loose hairs.
    locks = _locks(random, hull, lines[over], ends[over], wide, LOCK_HAIRS, layers, 0.5 * loose)
    some = (columns * random.beta(0.25, 0.25, strands)).astype(int)  # most beside the face
    astray = _locks(random, hull, lines[some], ends[some], np.full(strands, 0.25), 2, layers, loose)
    shades = np.exp(0.05 * random.normal(size=(count, 1, 1))) * (1.0 - 0.08 * across**2)[:, None]
    of_locks = 100.0 * np.arange(count)[:, None] + wide[:, None] * across / 0.15  # mm: the width of a strand
    pieces = columns // TRESS if falls else 1
    return [
        (
            sheet.reshape(pieces, -1, KNOTS, 3),
            (1.0 - 0.4 * darker) * dark * _tints(random, pieces, columns // pieces),
            _strands(20.0 * np.arange(columns).reshape(pieces, -1), power),
        ),
        (locks, shades * dark * _tints(random, count, LOCK_HAIRS), _strands(of_locks)),
        (
            astray,
            dark * np.repeat(_tints(random, strands, 1), 2, axis=1),
            _strands(np.repeat(np.arange(strands)[:, None], 2, axis=1)),
        ),
    ]


def _fallen(
    random: np.random.Generator, head: Head, hull: RoundedHull, length: float, combed: float
) -> tuple[Array, Array]:
    """Return the lines (k, STEPS + 1, 3) of the hairs of the sheet, combed and waved, tress by tress, and how many of
    the steps (k,) it takes to reach the hem.
    """
    marks = head.landmarks
    dense = 0.5 + 0.5 * head.paint[0].density
    even = _even(random, (COLUMNS,), 12.0)
    # Borders of tresses lie one over the other, lest skin is seen between their roots; each hangs in its own way.
    tresses, wide = COLUMNS // TRESS, 1.5 * TRESS
    across = np.tile(np.linspace(-0.5, 0.5, TRESS), tresses)
    number = np.repeat(np.linspace(0.5 * wide, COLUMNS - 1.0 - 0.5 * wide, tresses), TRESS) + wide * across
    own = np.repeat(random.normal(size=(tresses, 2)), TRESS, axis=0)
    outer = np.minimum(number, number[::-1])  # numbers of hairs from both sides of the face
    # The outermost come from the hairline, up to the temples, unless hair is combed to a fringe; the others from the
    # parting, and from the 60th on, of its rear end. They are gathered near the front end.
    bare, first, whorl = (1.0 + combed) ** 3, 24.0, 60.0
    edge, along = np.maximum(bare - outer / first, 0.0), np.interp(outer, [bare * first, whorl], [0.0, 1.0]) ** 1.5
    aside = np.interp(number, [whorl, COLUMNS - 1.0 - whorl], [0.5 * np.pi, -0.5 * np.pi]) + 0.05 * even
    roots = _roots(head, hull, edge * np.sign(aside), along)
    comb = np.stack([np.sin(aside), np.zeros(COLUMNS), -np.cos(aside)], axis=1)
    # Hair that falls to the other side from 20 mm off the middle is combed upwards and twice as far back, and keeps to
    # that for half as long again. The foremost hair is combed further back than the rest, unless it forms a fringe,
    # and that of the temples down.
    parted = np.clip(number, np.ceil(bare * first), COLUMNS - 1 - np.ceil(bare * first)).astype(int)
    far, front = np.maximum(-roots[parted, 0] * np.sin(aside), 0.0) / 20.0, 1.0 - along
    comb[:, 1] += 0.16 * (1.0 + combed) * far * front
    comb[:, 2] -= ((0.75 + 0.35 * far) * bare + 0.4 * combed) * front
    comb += edge[:, None] * ([0.0, -1.0, -0.4] - comb)
    beyond = (3.5 + 0.7 * own[:, 0]) * (1.0 - edge) * np.sin(aside)
    brows, chin = marks["glabella"][1], marks["menton"][1] + HEM
    fringe = (1.0 - bare) * front**3
    # Share of the way down of the hem of the shortest: between that and cropped hair are cuts that a sheet cannot show.
    shortest = 0.42
    down = (1.0 - fringe) * (shortest + (1.0 - shortest) * length)
    uneven = 5.0 * (0.15 + 0.85 * length) * (even + own[:, 0])
    hem = brows + down * (chin - brows) + uneven + 40.0 * across**2
    lift = (4.0 + 10.0 * dense**2) * (1.0 + 0.15 * even)
    lines, ends = _grown(hull, roots, comb, COMBED * (1.0 + 0.5 * far), lift, hem)
    up = hull(lines)[1]
    apart = (3.0 + 6.0 * front) * own[:, 1]  # tresses part, the foremost most
    lines = _waved(random, hull, lines, STEP * ends, up, dense, apart)
    # It comes out of the skin, beyond the parting: roots of both sides lie among each other, lest skin is seen there.
    near = 1.0 - smoothstep(STEP * np.arange(STEPS + 1) / 40.0)
    lines[..., 0] -= near * beyond[:, None]
    lines -= (near * (_gap(head, lines) - 1.7))[..., None] * up
    return lines, ends


def _waved(
    random: np.random.Generator, hull: RoundedHull, lines: Array, lengths: Array, up: Array, dense: float, apart: Array
) -> Array:
    """Return the lines (k, STEPS + 1, 3) of hairs of given lengths (k,) in waves, the denser, the larger: tresses whose
    tips are narrow, turn in and are moved `apart` (k,). `up` (k, STEPS + 1, 3) are normals of the hull.
    """
    grown = STEP * np.arange(STEPS + 1)
    turning, turned_in = 0.55, 15.0  # share of its length from which hair turns in, and how far its tips do
    done = np.minimum(grown / lengths[:, None], 1.0)
    turn = np.maximum(done - turning, 0.0) / (1.0 - turning)
    aside = unit(np.cross(np.gradient(lines, axis=1), up))
    wave = 66.0  # of which the first two grow to the width of the others
    phase = 2.0 * np.pi * grown / wave + 2.5 * _even(random, (COLUMNS,), 25.0)[:, None]
    swing = 9.0 * dense**2 * np.minimum(0.5 * grown / wave, 1.0)
    lines = lines + (swing * np.sin(phase) + apart[:, None] * done**3)[..., None] * aside
    lines += (0.6 * swing * np.cos(phase) - turned_in * turn**2)[..., None] * up
    tresses = lines.reshape(-1, TRESS, *lines.shape[1:])
    middle = np.repeat(tresses.mean(axis=1), TRESS, axis=0)
    return hull.above(LEAST, lines + 0.4 * done[..., None] ** 2 * (middle - lines))


def _baby_hairs(random: np.random.Generator, head: Head, hull: RoundedHull) -> tuple[Array, Array, Array]:
    """Return points, tints and strands, as :func:`_bundle` does, of single short hairs along the hairline on both sides
    of a parting. They are combed back and aside, and the nearer to the temples, the more down.
    """
    shape, t = (BABY_HAIRS, 1), np.linspace(0.0, 1.0, KNOTS)
    share = random.uniform(-0.75, 0.75, shape)
    roots = _hairline(head, hull, share[:, 0], random.uniform(-1.5, 2.0, shape))
    combed = np.sign(share) * random.uniform(0.0, 1.5, shape), 0.5 - 2.5 * np.abs(share), -np.ones(shape)
    normals = hull(roots)[1]
    aside = unit(np.cross(np.hstack(combed), normals))
    way = np.cross(normals, aside)
    bent, reach = random.normal(0.0, 0.2, shape) * t**2, random.uniform(5.0, 18.0, shape)[..., None]
    points = roots[:, None] + reach * (t[:, None] * way[:, None] + bent[..., None] * aside[:, None])
    points += (1.0 + 2.5 * t - _gap(head, points))[..., None] * normals[:, None]  # out of the skin
    half = (0.08 * (1.0 - 0.7 * t))[:, None] * aside[:, None]
    strands = _strands(np.repeat(np.arange(BABY_HAIRS)[:, None], 2, axis=1))
    tints = 1.2 * np.repeat(_tints(random, BABY_HAIRS, 1), 2, axis=1)  # light gets through fine hairs
    return np.stack([points + half, points - half], axis=1), tints, strands


def _roots(head: Head, hull: RoundedHull, edge: Array, along: Array) -> Array:
    """Return the roots (k, 3), on the hull, of hairs at shares (k,) of the hairline, 3 mm inside of it, and at shares
    (k,) of the parting.
    """
    begin = _hairline(head, hull, edge, 3.0)
    back = np.array([5.0, 0.0, head.landmarks["trichion"][2] - 105.0])  # to the left of the middle, too
    return hull.reached(begin + along[:, None] * (back - begin), np.array([0.0, 1.0, 0.0]))


def _hairline(head: Head, hull: RoundedHull, edge: Array, inset: float | Array) -> Array:
    """Return points (k, 3) of the hull that are inset, mm, from the hairline, at shares (k,) of it from the parting to
    the left temple (1) or to the right one (-1); the parting begins where it suits the shape of the face.
    """
    marks = head.landmarks
    # The rounder a face, the farther aside: an oval face is 0.84 as wide as it is high from chin to hairline, a round
    # one 0.045 wider.
    ratio = (marks["zygion_l"] - marks["zygion_r"])[0] / (marks["trichion"] - marks["menton"])[1]
    front, temple = np.clip(4.0 + (ratio - 0.84) / 0.045 * 24.0, -16.0, 24.0), 60.0  # degrees to the left
    turn = np.radians(front + edge * temple - np.abs(edge) * front)[:, None]
    rise = np.linspace(0.5 * np.pi, -0.3, STEPS)
    ways = [np.sin(turn) * np.cos(rise), np.sin(rise) + 0.0 * turn, np.cos(turn) * np.cos(rise)]
    _, scalp, inside = _scalp(head, hull, np.stack(ways, axis=2))
    return _between(scalp, _outermost(inside - inset)[:, None])[:, 0]


def _scalp(head: Head, hull: RoundedHull, ways: Array) -> tuple[Array, Array, Array]:
    """Return a point (3,) between the ears, the points (k, s, 3) of the hull that are reached from it along ways, and
    how far (k, s) these are inside of the hairline.
    """
    marks = head.landmarks
    middle = marks["zygion_l"] * [0.0, 1.0, 1.0] + [0.0, 41.0, -12.0]
    scalp = hull.reached(middle, ways)
    inside = hair_cover(scalp.reshape(-1, 3), marks, frame_of(marks))
    return middle, scalp, inside.reshape(scalp.shape[:-1])


def _outermost(deep: Array) -> Array:
    """Return the fractional numbers (k,) of the places along lines at which depths (k, s) have fallen to 0."""
    lines, past = np.arange(len(deep)), (deep < 0.0).argmax(axis=1)
    return np.asarray(past - deep[lines, past] / (deep[lines, past] - deep[lines, past - 1]))


def _grown(hull: RoundedHull, roots: Array, comb: Array, reach: Array, lift: Array, hem: Array) -> tuple[Array, Array]:
    """Return the lines (k, STEPS + 1, 3) of hair, and how many of the steps (k,) it takes to reach the hem."""
    lines, way = [roots], np.zeros_like(roots)
    for step in range(STEPS):
        length, (height, normals) = step * STEP, hull(lines[-1])
        combed = comb - (comb * normals).sum(axis=1, keepdims=True) * normals
        # It clings to what it is near to.
        falling = -0.17 * np.exp(-height / 12.0)[:, None] * normals - [0.0, 0.8, 0.0]
        wanted = combed * np.exp(-length / reach)[:, None] + falling if step else combed + 0.4 * normals
        way = unit(1.5 * way + unit(wanted))
        least = lift * (1.0 - np.exp(-(length + STEP) / 30.0)) + 0.02 * (length + STEP)
        lines.append(hull.above(least, lines[-1] + STEP * way))
    grown = np.stack(lines, axis=1)
    low = grown[:, 1:, 1] < hem[:, None]
    low[:, -1] = True
    last, hairs = low.argmax(axis=1), np.arange(len(roots))
    above, below = grown[hairs, last, 1], grown[hairs, last + 1, 1]
    return grown, last + np.clip((above - hem) / (above - below), 0.0, 1.0)


def _locks(
    random: np.random.Generator,
    hull: RoundedHull,
    lines: Array,
    ends: Array,
    wide: Array,
    hairs: int,
    layers: float,
    loose: float,
) -> Array:
    """Return the points (k, hairs, KNOTS, 3) of locks along lines (k, s, 3), each a roof of so many hairs.

    Their tips are thin, of different lengths, and stray; the upper ones stand off more. Some begin on the way.
    """
    t, shape = np.linspace(0.0, 1.0, KNOTS), (len(lines), 1)
    begin = 0.45 * random.uniform(0.0, 1.0, shape) ** 2
    end = 1.04 - layers * random.uniform(0.0, 1.0, shape) ** 2
    points = _between(lines, ends[:, None] * (begin + (end - begin) * t**ROOTS_DENSER))
    up = hull(points)[1]
    aside = unit(np.cross(np.gradient(points, axis=1), up))
    # Locks come out of the sheet, and are 0.5 mm over it, or more.
    off = (0.8 + loose * random.uniform(0.0, 1.0, shape) ** 2) * smoothstep(5.0 * t) - 0.3
    stray = random.normal(0.0, 0.8 * loose, shape) * t + 0.6 * np.sin(9.0 * t + random.uniform(0.0, 6.0, shape)) * t
    points += off[..., None] * up + stray[..., None] * aside
    half = wide[:, None] * (0.1 + 0.9 * np.minimum(4.0 * t, 1.0)) * (1.0 - 0.7 * t**3)
    half, u = half[:, None, :, None], np.linspace(1.0, -1.0, hairs)[:, None, None]
    height = 0.08 * (1.0 - u**2) - 0.15 * u**4 + 0.08 * random.normal(size=(len(lines), hairs, 1, 1))
    roof = (points[:, None] + half * (u * aside[:, None] + height * up[:, None])).reshape(-1, KNOTS, 3)
    frayed = (KNOTS - 1.0) * (1.0 - np.abs(random.normal(0.0, 0.015, (len(roof), 1))))  # the lengths of hairs differ
    return _between(roof, frayed * t).reshape(len(lines), hairs, KNOTS, 3)


def _strands(numbers: npt.ArrayLike, power: float = 1.0) -> Array:
    """Return strands (k, hairs, KNOTS, 2) of hairs at which strands have numbers (k, hairs); the smaller the power, the
    more evenly they begin.
    """
    return np.stack(np.broadcast_arrays(np.expand_dims(numbers, -1), np.linspace(0.0, 1.0, KNOTS) ** power), axis=-1)


def _tints(random: np.random.Generator, locks: int, hairs: int) -> Array:
    """Return factors (locks, hairs, KNOTS) of the color: hairs differ, and are fair at the tips."""
    t = np.linspace(0.0, 1.0, KNOTS)
    streaks = random.uniform(-0.08, 0.08, (locks, hairs, 1)) + 0.08 * _even(random, (locks, hairs, KNOTS), 1.5)
    return np.asarray(np.exp(streaks) * (1.0 + 0.2 * t**2))


def _even(random: np.random.Generator, shape: tuple[int, ...], reach: float) -> Array:
    """Return noise of deviation 1 that changes slowly along the last axis."""
    noise = gaussian_filter1d(random.normal(size=shape), reach, mode="nearest")
    return np.asarray(noise / noise.std())


def _between(lines: Array, places: Array) -> Array:
    """Return points (k, p, 3) of lines (k, s, 3) at fractional numbers (k, p) of their points."""
    before = np.minimum(places.astype(int), lines.shape[1] - 2)
    hairs, share = np.arange(len(lines))[:, None], (places - before)[..., None]
    return np.asarray((1.0 - share) * lines[hairs, before] + share * lines[hairs, before + 1])


def _triangles(grids: list[tuple[int, int]]) -> IntArray:
    """Return the corners of the triangles of grids, so many of so many columns, each of KNOTS rows."""
    quads, first = [], 0
    for count, columns in grids:
        starts = first + columns * KNOTS * np.arange(count)[:, None, None]
        quads.append((starts + ring_quads(columns, KNOTS, closed=False)).reshape(-1, 4))
        first += count * columns * KNOTS
    corners = np.concatenate(quads)
    return np.vstack([corners[:, [0, 2, 1]], corners[:, [0, 3, 2]]])
