"""Errors: refused in Python and on a mesh (the accessor).

Each message says what is wrong, what is allowed, what was received, and what to do.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
import facewrinkle.accessor
from facewrinkle.errors import FaceWrinkleError, LandmarkError, ParameterError, UnknownNameError
from facewrinkle.layers.patterns_on_skin.kinds import Cheek, pattern_of
from facewrinkle.layers.patterns_on_skin.wrinkles import Pattern

TOP = (0.0, 0.0, 40.0)


@pytest.fixture(scope="module")
def ball():
    return pv.Icosphere(radius=40.0, nsub=4)


@pytest.fixture(scope="module")
def sheet():
    return pv.Plane(i_size=100, j_size=60, i_resolution=20, j_resolution=12)


def simulated(mesh, pattern, **words):
    return fw.Simulation(mesh, layers=[fw.PatternLayer(pattern, **words)]).step()


def accessed(mesh, pattern, **words):
    return mesh.facewrinkle.pattern(pattern, **words)


EVERYWHERE = {
    "on no vertex": (
        "dimple",
        {"center": TOP, "size": 5.0, "valid_share": 0.01},
        "dimple lies on no vertex of the mesh: its region and valid_share leave none of the",
    ),
    "off the mesh": (
        "dimple",
        {"center": (0, 0, 90), "size": 9.0},
        r"lies off the mesh: .*\[0, 0, 90\] is 50 away.*\[0",
    ),
    "larger": (
        "dimple",
        {"center": TOP, "size": 900.0},
        "larger than the mesh: 900 wide and 900 high.*smaller",
    ),
    "endless": ("dimple", {"center": TOP, "size": np.inf}, "size must be finite"),
    "no place": ("dimple", {"size": 9.0}, "needs a center"),
    "size 0": ("dimple", {"center": TOP, "size": 0.0}, "size must be a length.* greater than 0, received 0"),
    "size in words": (
        "dimple",
        {"center": TOP, "size": "9"},
        "size must be numbers.* received a str",
    ),
    "a center that is nan": ("dimple", {"center": (0, 0, np.nan), "size": 9.0}, "center must be three finite"),
    "no center": ("dimple", {"center": "top", "size": 9.0}, "center must be three finite numbers, received 'top'"),
    "up out of it": (
        "dimple",
        {"center": TOP, "up": (0, 0, 1), "size": 9.0},
        "straight out of the surface.*another up",
    ),
    "radius": ("eye_corner", {"center": TOP, "size": 30.0, "radius": -0.5}, r"radius must lie in \[0, .*received -0.5"),
    "broken bumps": ("eye_pouch", {"center": TOP, "size": 30.0, "gamma": 2.5}, "gamma must be a whole number.*2.5"),
    "t that is nan": ("cheek", {"center": TOP, "size": 30.0, "t": np.nan}, "t must lie in .*received nan"),
    "t that is a word": ("cheek", {"center": TOP, "size": 30.0, "t": "1"}, "t must be a number, received '1'"),
    "t of a fan": (
        "frown",
        {"center": TOP, "size": 30.0, "t": 0.5},
        r"y \+ t must be above 0 .* received -0.* larger t",
    ),
    "t of a dimple": ("dimple", {"center": TOP, "size": 30.0, "t": 0.0}, "t of dimple follows .* give a strength"),
    "t of an eye": ("eye_corner", {"center": TOP, "size": 30.0, "t": 9.0}, "t of eye_corner follows .*received t=9.0"),
    "t of a function": (
        "cheek",
        {"center": TOP, "size": 30.0, "t": lambda seconds: np.inf},
        "the t of cheek at .* s must lie in .*received inf",
    ),
    "strength": (
        "cheek",
        {"center": TOP, "size": 30.0, "strength": 1.5},
        r"strength must lie in \[0, 1\], received 1.5",
    ),
    "strength of a function": (
        "cheek",
        {"center": TOP, "size": 30.0, "strength": lambda seconds: -1.0},
        r"the strength of cheek at .* s must lie in \[0, 1\], received -1",
    ),
    "variation": ("cheek", {"center": TOP, "size": 30.0, "variation": 2.0}, r"variation must lie in \[0, 1\].* even"),
    "spacing": ("cheek", {"center": TOP, "size": 30.0, "spacing": 0.0}, "spacing must be .* greater than 0.* mm"),
    "what is misspelt": ("dimpel", {"center": TOP, "size": 9.0}, "'dimple'"),
    "what is no pattern": (None, {"center": TOP, "size": 30.0}, "unknown pattern None. Known are: forehead"),
    "a parameter of another": (
        "dimple",
        {"center": TOP, "size": 30.0, "moving": True},
        "unknown parameter of Dimple 'moving'",
    ),
}


@pytest.mark.parametrize("way", [simulated, accessed])
@pytest.mark.parametrize(("pattern", "words", "says"), EVERYWHERE.values(), ids=EVERYWHERE)
def test_errors_in_python_and_of_the_accessor(ball, way, pattern, words, says):
    before = np.array(ball.points)
    with pytest.raises(FaceWrinkleError, match=says):
        way(ball, pattern, **words)
    np.testing.assert_array_equal(ball.points, before)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda f, b: fw.PatternLayer.preset("frown", f, size="big"), ParameterError, "size must be numbers"),
        (
            lambda f, b: fw.PatternLayer.preset("frown", f, size=(1.0, -1.0)),
            ParameterError,
            "greater than 0, received .1.0, -1.0.",
        ),
        (
            lambda f, b: fw.PatternLayer.preset("frown", f, strength="skn"),
            UnknownNameError,
            "strength 'skn'. Did you mean 'skin'",
        ),
        (lambda f, b: fw.PatternLayer.preset("frown", f, seed=-1), ParameterError, "seed must lie in"),
        (lambda f, b: fw.PatternLayer.preset("frwn", f), UnknownNameError, "'frown'"),
        (
            lambda f, b: fw.PatternLayer.preset("frown", b),
            ParameterError,
            "placed on a Face, received PolyData. Use fit_face",
        ),
        (lambda f, b: fw.PatternLayer.preset("frown", fw.surface(b)), LandmarkError, "this surface has none"),
        (
            lambda f, b: fw.PatternLayer("cheek", TOP, size=9.0, strength="skin"),
            ParameterError,
            "function.*Compression",
        ),
        (lambda f, b: fw.PatternLayer("cheek", region=3), ParameterError, "must be a Region, received 3"),
        (lambda f, b: fw.PatternLayer("forhead", TOP, size=1.0), UnknownNameError, "'forehead'"),
        (lambda f, b: fw.PatternLayer("cheek", TOP, size=1.0, numbr=3), UnknownNameError, "'number'"),
        (lambda f, b: fw.PatternLayer("forehead", TOP, size=1.0, style="arc"), UnknownNameError, "'arcs'"),
        (lambda f, b: fw.PatternLayer([], TOP, size=1.0), ParameterError, "received none"),
        (lambda f, b: pattern_of(Cheek(), {"number": 3}), ParameterError, "no more parameters"),
        (lambda f, b: fw.Compression(along=(0, 0, 0)), ParameterError, "along must be a direction"),
        (lambda f, b: fw.Compression(along="up"), ParameterError, "along must be three finite numbers"),
        (
            lambda f, b: b.facewrinkle.pattern("cheek", TOP, size=9.0, begin=1.0),
            ParameterError,
            "time to evaluate.*`time`",
        ),
        (lambda f, b: b.facewrinkle.pattern("dimple", TOP, size=9.0, time=np.nan), ParameterError, "time"),
        (lambda f, b: b.facewrinkle.pattern("dimple_l"), ParameterError, "placed by landmarks: give those"),
        (lambda f, b: b.facewrinkle.pattern("cheek", TOP, size=9.0, strength="skin"), ParameterError, "keeps still"),
        (lambda f, b: fw.PatternLayer("cheek", select="paint").laid(fw.surface(b)), UnknownNameError, "none here"),
    ],
)
def test_errors_of_one_way(face, ball, call, error, says):
    with pytest.raises(error, match=says):
        call(face, ball)


def test_a_region_beyond_all_borders_of_a_sheet(sheet):
    """Its width and height are both larger; a region that hangs over on two sides is only cut."""
    face = fw.surface(sheet)
    with pytest.raises(
        ParameterError, match=r"larger than the mesh: 105 wide and 70 high.* 100 wide and 60 high.*smaller"
    ):
        fw.PatternLayer("dimple", (0, 0, 0), size=(105.0, 70.0)).laid(face)
    laid = fw.PatternLayer("dimple", (0, 0, 0), size=(90.0, 70.0)).laid(face)
    assert laid.base_window[laid.known].max() == 1.0


def test_a_mesh_that_is_much_too_coarse(ball):
    words = {"center": TOP, "size": 20.0, "number": 30}
    says = "split 6 times, and max_level=1 is allowed. Ask for max_level=6, for fewer wrinkles, for a larger region"
    with pytest.raises(ParameterError, match=says):
        fw.Simulation(fw.surface(ball), fw.Refinement(max_level=1), layers=[fw.PatternLayer("cheek", **words)])
    with pytest.raises(ParameterError, match=says):
        ball.facewrinkle.pattern("cheek", max_level=1, **words)


@dataclass(frozen=True, kw_only=True)
class Level(Pattern):
    """The same height everywhere, with the wave vector 0 on a share of the region."""

    share: float = 1.0

    def relief(self, x, y, strength, t, aspect):
        return np.full_like(x, strength)

    def wave_vector(self, x, y, t, aspect):
        return np.where(np.arange(len(x)) < self.share * len(x), 0.0, 6.0), np.zeros_like(y)


@pytest.mark.parametrize("share", [0.9, 1.0])
def test_a_pattern_without_a_wavelength(ball, share):
    face = fw.surface(ball)
    if share < 1.0:
        assert fw.PatternLayer(Level(share=share), TOP, size=30.0, depth=1.0).level_needed(face) == 0
    else:
        with pytest.raises(ParameterError, match="the wave vectors of the pattern Level are 0 everywhere"):
            fw.Simulation(face, layers=[fw.PatternLayer(Level(), TOP, size=30.0, depth=1.0)])


def test_both_sides_take_what_one_takes(face):
    left, right = fw.PatternLayer.presets("dimple", face, depth=0.7, name="mine")
    assert (left.name, right.name, left.depth, right.depth) == ("mine", "mine", 0.7, 0.7)
