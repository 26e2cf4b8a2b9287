"""Triangular muscles.

equal widths              the sheet, number by number
no width at the start     the plane section of a linear muscle: angles and directions
any widths                the fiber through a point, intersected line by line
recoil                    the pull mirrored behind the attachment; with 1 it adds up to nothing
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skins import settled

from facewrinkle.anatomy.muscles import LinearMuscle, SheetMuscle, TriangularMuscle, Wrinkles

LINES = ([(-10, 40, 0), (10, 40, 0)], [(-4, 0, 0), (4, 0, 0)])
STYLE = Wrinkles(count=3, start=0.2, alpha=1.3, core=0.4, taper=0.3)


def around(n=3000, seed=4):
    return np.random.default_rng(seed).uniform((-20, -20, -30), (20, 60, 30), (n, 3))


def test_with_equal_widths_it_is_a_sheet():
    lines = LINES[0], [(-10, 0, 0), (10, 0, 0)]
    fan = TriangularMuscle(*lines, length=48.0, recoil=0.3, wrinkles=STYLE)
    sheet = SheetMuscle(*lines, length=48.0, recoil=0.3, wrinkles=STYLE)
    x = around()
    for name in ("coordinates", "force", "bunched", "envelope", "unit_amplitude", "fold_direction", "wrinkling_region"):
        np.testing.assert_allclose(getattr(fan, name)(x), getattr(sheet, name)(x), rtol=0, atol=1e-13)
    assert fan.reach[1] == sheet.reach[1]


def test_with_a_point_for_its_start_it_is_a_section_of_a_cone():
    fan = TriangularMuscle([(-1e-9, 40, 0), (1e-9, 40, 0)], LINES[1], length=50.0)
    cone = LinearMuscle((0, 40, 0), (0, 0, 0), np.arctan2(4.0, 40.0), 50.0)
    x = around() * (0.2, 1.0, 0.0)
    inside = (cone.coordinates(x)[1] < 1.0) & (cone.coordinates(x)[0] < 1.0) & (x[:, 1] < 39.0)
    assert inside.sum() > 100
    np.testing.assert_allclose(fan.fold_direction(x[inside]), cone.fold_direction(x[inside]), atol=1e-7)
    expected = np.tan(cone.coordinates(x[inside])[1] * cone.max_angle) / 0.1
    np.testing.assert_allclose(fan.coordinates(x[inside])[1], expected, atol=1e-7)


def test_the_fiber_through_a_point_runs_between_equal_shares_of_both_lines():
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    ends = [np.asarray(line) @ turn.T for line in LINES]
    fan = TriangularMuscle(*ends, length=48.0)
    rng = np.random.default_rng(0)
    share, way = rng.uniform(-1, 1, 200), rng.uniform(0.0, 1.2, 200)
    start, end = (line.mean(0) + 0.5 * share[:, None] * (line[1] - line[0]) for line in ends)
    x = start + way[:, None] * (end - start)
    lam, gamma = fan.coordinates(x)
    np.testing.assert_allclose(lam, way * 40.0 / 48.0, atol=1e-12)
    np.testing.assert_allclose(gamma, np.abs(share), atol=1e-12)
    along = (start - end) / np.linalg.norm(start - end, axis=1)[:, None]
    np.testing.assert_allclose(fan.fold_direction(x), along, atol=1e-12)
    size = np.where(way <= 1, np.sin(way * np.pi / 2), np.cos((lam - 5 / 6) * 6 * np.pi / 2))
    np.testing.assert_allclose(fan.force(x), (size * np.cos(share * np.pi / 2))[:, None] * along, atol=1e-12)


@pytest.mark.parametrize("ends", [(-10, 10), (-2, 2)], ids=["wider", "narrower"])
def test_a_fan_with_recoil_pulls_nothing_beyond_its_reach(ends):
    fan = TriangularMuscle(LINES[0], [(x, 0, 0) for x in ends], recoil=0.5)
    centre, radius = fan.reach
    points = centre + 2.0 * radius * np.random.default_rng(2).uniform(-1.0, 1.0, (100_000, 3))
    pulled = np.linalg.norm(points[fan.force(points).any(axis=1)] - centre, axis=1)
    assert 0.5 * radius < pulled.max() <= radius


@pytest.mark.parametrize("kind", [SheetMuscle, TriangularMuscle])
def test_recoil_is_the_pull_mirrored_at_the_attachment(kind):
    lines = LINES if kind is SheetMuscle else (LINES[0], [(-10, 0, 0), (10, 0, 0)])
    plain, both = kind(*lines, length=48.0), kind(*lines, length=48.0, recoil=1.0)
    x = around()
    mirrored = x * (1, -1, 1) + (0, 80.0, 0)
    front = x[:, 1] < 40.0
    np.testing.assert_array_equal(both.force(x)[front], plain.force(x)[front])
    np.testing.assert_allclose(both.force(mirrored)[front], -plain.force(x)[front], atol=1e-12)
    assert not plain.force(mirrored)[front].any()


def test_the_brows_are_raised_by_skin_that_converges_from_below_and_above(face):
    """At 61 % of its height (Cotofana et al.), which on people is 53 to 57 mm (trichion to glabella, Farkas), and 40
    here: about 33 mm above the brow, in the middle and over it.
    """
    axes, unit = face.frame.axes, face.unit
    up, local = settled(face, {"AU1": 1.0, "AU2": 1.0})[:, 1], face.points @ axes.T * unit
    front = face.tissue.normals @ axes[2] > 0.1
    marks = {name: point @ axes.T * unit for name, point in face.landmarks.items()}
    top = marks["trichion"][1]
    for place, brow in ((marks["glabella"][0], "brow_l_inner"), (marks["brow_l_mid"][0], "brow_l_mid")):
        heights = marks[brow][1] + np.linspace(0.0, 1.2, 61) * (top - marks[brow][1])
        weights = np.exp(-(((local[:, 0] - place) / 5.0) ** 2) - ((local[:, 1] - heights[:, None]) / 3.0) ** 2) * front
        way = (weights * up).sum(axis=1) / weights.sum(axis=1)
        above = heights[np.argmax(way < 0.0)] - heights[0]
        assert way[0] > 4.0
        assert way.min() < -1.0
        assert 25.0 < above < 40.0
