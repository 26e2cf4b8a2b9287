"""Wave folds as a layer.

what                  checked against
depth and direction   wavelength by the spectrum; heights constant along the lines; more compression, deeper folds
bounds                arc length of sections, with the length that the compression frees; the volume between the
                      surfaces with and without folds, with what is displaced
rest, histories       W exactly 0 and the mesh at the start; the same heights after other times
material              phases do not move; another identity keeps its lines, another seed does not;
                      other triangles of the same skin do
age                   nothing at 0; furrows at rest, none where the skin is stretched
refinement            the chord error of a sampled cosine; a held pose changes no triangle; no triangle is turned over
errors                the messages

Factors of the depth of folds by places: what they are there, far from there, and in between.
"""

import numpy as np
import pytest
import pyvista as pv
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from small_meshes import area_vectors
from small_meshes import pressed as pressed_by

import facewrinkle as fw
from analysis.swept import swept_volumes
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.layers.base import SurfacePoints
from facewrinkle.layers.wave_folds import FoldShapes, WaveFolds
from facewrinkle.layers.wave_folds._kernels import NARROWEST, TOLERANCE, spacing_for
from facewrinkle.layers.wave_folds.field import WaveField
from facewrinkle.layers.wave_folds.layer import REGIONS, amounts
from facewrinkle.layers.wave_folds.stripes import Style
from facewrinkle.layers.wave_folds.tissue import wavelengths
from facewrinkle.simulation.fold_layers import fold_shapes


@pytest.fixture(scope="module")
def sheet():
    """A flat surface without anatomy."""
    return fw.surface(pv.Plane(i_size=90, j_size=60, i_resolution=45, j_resolution=30).triangulate())


@pytest.fixture(scope="module")
def vertically(sheet):
    """Families of a sheet whose only motion presses it together from above and below."""
    return {"pressed": [sheet.points * [1.0, 0.75, 1.0]]}


@pytest.fixture(scope="module")
def pressed(sheet):
    """Presses the sheet: returns the simulation and its last frame."""

    def press(layer, *shares, level=3):
        sim = fw.Simulation(
            sheet, fw.Refinement(max_level=level), layers=[layer], motion=pressed_by(sheet, shares), time_step=0.02
        )
        *_, frame = sim.run(len(shares) + 8)
        return sim, frame

    return press


EVEN = {"irregularity": 0.0}
PRESSED = (0.0, 0.25)


def section(sim, frame, x, n=2001):
    """Places at rest (n,) along a vertical line of the sheet, and the heights there."""
    rest, height = np.asarray(frame["rest"]), np.asarray(frame["W"])
    y = np.linspace(-24.0, 24.0, n)
    return y, LinearNDInterpolator(rest[:, :2], height)(np.full(n, x), y)


def test_folds_lie_across_the_compression_as_far_apart_as_the_thickness_says(sheet, vertically, pressed):
    sim, frame = pressed(WaveFolds(families=vertically, **EVEN), PRESSED)
    y, height = section(sim, frame, 3.0)
    power = np.abs(np.fft.rfft(height - height.mean(), 1 << 15)) ** 2
    found = np.fft.rfftfreq(1 << 15, y[1] - y[0])[power.argmax()]
    assert 1.0 / found == pytest.approx(wavelengths(sheet)[0], rel=0.12)
    along = np.array([section(sim, frame, x)[1] for x in np.linspace(-2.0, 2.0, 5)])
    assert np.abs(np.diff(along, axis=0)).max() < 0.35 * np.ptp(height)
    shallow = pressed(WaveFolds(families=vertically, **EVEN), (0.0, 0.08))[1]
    assert 0.1 < np.ptp(shallow["W"]) < 0.8 * np.ptp(frame["W"])


def test_the_length_of_lines_is_where_they_are_deep_and_not_where_they_lie(vertically, pressed):
    found = []
    for length in (0.5, 1.0, 2.0):
        (stripes,) = (
            pressed(WaveFolds(families=vertically, length=length), PRESSED, level=0)[0].layers[0].lines.values()
        )
        found.append((stripes.phase, (stripes.share > 0.5 * stripes.share.max()).mean()))
    np.testing.assert_array_equal(found[0][0], found[1][0])
    np.testing.assert_array_equal(found[2][0], found[1][0])
    (_, short), (_, usual), (_, long) = found
    assert short < 0.8 * usual < 0.8 * long


@pytest.mark.parametrize(("depth", "share"), [(1.0, 0.15), (50.0, 0.06), (50.0, 0.25)])
def test_folds_are_no_longer_than_the_compression_frees(vertically, pressed, depth, share):
    sim, frame = pressed(WaveFolds(depth, families=vertically), (0.0, share))
    for x in (-20.0, 0.0, 14.0):
        y, height = section(sim, frame, x)
        assert np.ptp(height) > 0.05
        chord = (1.0 - share) * np.ptp(y)
        arc = np.hypot((1.0 - share) * np.diff(y), np.diff(height)).sum()
        assert chord < arc <= np.ptp(y)


def test_folds_of_skin_that_may_grow_longer_are_as_deep_as_was_asked(vertically, pressed):
    usual, exaggerated = (
        pressed(WaveFolds(depth, families=vertically, inextensible=False), PRESSED, level=0)[1]["W"]
        for depth in (1, 10)
    )
    np.testing.assert_allclose(exaggerated, 10.0 * usual, rtol=1e-12)
    _, frame = pressed(WaveFolds(10.0, families=vertically), PRESSED, level=0)
    assert np.ptp(frame["W"]) < 0.4 * np.ptp(exaggerated)


def test_crossing_families_share_what_skin_can_fold(sheet, pressed):
    both = {"up": [sheet.points * [1.0, 0.75, 1.0]], "sideways": [sheet.points * [0.75, 1.0, 1.0]]}
    alone = pressed(WaveFolds(families={"up": both["up"]}), (0.0, 0.2))[1]
    sim, frame = pressed(WaveFolds(families=both), (0.2, 0.2))
    assert set(np.unique(frame["family"])) >= {0, 1}
    assert np.ptp(frame["W"]) < 2.0 * np.ptp(alone["W"])
    for x in (-20.0, 0.0, 14.0):
        y, height = section(sim, frame, x)
        assert np.hypot(0.8 * np.diff(y), np.diff(height)).sum() <= np.ptp(y)


def test_folds_take_no_volume():
    """Many folds, which fade before the border of the sheet: it would cut through them."""
    sheet = fw.surface(pv.Plane(i_size=150, j_size=120, i_resolution=75, j_resolution=60).triangulate())
    x, y = np.abs(sheet.points[:, :2]).T
    amount = fw.geometry.smoothstep((70.0 - x) / 20.0) * fw.geometry.smoothstep((56.0 - y) / 20.0)
    layer = WaveFolds(families={"pressed": [sheet.points * [1.0, 0.75, 1.0]]}, amount=amount)
    sim = fw.Simulation(sheet, layers=[layer], motion=pressed_by(sheet, [PRESSED]), time_step=0.02)
    *_, frame = sim.run(6)
    bare = np.asarray(frame["rest"]) * [1.0, 0.75, 1.0]
    volumes = swept_volumes(bare, np.asarray(frame.points) - bare, sim.forest.triangles)
    assert np.abs(volumes).sum() > 500.0
    assert abs(volumes.sum()) < 0.01 * np.abs(volumes).sum()


def test_released_skin_is_bare_and_its_mesh_that_at_the_start(sheet, vertically, pressed):
    sim, frame = pressed(WaveFolds(families=vertically), PRESSED, *[(0.0, 0.0)] * 12)
    assert not frame["W"].any()
    assert frame.n_points == sheet.mesh.n_points
    assert (np.asarray(frame.points) == sheet.points).all()
    assert (sim.forest.triangles == sheet.triangles).all()


def test_the_same_moment_after_other_histories(sheet, vertically, pressed):
    n = len(sheet.points)
    histories = [[(0.0, 0.2)], [(0.0, 0.05), (0.2, 0.0), (0.0, 0.0), (0.0, 0.2)], [(0.0, 0.3), (0.0, 0.2)]]
    frames = [pressed(WaveFolds(families=vertically), *history)[1] for history in histories]
    for frame in frames[1:]:
        assert (frame["W"][:n] == frames[0]["W"][:n]).all()


# --- on the built-in head ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def field(face):
    return WaveField(face, fold_shapes(face, fw.Skin(face)), 1.0, Style())


def waves_of(face, field):
    """The waves at the base vertices."""
    return field.at(
        SurfacePoints.of_forest(
            fw.geometry.RedGreenForest(face.triangles),
            face.points,
            fw.geometry.vertex_normals(face.points, face.triangles),
        )
    )


def cosines(face, field, name):
    """Cosine of the phase times strength at the base vertices: independent of the sign of the direction."""
    waves = waves_of(face, field)
    own = waves.family == list(field.lines).index(name)
    out = np.zeros(len(face.points))
    out[np.repeat(np.arange(len(out)), np.diff(waves.starts))[own]] = (np.cos(waves.theta) * waves.window)[own]
    return out


def likeness(one, other):
    return float(one @ other / np.sqrt((one @ one) * (other @ other)))


def test_another_identity_keeps_its_lines_and_another_seed_is_another_person(face, field):
    other = fw.default_face({"jaw": 0.8, "width": 0.4, "lips": -0.5})
    kept = WaveField(other, fold_shapes(other, fw.Skin(other)), 1.0, Style())
    drawn = [WaveField(face, fold_shapes(face, fw.Skin(face)), 1.0, Style(seed=seed)) for seed in (1, 2)]
    same, *others = (
        likeness(cosines(face, field, "forehead"), cosines(face_of, lines, "forehead"))
        for face_of, lines in ((other, kept), *((face, lines) for lines in drawn))
    )
    assert same > 0.9999
    assert np.mean(np.abs(others)) < 0.5


def test_the_same_skin_turned_in_meters_and_on_other_triangles_has_the_same_lines(face, field):
    """Phases at the same places, wavelengths, and directions across the lines, which turn with it."""
    turned = Rotation.from_euler("yx", [70.0, 20.0], degrees=True).as_matrix()
    marks = {name: 0.001 * turned @ place for name, place in face.landmarks.items()}
    mesh = face.mesh.subdivide(1, "linear")
    mesh.points = 0.001 * mesh.points @ turned.T
    other = fw.fit_face(mesh, marks, units="m")
    lines = WaveField(other, fold_shapes(other, fw.Skin(other)), 1.0, Style())
    assert list(lines.lines) == list(field.lines)
    twins = cKDTree(other.points).query(0.001 * face.points @ turned.T)[1]
    for name in field.lines:
        assert likeness(cosines(face, field, name), cosines(other, lines, name)[twins]) > 0.999
    ours, theirs = waves_of(face, field), waves_of(other, lines)
    both = np.flatnonzero((np.diff(ours.starts) == 1) & (np.diff(theirs.starts)[twins] == 1))
    here, there = ours.starts[both], theirs.starts[twins[both]]
    assert len(both) > 300
    np.testing.assert_allclose(theirs.length[there], ours.length[here], rtol=0.05)
    across = np.abs(((ours.wave[here] @ turned.T) * theirs.wave[there]).sum(axis=1))
    sizes = np.linalg.norm(ours.wave[here], axis=1) * np.linalg.norm(theirs.wave[there], axis=1)
    assert np.quantile(across / sizes, 0.05) > 0.99


@pytest.mark.slow
def test_lines_that_are_found_on_other_triangles_are_the_same(face):
    other = fw.fit_face(face.mesh.decimate(0.2), face.landmarks, units="mm")
    gap, near = cKDTree(other.points).query(face.points)
    ours, theirs = (
        cosines(each, WaveField(each, FoldShapes({"pressed": [each.points_mm * [1.0, 0.8, 1.0]]})), "pressed")
        for each in (face, other)
    )
    assert likeness(ours[gap < 0.5], theirs[near[gap < 0.5]]) > 0.7


def test_left_and_right_are_drawn_each_for_itself(face):
    """Captured foreheads are alike by .3, for the skin that folds is; where lines lie is not."""
    twin = cKDTree(face.points).query(face.points * [-1.0, 1.0, 1.0])[1]
    wave = cosines(face, WaveField(face, fold_shapes(face, fw.Skin(face)), 1.0, Style()), "eyes")
    assert likeness(wave, wave[twin]) < 0.4


@pytest.mark.parametrize(
    "name", ["fear", *(pytest.param(name, marks=pytest.mark.slow) for name in ("anger", "disgust", "happiness"))]
)
def test_a_held_pose_changes_no_triangle_and_none_is_turned_over(face, name):
    sim = fw.Simulation(face, folds="wave")
    sim.express(name)
    for _ in sim.run(80, ramp=0.2):
        pass
    before = np.array(sim.forest.triangles)
    frames = []
    for frame in sim.run(12):
        assert np.array_equal(sim.forest.triangles, before)
        frames.append(frame)
    frame = frames[-1]
    assert np.ptp(frame["W"]) > 0.6
    points = sim.forest.weights @ (sim.motion.points + sim.motion.displacement)
    folded, smooth = (area_vectors(p, before) for p in (np.asarray(frame.points), points))
    assert ((folded * smooth).sum(axis=1) > 0.0).all()


def test_phases_are_of_the_material(face):
    sim = fw.Simulation(face, folds="wave")
    seen = []
    for name in ("paper_surprise", "anger"):
        sim.express(name)
        for _ in sim.run(6):
            pass
        waves = [sim.layers[-1].explained(vertex) for vertex in range(0, face.mesh.n_points, 20)]
        seen.append([sorted((wave["family"], wave["theta"]) for wave in here) for here in waves])
    assert seen[0] == seen[1]
    assert sum(map(len, seen[0])) > 50


def test_lines_of_raised_brows_end_at_the_hairline(face):
    """Within an edge of the mesh, over which the share that is left is interpolated."""
    sim = fw.Simulation(face, layers=[WaveFolds()])
    sim.express({"AU1": 1.0, "AU2": 1.0})
    frame = sim.settle()
    under_hair = fw.anatomy.hair_cover(np.asarray(frame["rest"]), face.landmarks, face.frame) > 5.0
    height = np.abs(np.asarray(frame["W"]))
    assert height[under_hair].max() < 0.1 * height.max()


def test_age_furrows_the_face_at_rest_and_stretch_smooths_it(vertically, pressed):
    assert not pressed(WaveFolds(families=vertically, age=0.0), (0.0, 0.0))[1]["W"].any()
    old, stretched = (pressed(WaveFolds(families=vertically, age=1.0), (0.0, -s))[1] for s in (0.0, 0.2))
    assert old["W"].min() < -0.1
    assert not stretched["W"].any()


# --- what is asked for -------------------------------------------------------------------------------


def test_none_here_and_more_there(sheet, vertically, pressed):
    left = sheet.points[:, 0] < 0.0
    everywhere, some = (
        pressed(WaveFolds(families=vertically, amount=amount), PRESSED)[1]
        for amount in (None, np.where(left, 0.0, 1.0))
    )
    assert not some["W"][np.asarray(some["rest"])[:, 0] < -3.0].any()
    n = len(sheet.points)
    right = sheet.points[:, 0] > 3.0
    kept, whole = some["W"][:n][right], everywhere["W"][:n][right]
    for side in (whole > 1e-6, whole < -1e-6):  # the same, but for the common share that keeps the volume
        share = kept[side] / whole[side]
        np.testing.assert_allclose(share, share[0], rtol=1e-12)
        assert 0.8 <= share[0] <= 1.25


def test_more_lines_where_they_are_denser(vertically, pressed):
    lines = []
    for density in (0.7, 1.4):
        sim, frame = pressed(WaveFolds(families=vertically, density=density, **EVEN), PRESSED, level=4)
        height = section(sim, frame, 0.0)[1]
        lines.append((np.diff(np.sign(height)) != 0).sum())
    assert lines[1] == pytest.approx(2.0 * lines[0], rel=0.35)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"seed": 1.5}, r"seed must be a whole number, received 1.5"),
        ({"seed": -1}, r"seed must lie in \[0"),
        ({"age": 1.5}, r"age must lie in \[0, 1\], received 1.5"),
        ({"density": 0.0}, r"density must lie in \[0.25, 4\], received 0. 1 is as on people"),
        ({"depth": float("nan")}, r"depth must lie in"),
        ({"length": 3.0}, r"length must lie in \[0.5, 2\], received 3. 1 is as on people"),
        ({"irregularity": "much"}, r"irregularity must be a number, received 'much'"),
        ({"families": ["AU1"]}, r"families must be a dictionary"),
    ],
)
def test_bad_settings(options, message):
    with pytest.raises(ParameterError, match=message):
        WaveFolds(**options)


def simulated(face, **options):
    return fw.Simulation(face, layers=[WaveFolds(**options)])


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda face, sheet: simulated(face, amount=np.ones(3)), ParameterError, r"each of the \d+ vertices .* \(3,\)"),
        (
            lambda face, sheet: simulated(face, amount={"forehed_mid": 0.0}),
            UnknownNameError,
            r"unknown landmark or region of folds 'forehed_mid'. Did you mean 'forehead_mid'",
        ),
        (
            lambda face, sheet: simulated(face, amount={"glabella": -1.0}),
            ParameterError,
            r"amount of folds at glabella must lie in \[0, 10\], received -1",
        ),
        (
            lambda face, sheet: simulated(sheet, families={"still": [sheet.points]}),
            ParameterError,
            r"motions of the family 'still' compress the skin by less than 3%",
        ),
        (
            lambda face, sheet: simulated(face, families={"brows": [np.eye(3)]}),
            ParameterError,
            r"'brows' must be .* received an array of the shape \(3, 3\)",
        ),
        (
            lambda face, sheet: simulated(face, families={"brows": ["AU999"]}),
            UnknownNameError,
            r"unknown expression, action unit or muscle 'AU999'",
        ),
        (
            lambda face, sheet: simulated(face, families={"brows": "AU1"}),
            ParameterError,
            r"the family 'brows' must be a list of motions, received str",
        ),
        (
            lambda face, sheet: simulated(face, families={"brows": []}),
            ParameterError,
            r"the family 'brows' has no motions",
        ),
        (
            lambda face, sheet: simulated(sheet),
            ParameterError,
            r"neither. Fit a face with landmarks, or give a recording",
        ),
        (
            lambda face, sheet: WaveFolds().attach(sheet),
            ParameterError,
            r"has none. Give it to a Simulation of a face with muscles",
        ),
    ],
)
def test_what_cannot_be_found_is_refused(face, sheet, call, error, message):
    with pytest.raises(error, match=message):
        call(face, sheet)


def test_shapes_of_another_mesh_are_refused(sheet):
    layer = WaveFolds()
    layer.shapes = FoldShapes({"all": [np.zeros((4, 3))]})
    with pytest.raises(ParameterError, match=r"a motion of the family 'all' must be positions of .* shape \(4, 3\)"):
        fw.Simulation(sheet, layers=[layer])


@pytest.mark.parametrize("length, depth", [(12.0, 1.0), (25.0, 1.3), (6.0, 0.5)])
def test_edges_of_the_spacing_asked_for_are_off_by_the_tolerance(length, depth):
    edge = spacing_for(length, depth) / fw.Refinement().samples
    assert edge > NARROWEST * length / 4.0, "the depth decides"
    start, along = np.linspace(-length, 0.0, 500)[:, None], np.linspace(0.0, 1.0, 101)
    wave = [0.5 * depth * np.cos(2.0 * np.pi / length * (start + edge * share)) for share in (0.0, 1.0, along)]
    error = np.abs(wave[2] - (1.0 - along) * wave[0] - along * wave[1]).max()
    assert error == pytest.approx(0.5 * depth * (1.0 - np.cos(np.pi * edge / length)), rel=1e-3)
    assert 0.9 * TOLERANCE < error <= TOLERANCE


def nearest(face, *names):
    return [np.linalg.norm(face.points - face.landmarks[name], axis=1).argmin() for name in names]


def test_landmarks_and_regions_take_amounts(face):
    amount = {"glabella": 0.0, fw.Region(face.landmarks["forehead_mid"], size=(80, 30)): 3.0}
    assert amounts(amount, face)[nearest(face, "glabella", "forehead_mid")] == pytest.approx([0.0, 3.0], abs=0.05)


@pytest.mark.parametrize("region", REGIONS)
def test_a_region_lies_around_its_landmarks(face, region):
    found = amounts({region: 3.0}, face)
    assert found[nearest(face, *REGIONS[region])] == pytest.approx(3.0, abs=0.2)
    away = [np.linalg.norm(face.points - face.landmarks[name], axis=1) for name in REGIONS[region]]
    assert (found[np.min(away, axis=0) > 0.4 * face.frame.pupil_distance] == 1.0).all()
    assert found.max() <= 3.0 + 1e-12, "where landmarks are near each other, too"


def test_sides_blend_in_the_middle_and_both_make_one_factor(face):
    x = face.points[:, 0]
    one, both = amounts({"left": 3.0}, face), amounts({"left": 0.5, "right": 0.5}, face)
    assert (one[x > 15.0] == 3.0).all()
    assert (one[x < -15.0] == 1.0).all()
    assert one[np.abs(x).argmin()] == pytest.approx(2.0, abs=0.05)
    assert (both == 0.5).all()
    together = amounts({"left": 3.0, "right": 0.0, "chin": 2.0}, face)
    np.testing.assert_allclose(together, amounts({"left": 3.0, "right": 0.0}, face) * amounts({"chin": 2.0}, face))


def test_an_unknown_place_is_refused(face):
    with pytest.raises(UnknownNameError, match="unknown landmark or region of folds 'chinn'. Did you mean 'chin'"):
        amounts({"chinn": 2.0}, face)
