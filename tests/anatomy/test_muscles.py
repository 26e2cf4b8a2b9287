"""The three kinds of muscle.

what                                 checked against
coordinates (Eqs. 1-2, 12-14)        the same definitions point by point with acos, distances to lines and math
wrinkling region                     the inequalities of those coordinates; points on each border
amplitude (Eqs. 3-6, 11, 13, 15-18)  H and At written out point by point; 0 outside
fold direction                       the gradient of the phase by differences
force                                Theta1 Theta2 written out; its direction; its jump at the borders of the area
zones, reach                         their definition, triangle by triangle; random points of the region
"""

import dataclasses
import math

import numpy as np
import pytest
import pyvista as pv
from scipy.spatial.transform import Rotation

from facewrinkle.anatomy.muscles import (
    Crease,
    JawMuscle,
    LidMuscle,
    LinearMuscle,
    Muscle,
    SheetMuscle,
    SphincterMuscle,
    TriangularMuscle,
    Wrinkles,
    zones,
)
from facewrinkle.anatomy.muscles.skin_muscles import BELLY
from facewrinkle.errors import ParameterError
from facewrinkle.geometry import equations, unit

STYLE = Wrinkles(count=3, start=0.25, depth=0.9, alpha=2.0, core=0.4)
TURN = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
SHIFT = np.array([11.0, -7.0, 3.0])


def linear(**changes):
    muscle = LinearMuscle((1.0, -2.0, 3.0), (9.0, 22.0, -1.0), max_angle=0.55, radius=32.0, wrinkles=STYLE)
    return dataclasses.replace(muscle, **changes)


def sheet(**changes):
    # The lines cross the fibers at right angles, in a plane that is not parallel to any axis.
    lines = np.array([[(-12, 30, 0), (12, 30, 0)], [(-15, 0, 0), (15, 0, 0)]]) @ TURN.T + SHIFT
    muscle = SheetMuscle(lines[0], lines[1], length=36.0, width=27.0, thickness=11.0, wrinkles=STYLE)
    return dataclasses.replace(muscle, **changes)


def sphincter(**changes):
    muscle = SphincterMuscle(
        SHIFT, 38.0, 31.0, normal=TURN[:, 2], lateral=TURN[:, 0], inner=0.55, beta1=0.8, beta2=0.6, dead_zone=0.2,
        thickness=12.0, wrinkles=dataclasses.replace(STYLE, start=0.2),
    )  # fmt: skip
    return dataclasses.replace(muscle, **changes)


KINDS = {"linear": linear, "sheet": sheet, "sphincter": sphincter}
STYLES = {
    "default": {},
    "paper ends": {"ends": "paper"},
    "smooth": {"falloff": "smoothstep", "alpha": 1.3},
    "no core": {"core": 0.0},
    "hard edge": {"core": 1.0},
    "many": {"count": 7, "alpha": 4.0},
}


@pytest.fixture(params=list(KINDS))
def muscle(request):
    return KINDS[request.param]()


def around(muscle, n=4000, seed=5):
    """Random points in a box that holds the muscle with a wide margin."""
    rng = np.random.default_rng(seed)
    if isinstance(muscle, SphincterMuscle):
        middle, size = np.asarray(muscle.centre), 1.3 * muscle.semi_major
    else:
        ends = np.atleast_2d(muscle.attachment).mean(0), np.atleast_2d(muscle.insertion).mean(0)
        middle, size = 0.5 * (ends[0] + ends[1]), 28.0
    return middle + rng.uniform(-size, size, (n, 3))


def plain_coordinates(muscle, x):
    """The definitions of the paper for one point: (first, second, distance along, distance from the plane)."""
    if isinstance(muscle, LinearMuscle):
        to_insertion = [b - a for a, b in zip(muscle.attachment, muscle.insertion, strict=True)]
        to_point = [b - a for a, b in zip(muscle.attachment, x, strict=True)]
        r = math.hypot(*to_point)
        cosine = sum(a * b for a, b in zip(to_insertion, to_point, strict=True)) / (r * math.hypot(*to_insertion))
        l = r * cosine
        return l / muscle.radius, math.acos(max(-1.0, min(1.0, cosine))) / muscle.max_angle, l, 0.0
    if isinstance(muscle, SheetMuscle):
        a1, a2 = muscle.attachment
        middle = (a1 + a2) / 2
        fiber = (muscle.insertion[0] + muscle.insertion[1]) / 2 - middle
        normal = unit(np.cross(a2 - a1, fiber))
        flat = x - ((x - middle) @ normal) * normal
        # Distances of the foot in the plane from two lines: |cross product| / length.
        l = np.linalg.norm(np.cross(flat - a1, a2 - a1)) / np.linalg.norm(a2 - a1)
        l = math.copysign(l, (flat - middle) @ fiber)
        h = np.linalg.norm(np.cross(flat - middle, fiber)) / np.linalg.norm(fiber)
        return l / muscle.length, 2 * h / muscle.width, l, abs((x - middle) @ normal)
    offset = x - np.asarray(muscle.centre)
    s, t = float(offset @ muscle.lateral), float(offset @ muscle.vertical)
    psi = math.atan2(t, s)
    r = math.sqrt((s / muscle.semi_major) ** 2 + (t / muscle.semi_minor) ** 2)
    return r, psi, psi, abs(float(offset @ muscle.normal))


def plain_amplitude(muscle, x):
    """H At at k0 = 1 of one point, written out."""
    first, second, along, away = plain_coordinates(muscle, x)
    style = muscle.wrinkles
    if isinstance(muscle, SphincterMuscle):
        inside = -muscle.beta1 <= second <= muscle.beta2 and muscle.inner <= first <= 1.0 and away <= muscle.thickness
        start, u = -muscle.beta1, (muscle.beta1 + muscle.beta2) / (2 * style.count)
        width = (1.0 - style.core) * (1.0 - muscle.inner) / 2.0
        bands = [(muscle.inner + width - first, width), (first - 1.0 + width, width)]
    else:
        inside = style.start <= first <= 1.0 and second <= 1.0 and away <= getattr(muscle, "thickness", math.inf)
        length = muscle.radius if isinstance(muscle, LinearMuscle) else muscle.length
        start, u = style.start * length, (1.0 - style.start) * length / (2 * style.count)
        bands = [(second - style.core, 1.0 - style.core)]
    if not inside:
        return 0.0
    d = (2.0 ** (style.alpha + 1) - 1) / (2 * (style.alpha + 1))
    shift = 0.0 if style.ends == "paper" else u * (1.0 - equations.zero_crossing(style.alpha))
    w = along - start + shift
    w -= 2 * u * math.floor(w / (2 * u))
    s = (w - u) / u
    height = d - abs(s) * (1 + s * s) ** style.alpha
    for over, width in bands:
        s = min(max(over / width, 0.0), 1.0) if width > 0.0 else 0.0
        height *= 1 - (s + s**3) / 2 if style.falloff == "paper" else 1 - 3 * s**2 + 2 * s**3
    return height


# --- coordinates and regions --------------------------------------------------------------------


def test_coordinates_are_those_of_the_paper(muscle):
    x = around(muscle)
    expected = np.array([plain_coordinates(muscle, p)[:2] for p in x])
    np.testing.assert_allclose(np.stack(muscle.coordinates(x), 1), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("style", STYLES)
def test_amplitude_is_h_times_at_and_zero_outside(kind, style):
    muscle = KINDS[kind]().replaced(**STYLES[style])
    x = around(muscle)
    inside, amplitude = muscle.wrinkling_region(x), muscle.unit_amplitude(x)
    assert 50 < inside.sum() < len(x) - 1000
    assert (amplitude[~inside] == 0.0).all()
    assert (muscle.envelope(x)[~inside] == 0.0).all()
    assert (muscle.envelope(x) <= 1.0).all()
    some = inside | (np.arange(len(x)) % 8 == 0)  # point by point is slow
    expected = np.array([plain_amplitude(muscle, p) for p in x[some]])
    np.testing.assert_allclose(amplitude[some], expected, rtol=0, atol=1e-10 * 2.0**muscle.wrinkles.alpha)


def test_the_borders_of_a_region_belong_to_it():
    """Muscles along the axes, whose coordinates of these points are exact."""
    muscle = LinearMuscle((0, 0, 0), (0, 30, 0), math.atan2(10.0, 20.0), radius=40.0, wrinkles=STYLE)
    assert muscle.wrinkling_region([(0, 10, 0), (0, 40, 0), (10, 20, 0), (-6, 20, 8)]).all()
    flat = SheetMuscle(*LINES, thickness=8.0, wrinkles=STYLE)
    assert flat.wrinkling_region([(0, 30, 0), (0, 0, 0), (10, 20, 0), (-10, 20, 0), (0, 20, 8), (0, 20, -8)]).all()
    side = math.atan2(12.0, 16.0)
    ring = SphincterMuscle(
        (0, 0, 0), 40.0, 32.0, (0, 0, 1), (1, 0, 0), inner=0.5, beta1=side, beta2=side, dead_zone=0.25, thickness=8.0
    )
    assert ring.wrinkling_region([(20, 0, 0), (40, 0, 0), (20, 15, 0), (20, -15, 0), (30, 0, 8), (30, 0, -8)]).all()
    # The pull reaches as far: to the border of the thickness, but not to where Theta2 has fallen to 0.
    assert flat.force([(0, 20, 8), (0, 0, 0), (0, 20, -8)]).any(axis=1).all()
    assert ring.force([(20, 0, 8), (0, 20, -8), (10.001, 0, 0)]).any(axis=1).all()
    assert not flat.force([(10, 20, 0), (-11, 20, 0), (15, 20, 0), (0, 40, 0)]).any()
    assert not ring.force([(40, 0, 0), (0, -32, 0), (50, 0, 0), (10, 0, 0)]).any()
    assert not muscle.force([(10, 20, 0), (12, 20, 0), (0, 0, 0)]).any()
    wide = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=1.5, radius=40.0, wrinkles=Wrinkles(start=0.0))
    behind = [(0.0, -1e-9, 0.0), (0.0, -20.0, 0.0), (5.0, -0.1, 0.0), (0.0, 0.0, 0.0)]
    assert not (wide.wrinkling_region(behind) | wide.force(behind).any(axis=1)).any()


# --- wrinkles along the muscle ------------------------------------------------------------------


def test_fold_direction_crosses_the_folds(muscle):
    x = around(muscle)
    if isinstance(muscle, SphincterMuscle):
        r, psi = muscle.coordinates(x)
        x = x[(r > 0.2) & (abs(psi) < 3.0)]
    direction = muscle.fold_direction(x)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0, atol=1e-14)
    if isinstance(muscle, LinearMuscle):
        offset = x - muscle.attachment
        np.testing.assert_allclose(direction, -offset / np.linalg.norm(offset, axis=1)[:, None], atol=1e-13)
        return
    index = 1 if isinstance(muscle, SphincterMuscle) else 0
    h = 1e-6
    steps = [muscle.coordinates(x + h * e)[index] - muscle.coordinates(x - h * e)[index] for e in np.eye(3)]
    np.testing.assert_allclose(direction, (1.0 if index else -1.0) * unit(np.stack(steps, axis=1)), atol=1e-5)


def test_half_cycles_as_lengths():
    assert linear().half_wavelength == pytest.approx(0.75 * 32.0 / 6.0)
    assert sheet().half_wavelength == pytest.approx(0.75 * 36.0 / 6.0)
    ring = sphincter()
    angle = 1.4 / 6.0
    assert ring.half_wavelength == pytest.approx(38.0 * angle)
    x = around(ring)
    radius = np.linalg.norm((x - SHIFT) - ((x - SHIFT) @ TURN[:, 2])[:, None] * TURN[:, 2], axis=1)
    np.testing.assert_allclose(ring.half_cycles(x), radius * angle, rtol=1e-12)
    assert set(linear().half_cycles(x)) == {linear().half_wavelength}


# --- force --------------------------------------------------------------------------------------


def plain_force(muscle, x):
    """Theta1 Theta2 and a direction for one point."""
    first, second, _, away = plain_coordinates(muscle, x)
    if isinstance(muscle, SphincterMuscle):
        if not (muscle.dead_zone < first < 1.0) or away > muscle.thickness:
            return 0.0
        return math.cos((first - muscle.dead_zone) / (1 - muscle.dead_zone) * math.pi / 2)
    ends = np.atleast_2d(muscle.attachment).mean(0), np.atleast_2d(muscle.insertion).mean(0)
    length = muscle.radius if isinstance(muscle, LinearMuscle) else muscle.length
    inserted = math.dist(*ends) / length
    if not 0.0 <= first <= 1.0 or second > 1.0 or away > getattr(muscle, "thickness", math.inf):
        return 0.0
    rise = (1 - first / inserted) if first <= inserted else (first - inserted) / (1 - inserted)
    return math.cos(rise * math.pi / 2) * math.cos(second * math.pi / 2)


def test_force_has_the_size_of_waters_cosines(muscle):
    x = around(muscle)
    force, expected = muscle.force(x), np.array([plain_force(muscle, p) for p in x])
    size = np.linalg.norm(force, axis=1)
    np.testing.assert_allclose(size, expected, atol=1e-11)
    if not isinstance(muscle, SphincterMuscle):  # towards the attachment
        np.testing.assert_allclose(force, expected[:, None] * muscle.fold_direction(x), atol=1e-11)
    assert size.max() <= 1.0 + 1e-15
    assert (size > 0.0).any()


def test_sphincters_squeeze_in_their_plane_and_more_along_the_minor_axis():
    muscle = sphincter()
    x = around(muscle)
    force, offset = muscle.force(x), x - SHIFT
    np.testing.assert_allclose(force @ TURN[:, 2], 0.0, atol=1e-15)
    s, t = offset @ TURN[:, 0], offset @ TURN[:, 1]
    fs, ft = force @ TURN[:, 0], force @ TURN[:, 1]
    pulled = np.linalg.norm(force, axis=1) > 0.0
    assert pulled.any()
    assert (fs * s <= 0.0).all()
    assert (ft * t <= 0.0).all()
    # The gradient of the ellipse: its vertical part is (a / b)^2 times that of a pull to the centre.
    np.testing.assert_allclose((ft * s)[pulled], (fs * t)[pulled] * (38.0 / 31.0) ** 2, atol=1e-10)
    r, _ = muscle.coordinates(x)
    assert not force[(r < 0.2) | (r >= 1.0)].any()


def test_a_sheet_shorter_than_its_fibers_pulls_the_most_at_its_end():
    short = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=30.0)  # and so does a linear muscle
    np.testing.assert_allclose(short.force([(0, 30, 0)]), [[0, -1, 0]], atol=1e-15)
    muscle = SheetMuscle(*LINES, length=30.0)
    l = np.linspace(0.5, 29.5, 59)
    force = muscle.force(np.c_[0.0 * l, 40.0 - l, 0.0 * l])
    np.testing.assert_allclose(force[:, 1], np.sin(l / 30.0 * math.pi / 2), atol=1e-12)
    np.testing.assert_allclose(muscle.force([(0, 10, 0)]), [[0, 1, 0]], atol=1e-12)
    assert not muscle.force([(0, 9.999, 0)]).any()


def test_lips_that_purse_are_pushed_forward():
    plain, pursed = sphincter(), sphincter(protrusion=0.4)
    x = around(plain)
    r, _ = plain.coordinates(x)
    near = np.abs((x - SHIFT) @ TURN[:, 2]) <= 12.0
    push = np.where(near & (r < 1.0), 0.4 * np.cos(np.minimum(r, 1.0) * math.pi / 2), 0.0)
    np.testing.assert_allclose(pursed.force(x), plain.force(x) + push[:, None] * TURN[:, 2], rtol=0, atol=1e-13)
    assert (near & (r < 0.2)).any()
    assert (~near & (r < 1.0)).any()


# --- styles, copies, errors ---------------------------------------------------------------------


def test_folds_lie_where_they_are_asked_for_and_are_replaced_there():
    plain, elsewhere = linear(), sheet()
    muscle = LinearMuscle((1.0, -2.0, 3.0), (9.0, 22.0, -1.0), max_angle=0.55, radius=32.0, folds=elsewhere)
    other = muscle.replaced(depth=3.0, strength=0.5, radius=40.0)
    assert (muscle.fold_pattern, plain.fold_pattern) == (elsewhere, plain)
    np.testing.assert_array_equal(muscle.force(around(plain)), plain.force(around(plain)))
    assert (other.folds.wrinkles.depth, other.wrinkles.depth, other.strength, other.radius) == (3.0, 3.0, 0.5, 40.0)
    assert (muscle.wrinkles.depth, muscle.strength, other.folds.strength) == (0.9, 1.0, 1.0)
    assert repr(plain.replaced(count=5).wrinkles) == repr(dataclasses.replace(STYLE, count=5))


def test_what_is_read_of_a_muscle_is_what_is_replaced(face):
    """Every number of the wrinkles of every muscle of a face."""
    new = {"count": 9, "start": 0.77, "depth": 7.5, "alpha": 0.7, "core": 0.21, "taper": 0.33, "ends": "paper",
           "falloff": "smoothstep", "fronts": "round", "waves": True}  # fmt: skip
    refused = 0
    for muscle in face.muscles.values():
        for name, value in new.items():
            if name in muscle.fold_pattern.ignored:
                refused += 1
                with pytest.raises(ParameterError, match=f" has no {name}: "):
                    muscle.replaced(**{name: value})
                continue
            other = muscle.replaced(**{name: value})
            assert getattr(other.wrinkles, name) == getattr(other.fold_pattern.wrinkles, name) == value
            rest = dataclasses.replace(other.wrinkles, **{name: getattr(muscle.wrinkles, name)})
            assert repr(rest) == repr(muscle.wrinkles)
            assert repr(other.replaced(**{name: getattr(muscle.wrinkles, name)})) == repr(muscle)
    assert 100 < refused < len(face.muscles) * len(new) - 100


def test_other_folds_bring_their_own_wrinkles(face):
    muscle = face.muscles["corrugator_l"]
    crease = muscle.folds.replaced(depth=9.0)
    other = muscle.replaced(folds=crease)
    assert other.wrinkles is other.folds.wrinkles
    assert other.wrinkles.depth == 9.0
    free = muscle.replaced(folds=None, count=4)
    assert (free.folds, free.wrinkles.count, free.wrinkles.depth) == (None, 4, muscle.wrinkles.depth)
    ring = face.muscles["orbicularis_oculi_l"]
    assert ring.replaced(folds=None).wrinkles.depth == ring.wrinkles.depth
    assert muscle.replaced(wrinkles=Wrinkles(depth=2.0)).folds.wrinkles.depth == 2.0
    with pytest.raises(ParameterError, match="has no count"):
        muscle.replaced(wrinkles=Wrinkles(count=4))
    with pytest.raises(ParameterError, match="or change them with replaced"):
        dataclasses.replace(muscle, folds=crease)


@pytest.mark.parametrize("taper", [np.float32(0.5), np.array(0.5), np.array([0.5, 0.25]), [0.5, 0.25], (0.5, 0.25)])
def test_a_taper_may_be_any_number(taper):
    assert Wrinkles(taper=taper).tapers == (0.5, 0.25 if np.ndim(taper) else 0.5)


def test_muscles_keep_their_own_copies_of_the_input():
    attachment, centre = np.zeros(3), np.zeros(3)
    muscle = LinearMuscle(attachment, (0, 30, 0), 0.5, 40.0)
    ring = SphincterMuscle(centre, 3.0, 2.0, (0, 0, 2), (3e-9, 0, 1e-9), vertical=(0, -1e-3, 0))
    attachment[:], centre[:] = 99.0, 99.0
    assert not np.any([muscle.attachment, ring.centre])
    with pytest.raises(ValueError):
        muscle.attachment[0] = 1.0
    directions = [ring.normal, ring.lateral, ring.vertical]  # of length 1, and at right angles
    np.testing.assert_allclose(directions, [(0, 0, 1), (1, 0, 0), (0, -1, 0)], atol=1e-15)


def test_what_moves_a_bone_neither_pulls_nor_folds():
    x = np.random.default_rng(4).normal(scale=20.0, size=(30, 3))
    for muscle in (Muscle(), JawMuscle((0, 0, 0), (1, 0, 0), 0.3), LidMuscle("l")):
        assert not np.any(muscle.force(x))
        assert not np.any(muscle.unit_amplitude(x))
        assert not muscle.wrinkling_region(x).any()
        assert muscle.half_wavelength == np.inf
        assert muscle.wrinkling_region(x).dtype == bool
        shapes = [getattr(muscle, name)(x).shape for name in ("force", "fold_direction", "height", "envelope")]
        assert shapes == [(30, 3), (30, 3), (30,), (30,)]
        assert (muscle.half_cycles(x) == np.inf).all()
    assert [c.tolist() for c in Muscle().coordinates(x)] == [[0.0] * 30] * 2


def test_round_furrows_are_arcs_about_the_attachment():
    muscle = linear().replaced(fronts="round")
    x = around(muscle)
    r = np.linalg.norm(x - muscle.attachment, axis=1)
    inside = muscle.wrinkling_region(x)
    assert inside.sum() > 20
    assert ((r[inside] >= 0.25 * 32.0) & (r[inside] <= 32.0)).all()
    # Where the distance is equal, so is H; on the central fiber it is that of straight furrows.
    fiber = (muscle.insertion - muscle.attachment) / muscle.length
    onto = muscle.attachment + r[:, None] * fiber
    np.testing.assert_allclose(muscle.height(x), linear().height(onto), atol=1e-9)
    tapered = muscle.replaced(taper=1.0)
    share = 1.0 - np.abs(2.0 * (r[inside] / 32.0 - 0.25) / 0.75 - 1.0)
    expected = muscle.envelope(x)[inside] * (3.0 * share**2 - 2.0 * share**3)
    np.testing.assert_allclose(tapered.envelope(x)[inside], expected, atol=1e-12)
    # H changes along the direction in which compression is measured, and not across it.
    across = np.cross(muscle.fold_direction(x), [0.3, -0.5, 0.8])
    np.testing.assert_allclose(muscle.height(x + 1e-5 * across), muscle.height(x), atol=1e-8)


@pytest.mark.parametrize("taper", [0.6, (0.6, 0.0), (0.0, 1.4), (0.6, 1.4)])
def test_furrows_taper_towards_both_ends(muscle, taper):
    x = around(muscle)
    full, tapered = muscle.replaced(taper=0.0).unit_amplitude(x), muscle.replaced(taper=taper).unit_amplitude(x)
    first, second = muscle.coordinates(x)
    if isinstance(muscle, SphincterMuscle):
        place = (second + muscle.beta1) / (muscle.beta1 + muscle.beta2)
    else:
        place = (first - STYLE.start) / (1.0 - STYLE.start)
    start, end = np.broadcast_to(taper, 2) + 1e-15
    share = np.clip(np.minimum(2.0 * place / start, 2.0 * (1.0 - place) / end), 0.0, 1.0)
    np.testing.assert_allclose(tapered, full * (3.0 * share**2 - 2.0 * share**3), atol=1e-12)
    assert np.abs(tapered).max() > 0.0


LINES = ([(-10, 40, 0), (10, 40, 0)], [(-10, 0, 0), (10, 0, 0)])
FAN = ([(-10, 40, 0), (10, 40, 0)], [(-4, 0, 0), (4, 0, 0)])
PATH = [(0.0, 40.0, 0.0), (6.0, 18.0, 0.0), (0.0, 0.0, 0.0)]
BAD = {
    "angle 0": (lambda: LinearMuscle((0, 0, 0), (0, 1, 0), 0.0, 4.0), "max_angle"),
    "angle of a half space": (lambda: LinearMuscle((0, 0, 0), (0, 1, 0), math.pi / 2, 4.0), "max_angle"),
    "angle nan": (lambda: LinearMuscle((0, 0, 0), (0, 1, 0), math.nan, 4.0), "max_angle"),
    "radius nan": (lambda: LinearMuscle((0, 0, 0), (0, 5, 0), 0.5, math.nan), "radius"),
    "two coordinates": (lambda: LinearMuscle((0, 0), (0, 5, 0), 0.5, 6.0), "attachment"),
    "words": (lambda: LinearMuscle("abc", (0, 5, 0), 0.5, 6.0), "attachment"),
    "lines of unequal points": (lambda: SheetMuscle([(0, 4), (1, 4, 0)], LINES[1]), "attachment"),
    "line is a number": (lambda: SheetMuscle(LINES[0], 5.0), "insertion"),
    "length nan": (lambda: SheetMuscle(*LINES, length=math.nan), "length must be at least 0"),
    "width nan": (lambda: SheetMuscle(*LINES, width=math.nan), "width must be at least 0"),
    "axis nan": (lambda: sphincter(semi_major=math.nan, thickness=3.0), "semi_major"),
    "lateral almost normal": (lambda: sphincter(lateral=(0.1, 0.2, 0.3), normal=(0.2, 0.4, 0.6)), "lateral"),
    "nan coordinate": (lambda: LinearMuscle((0, 0, 0), (0, math.nan, 0), 0.5, 6.0), "insertion"),
    "line is a point": (lambda: SheetMuscle([(0, 4, 0), (0, 4, 0)], LINES[1], width=3.0), "attachment line"),
    "negative thickness": (lambda: SheetMuscle(*LINES, thickness=-3.0), "thickness must be at least 0"),
    "axis 0": (lambda: sphincter(semi_major=0.0), "semi_major"),
    "minor axis negative": (lambda: sphincter(semi_minor=-1.0), "semi_minor"),
    "no normal": (lambda: sphincter(normal=(0, 0, 0)), "normal"),
    "inner nan": (lambda: sphincter(inner=math.nan), "inner"),
    "depth nan": (lambda: Wrinkles(depth=math.nan), "depth"),
    "taper of one": (lambda: Wrinkles(taper=(0.1,)), "taper"),
    "taper of three": (lambda: Wrinkles(taper=(0.1, 0.2, 0.3)), "taper"),
    "taper word": (lambda: Wrinkles(taper="x"), "taper"),
    "taper none": (lambda: Wrinkles(taper=None), "taper"),
    "taper negative": (lambda: Wrinkles(taper=(0.1, -0.1)), "taper"),
    "taper too long": (lambda: Wrinkles(taper=2.1), "taper"),
    "flat points": (lambda: linear().coordinates([1.0, 2.0, 3.0]), "points"),
    "two points": (lambda: Crease(PATH[:2], (1, 0, 0), 9.0), "path must be three points"),
    "a path of words": (lambda: Crease("abc", (1, 0, 0), 9.0), "path"),
    "crest along the chord": (lambda: Crease(PATH, (0, 3, 0), 9.0), "crest must cross"),
    "one point thrice": (lambda: Crease(PATH[:1] * 3, (1, 0, 0), 9.0), "crest must cross"),
    "middle beyond the end": (lambda: Crease([PATH[0], (3, -2, 0), PATH[2]], (1, 0, 0), 9.0), "second point"),
    "no width": (lambda: Crease(PATH, (1, 0, 0), 0.0), "width must be a finite number"),
    "width of a crease nan": (lambda: Crease(PATH, (1, 0, 0), np.nan), "width"),
    "span falls": (lambda: Crease(PATH, (1, 0, 0), 9.0, span=(0.5, 0.2)), "span"),
    "span of one": (lambda: Crease(PATH, (1, 0, 0), 9.0, span=(0.5,)), "span"),
    "span beyond the path": (lambda: Crease(PATH, (1, 0, 0), 9.0, span=(0.5, 1.2)), "span"),
    "variety above one": (lambda: Crease(PATH, (1, 0, 0), 9.0, variety=1.2), "variety"),
    "sliding": (lambda: LinearMuscle((0, 0, 0), (0, 9, 0), 0.5, 9.0, sliding=1.5), "sliding"),
    "fibers that meet": (lambda: TriangularMuscle(*FAN, length=70.0), "the fibers meet 66.6667 from"),
    "negative width of the insertion": (lambda: TriangularMuscle(*FAN, insertion_width=-1.0), "insertion_width"),
    "recoil negative": (lambda: SheetMuscle(*FAN, recoil=-0.1), "recoil"),
    "three ends of a line": (lambda: TriangularMuscle([*FAN[0], (0, 0, 0)], FAN[1]), "pair"),
}


@pytest.mark.parametrize(("call", "message"), BAD.values(), ids=BAD)
def test_bad_parameters_are_refused(call, message):
    """Those of `test_messages` too."""
    with pytest.raises(ParameterError, match=message):
        call()


# --- zones ----------------------------------------------------------------------------------------


def zone_by_definition(muscle, points, triangles):
    """Each triangle with a corner in the region, or another of the 45 places of one that is large beside the muscle;
    and all that share a vertex with one.
    """
    a, b, c = np.swapaxes(points[triangles], 0, 1)
    large = np.linalg.norm([a - b, b - c, c - a], axis=2).max(axis=0) > 0.5 * muscle.reach[1]
    touched = muscle.wrinkling_region(points)[triangles].any(axis=1)
    if large.any():
        corners = points[triangles[large]].reshape(-1, 3)  # of triangles that are apart
        fine = pv.PolyData.from_regular_faces(corners, np.arange(len(corners)).reshape(-1, 3)).subdivide(3, "linear")
        parts = muscle.wrinkling_region(fine.points)[fine.regular_faces].any(axis=1)
        touched[large] = parts.reshape(large.sum(), -1).any(axis=1)
    return np.isin(triangles, triangles[touched]).any(axis=1)


def test_zones_are_those_of_their_definition(face):
    patterns = [muscle.fold_pattern for muscle in face.muscles.values()]
    coarse = pv.PolyData.from_regular_faces(face.points, face.triangles).decimate(0.93)
    for points, triangles in ((face.points, face.triangles), (np.asarray(coarse.points, float), coarse.regular_faces)):
        found = zones(patterns, points, triangles)
        assert sum(zone.any() for zone in found) > 20
        for muscle, zone in zip(patterns, found, strict=True):
            assert np.array_equal(zone, zone_by_definition(muscle, points, triangles))
    left, right = (list(face.muscles).index(f"corrugator_{side}") for side in "lr")
    elsewhere = face.with_muscles({"corrugator_l": face.muscles["corrugator_r"]}).zones
    assert np.array_equal(elsewhere[left], face.zones[right])


def test_flesh_is_bunched_up_around_the_belly():
    muscle = linear()
    along = np.linspace(0.0, 2.0, 201)[:, None] * (np.subtract(muscle.insertion, muscle.attachment)) / muscle.length
    way, share = along * muscle.radius, muscle.bunched(np.asarray(muscle.attachment) + along * muscle.radius)
    peak = np.linalg.norm(way[np.argmax(share)]) / muscle.radius
    assert (peak, share.max()) == pytest.approx((BELLY[0], 1.0), abs=1e-9)
    assert (np.diff(share[: np.argmax(share)]) > 0.0).all()
    assert (np.diff(share[np.argmax(share) :]) <= 0.0).all()


def test_sheets_bunch_up_flesh_as_a_linear_muscle_in_their_middle_does():
    lines = [(-9, 40, 0), (9, 40, 0)], [(-9, 0, 0), (9, 0, 0)]
    sheet, between = SheetMuscle(*lines, length=48.0, swell=0.5), LinearMuscle((0, 40, 0), (0, 0, 0), 0.3, 48.0)
    x = np.random.default_rng(3).uniform(-60.0, 60.0, (20_000, 3))
    np.testing.assert_allclose(sheet.bunched(x), between.bunched(x), rtol=0, atol=1e-14)
    middle, reach = sheet.reach
    assert np.linalg.norm(x[sheet.bunched(x) > 0.0] - middle, axis=1).max() <= reach


def test_regions_and_pull_lie_within_reach(muscle):
    pulling = dataclasses.replace(muscle, recoil=0.5) if isinstance(muscle, SheetMuscle) else muscle

    def pulled(x):
        return pulling.force(x).any(axis=1) | (pulling.bunched(x) > 0.0)

    for one, acts, least in ((muscle, muscle.wrinkling_region, 0.7), (pulling, pulled, 0.5)):
        middle, reach = one.reach
        points = middle + 2.0 * reach * np.random.default_rng(9).uniform(-1.0, 1.0, (200_000, 3))
        assert least * reach < np.linalg.norm(points[acts(points)] - middle, axis=1).max() <= reach
    assert Muscle().reach[1] == 0.0, "what neither pulls nor swells has none"
