"""Regions: coordinates on a surface, windows, selections, valid vertices.

what              checked against
coordinates       a sphere in closed form, refined as well; mirrored and bent against plain ones
window            1 inside, 0 outside, monotone; its slope at both ends by differences, also on a mesh
selections        bools, painted weights and names of one another
valid vertices    their number; their evenness; the same draw before and after refinement
errors            each says what is wrong
"""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.errors import MeshError, ParameterError, UnknownNameError
from facewrinkle.layers.base import SurfacePoints
from facewrinkle.layers.patterns_on_skin.region import Region, outline_norm, valid_vertices

RADIUS = 40.0


def vertices_of(face, levels=0):
    """The vertices of a face refined all over."""
    forest = fw.geometry.RedGreenForest(face.triangles, n_points=len(face.points))
    for _ in range(levels):
        forest.split(np.ones(len(forest.triangles), bool))
    return SurfacePoints.of_forest(forest, face.points, fw.geometry.vertex_normals(face.points, face.triangles))


@pytest.fixture(scope="module")
def ball():
    sphere = pv.Icosphere(radius=RADIUS, nsub=4)
    sphere["stripe"] = (sphere.points[:, 1] > 10.0).astype(float)
    return fw.surface(sphere)


def test_coordinates_on_a_sphere(ball):
    laid = Region((0, 0, RADIUS), size=(40.0, 30.0)).laid(ball)
    for levels in (0, 1):
        vertices = vertices_of(ball, levels)
        where, uv, slopes, window = laid.at(vertices)
        x = vertices.points[where] / np.linalg.norm(vertices.points[where], axis=1, keepdims=True)
        arc = RADIUS * np.arccos(x[:, 2])
        expected = arc[:, None] * x[:, :2] / np.linalg.norm(x[:, :2], axis=1, keepdims=True).clip(1e-12) / [20.0, 15.0]
        assert np.abs(uv - expected).max() < 0.02
        assert len(where) == (outline_norm(expected, "ellipse") < 1.0).sum() or levels
        assert ((window > 0.0) & (window <= 1.0)).all()
        # The gradients point along the surface, with the lengths of the sphere's metric to a few per cent.
        assert np.abs(np.einsum("kxd,kx->kd", slopes, x)).max() < 0.1 / 15.0
        np.testing.assert_allclose(
            np.linalg.norm(slopes, axis=1), np.tile([1 / 20, 1 / 15], (len(where), 1)), rtol=0.12
        )


def test_mirrored_and_bent(ball):
    plain = Region((0, 0, RADIUS), size=40.0).laid(ball)
    mirrored = Region((0, 0, RADIUS), size=40.0, mirrored=True).laid(ball)
    bent = Region((0, 0, RADIUS), size=40.0, bow=0.5).laid(ball)
    both = plain.known & bent.known
    np.testing.assert_allclose(mirrored.chart[both], plain.chart[both] * [-1, 1], atol=1e-12)
    np.testing.assert_allclose(bent.chart[both, 1], plain.chart[both, 1] - 0.5 * plain.chart[both, 0] ** 2, atol=1e-12)


@pytest.mark.parametrize("outline", ["ellipse", "box"])
@pytest.mark.parametrize("border", [0.2, 0.6, 1.0])
def test_windows_are_smooth_to_the_border(ball, outline, border):
    laid = Region((0, 0, RADIUS), size=40.0, outline=outline, border=border).laid(ball)
    for angle in (0.0, 0.4, np.pi / 4):
        direction = np.array([np.cos(angle), np.sin(angle)])
        s = np.linspace(0.0, 1.2, 24001) / outline_norm(direction[None], outline)[0]
        window = laid.window(s[:, None] * direction)
        away = outline_norm(s[:, None] * direction, outline)
        assert (window[away >= 1.0] == 0.0).all()
        assert (window[away <= 1.0 - border - 1e-12] == 1.0).all()
        assert (np.diff(window) <= 1e-15).all()
        slope = np.diff(window) / np.diff(s)
        assert np.abs(np.diff(slope)).max() < 40 * np.diff(s)[0] / border**2 * 1.5  # no jump: C1
        assert abs(slope[np.argmin(np.abs(away - 1.0))]) < 0.05


def test_selections_in_every_form(ball):
    mask = ball.points[:, 1] > 10.0
    chosen = Region(select=mask, up=(0, 0, 1)).laid(ball)
    assert (chosen.base_window[~mask] == 0.0).all()
    inner = chosen.weight == 1.0
    assert inner.any()
    assert ball.points[inner, 1].min() > 12.0
    painted = Region(select="stripe", up=(0, 0, 1)).laid(ball)
    np.testing.assert_array_equal(painted.base_window, mask.astype(float))
    assert np.abs(chosen.chart[mask]).max() == pytest.approx(1.0)


def test_valid_vertices_are_as_many_as_asked_and_even(ball):
    laid = Region((0, 0, RADIUS), size=60.0, valid_share=0.3, seed=4).laid(ball)
    inside = laid.known & (outline_norm(laid.chart, "ellipse") < 1.0)
    assert laid.valid.sum() == round(0.3 * inside.sum())
    assert not laid.valid[~inside].any()
    for quarter in ([1, 1], [1, -1], [-1, 1], [-1, -1]):
        here = inside & (laid.chart * quarter > 0.0).all(axis=1)
        assert abs(laid.valid[here].mean() - 0.3) < 0.08
    again = Region((0, 0, RADIUS), size=60.0, valid_share=0.3, seed=4).laid(ball)
    other = Region((0, 0, RADIUS), size=60.0, valid_share=0.3, seed=5).laid(ball)
    np.testing.assert_array_equal(laid.valid, again.valid)
    assert (laid.valid != other.valid).any()
    # More even than independent draws: the counts in the cells of a grid vary less.
    uv = np.random.default_rng(0).uniform(-1, 1, (4000, 2))
    cell = (np.floor((uv + 1) * 4).astype(int) * [8, 1]).sum(axis=1)
    drawn = np.bincount(cell, valid_vertices(uv, np.ones(4000, bool), 0.25, 1), 64)
    independent = np.bincount(cell, np.random.default_rng(1).random(4000) < 0.25, 64)
    share = np.bincount(cell, minlength=64) * 0.25
    assert (drawn - share).var() < 0.5 * (independent - share).var()


def test_valid_vertices_stay_under_refinement(ball):
    layer = fw.PatternLayer("cheek", (0, 0, RADIUS), size=50.0, valid_share=0.5, seed=2)
    with pytest.warns(fw.FaceWrinkleWarning, match="too coarse"):
        first = np.array(
            fw.Simulation(ball, fw.Refinement(max_level=0), layers=[layer], motion=fw.Still(ball)).step()["W"]
        )
    sim, n = fw.Simulation(ball, fw.Refinement(max_level=2), layers=[layer], motion=fw.Still(ball)), len(ball.points)
    frame = sim.step()
    assert len(first) == n < frame.n_points
    np.testing.assert_array_equal(np.asarray(frame["W"])[:n], first)
    laid = sim.layers[0].laid(ball)
    off = laid.known & (laid.valid == 0.0)
    assert (first[off] == 0.0).all()
    assert (first[laid.valid > 0.0] != 0.0).any()


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda: Region(size=1.0), ParameterError, "needs a center, or a selection"),
        (lambda: Region((0, 0, np.nan), size=1.0), ParameterError, "center must be three finite"),
        (lambda: Region((0, 0), size=1.0), ParameterError, "center must be three finite"),
        (lambda: Region((0, 0, 0), size=-1.0), ParameterError, "size"),
        (lambda: Region((0, 0, 0), size=np.nan), ParameterError, "size"),
        (lambda: Region((0, 0, 0), size=(1, 2, 3)), ParameterError, "width and height"),
        (lambda: Region((0, 0, 0), (0, 0, 0), 1.0), ParameterError, "three zeros"),
        (lambda: Region((0, 0, 0), size=1.0, border=0.0), ParameterError, "border"),
        (lambda: Region((0, 0, 0), size=1.0, valid_share=0.0), ParameterError, "valid"),
        (lambda: Region((0, 0, 0), size=1.0, outline="elipse"), UnknownNameError, "'ellipse'"),
    ],
)
def test_errors_of_parameters(make, error, says):
    with pytest.raises(error, match=says):
        make()


@pytest.mark.parametrize(
    ("region", "error", "says"),
    [
        (Region((0, 0, 99.0), size=10.0), ParameterError, "off the mesh.*59 away"),
        (Region((0, 0, RADIUS), size=200.0), ParameterError, "larger than the mesh.*unit of the mesh"),
        (Region((0, 0, RADIUS), (0, 0, 1), 10.0), ParameterError, "straight out of the surface"),
        (Region(select=np.zeros(2562)), MeshError, "no vertex"),
        (Region(select=[3, 7]), MeshError, r"weight for each of the 2562 points of the mesh, .*int64 of \(2,\)"),
        (Region(select=np.array([0.5, 0.5])), MeshError, "store it as point data"),
        (Region(select="strip"), UnknownNameError, "'stripe'"),
    ],
)
def test_errors_on_a_surface(ball, region, error, says):
    with pytest.raises(error, match=says):
        region.laid(ball)


@pytest.mark.parametrize("wrong", [2.0, -0.1, np.nan])
def test_weights_must_lie_between_0_and_1(ball, wrong):
    weights = np.ones(len(ball.points))
    weights[3] = wrong
    with pytest.raises(MeshError, match=r"weights in \[0, 1\]"):
        Region(select=weights, up=(0, 1, 0)).laid(ball)
