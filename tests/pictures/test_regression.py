"""Pictures compared with baselines: expressions, fields, patterns and tears, without text.

``make pictures`` draws the baselines anew. Before they are committed, somebody has to look at what changed:
``git diff`` shows the files, and ``output/pictures`` what failed, next to its baseline. A baseline is right only if it
was seen.

Mesa's software renderer draws the same pixels in every run. A graphics card draws others: there the comparisons with
baselines are skipped, and tests that need none still run. ``-m "not pictures"`` leaves all of them out.
"""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from PIL import Image
from pytest_pyvista.pytest_pyvista import RegressionError
from real_faces import built_in

import facewrinkle as fw
from facewrinkle.plotting import Scene, Style, TearScene, View
from facewrinkle.simulation.fold_layers import fold_layers
from facewrinkle.tears.presets import preset, surfaces

pytestmark = [
    pytest.mark.pictures,
    pytest.mark.filterwarnings("default:.*Exceeded image regression warning"),
    pytest.mark.filterwarnings("ignore:.*bad X server"),
]

BASELINES = Path(__file__).parent / "baselines"
SIDE = 400
DEPTH = 2.0
"""How deep folds are: those of the young are too faint for what is measured here."""

ERROR, WARNING = 5.0, 1.0
"""VTK's thresholded error. The same picture scores 0; wrinkles that are 2.5 % higher score more than ERROR."""

EXPRESSIONS = {
    "paper_surprise": "forehead",
    "frowning": "glabella",
    "closing_eye": "left_eye",
    "stretching_mouth": "right_mouth",
    "paper_fear": "glabella",
    "happiness": "left_eye",
    "disgust": "nose",
    "sadness": "glabella",
    "pain": "right_eye",
    "wink": "left_eye",
}
PATTERNS = {
    "forehead": "forehead",
    "eye_corner": "left_eye",
    "cheek": "left_mouth",
    "frown": "glabella",
    "dimple": View((0.55, 0.0, 1.0), "mouth_l", (0.26, 0.04, -0.1), 0.9),
    "eye_pouch": "left_eye",
}
WRINKLES = [("expression", *item) for item in EXPRESSIONS.items()] + [("pattern", *item) for item in PATTERNS.items()]
QUICK = ("paper_surprise", "happiness", "dimple", "hanging", "running")
"""Names of wrinkles and tears that are drawn also where slow tests are left out."""
LOOKS = {
    "rest": (None, "front"),
    "happiness": ("happiness", "left_three_quarter"),
    "happiness_eye": ("happiness", "right_eye"),
}
FIELDS = ("W", "epsilon", "lambda", "gamma", "split_gamma", "muscle", "level")
CHEEKS = View((0.25, 0.02, 1.0), "nose_tip", (0.0, -0.05, -0.4), 2.5)
TEARS = {
    "hanging": ("dripping", 0.75),
    "falling": ("dripping", 0.96),
    "running": ("shedding", 1.0),
    "arrived": ("weeping", 3.2),
}


@pytest.fixture(scope="module")
def compared(request):
    """Skip where pixels mean nothing."""
    renderer = pv.GPUInfo().renderer
    if "llvmpipe" not in renderer:
        pytest.skip(f"the baselines are those of Mesa's llvmpipe; {renderer} draws other pixels")


@pytest.fixture
def verify(compared, verify_image_cache, pytestconfig):
    """Compare what a plotter shows with a baseline, or make that."""

    def verify(plotter, name):
        assert tuple(plotter.window_size) == (SIDE, SIDE)
        verify_image_cache.test_name = name
        verify_image_cache.error_value, verify_image_cache.warning_value = ERROR, WARNING
        try:
            verify_image_cache(plotter)
        except RegressionError as problem:
            pytest.fail(
                f"{problem}. Both are in output/pictures. If this was meant: `make pictures`, and look at them."
            )
        if pytestconfig.getoption("reset_image_cache"):
            file = BASELINES / f"{name}.png"
            with Image.open(file) as image:
                pixels = image.convert("RGB")
            pixels.save(file, optimize=True)

    return verify


@pytest.fixture(scope="module", autouse=True)
def _forget():
    yield
    frame.cache_clear()


@lru_cache(maxsize=4)
def frame(kind, name, factor=1.0):
    """A frame with an expression held, with folds as waves or the papers', or a pattern; heights times a factor."""
    face = built_in()
    if kind == "pattern":
        simulation = fw.Simulation(face, layers=fw.PatternLayer.presets(name, face), motion=fw.Still(face))
    else:
        waves = None if kind == "paper" else fold_layers(face, "wave", depth=DEPTH)
        simulation = fw.Simulation(face, layers=waves, folds="wave" if waves else "paper")
    for layer in simulation.layers:
        layer.displacement = lambda state, of=layer.displacement: replace(d := of(state), height=factor * d.height)
    if kind != "pattern" and name is not None:
        simulation.express(name)
    *_, last = simulation.run(5 if kind == "pattern" else 15)
    return last


def plaster(mesh, view):
    """A plotter with the mesh in white plaster under three raking lamps, red, green and blue: slopes become colors.

    Under the lights of the studio, 2.5 % are too little for a byte to tell. Nothing but shape is seen here: eyes, brows
    and the color of the skin can change and leave these pictures as they are.
    """
    with Scene(built_in(), Style((SIDE, SIDE), view, quick=True)) as aimed:
        camera = aimed.plotter.camera.copy()
    plotter = pv.Plotter(off_screen=True, window_size=(SIDE, SIDE), lighting="none")
    plotter.camera = camera
    plotter.add_mesh(
        mesh, color="white", ambient=0.0, diffuse=1.0, specular=0.0, smooth_shading=True, show_scalar_bar=False,
        reset_camera=False,
    )  # fmt: skip
    focus, towards = np.array(camera.focal_point), np.subtract(camera.position, camera.focal_point)
    distance = np.linalg.norm(towards)
    right = np.cross(camera.up, towards)
    right *= distance / np.linalg.norm(right)
    up = np.cross(towards, right) / distance
    tilt = np.radians(80.0)
    for turn, color in zip(np.radians([90.0, 210.0, 330.0]), np.eye(3), strict=True):
        place = np.sin(tilt) * (np.cos(turn) * right + np.sin(turn) * up) + np.cos(tilt) * towards
        lamp = pv.Light(position=focus + place, focal_point=focus, color=color.tolist(), intensity=3.0)
        plotter.add_light(lamp)
    plotter.render()
    return plotter


def style(view, **options):
    """Half the size: scenes draw twice that, to reduce it, and here it is taken as drawn."""
    return Style((SIDE // 2, SIDE // 2), view, **options)


@pytest.mark.parametrize(
    "kind, name, view",
    [pytest.param(*each, marks=[] if each[1] in QUICK else pytest.mark.slow) for each in WRINKLES],
    ids=lambda value: value if isinstance(value, str) else "close",
)
def test_wrinkles_and_a_change_of_a_fortieth_in_height(kind, name, view, verify):
    """They are those of the baseline, and so much change is an error."""
    plotters = [plaster(frame(kind, name, factor), view) for factor in (1.0, 1.025)]
    try:
        verify(plotters[0], f"{kind}_{name}")
        assert pv.compare_images(*plotters) > ERROR
    finally:
        for plotter in plotters:
            plotter.close()


@pytest.mark.parametrize("name", ["rest", "happiness", pytest.param("happiness_eye", marks=pytest.mark.slow)])
def test_looks(name, verify):
    expression, view = LOOKS[name]
    with Scene(built_in(), style(view)) as scene:
        scene.draw(frame("expression", expression))
        verify(scene.plotter, f"looks_{name}")


@pytest.mark.parametrize(
    "name",
    [name if name in ("W", "gamma", "muscle") else pytest.param(name, marks=pytest.mark.slow) for name in FIELDS],
)
def test_fields(name, verify):
    with Scene(built_in(), style("forehead", scalars=name)) as scene:
        scene.show(frame("paper", "paper_surprise"))
        for bar in list(scene.plotter.scalar_bars.keys()):  # text depends on the fonts of a machine
            scene.plotter.remove_scalar_bar(bar, render=False)
        scene.plotter.render()
        verify(scene.plotter, f"field_{name}")


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in TEARS]
)
def test_tears(name, verify):
    of, time = TEARS[name]
    face = built_in()
    with TearScene(face, style(CHEEKS)) as scene:
        scene.draw(face.mesh, surfaces(preset(of, face), time))
        verify(scene.plotter, f"tears_{name}")


@pytest.mark.slow
def test_the_same_again_is_the_same_picture():
    def pixels():
        frame.cache_clear()
        plotter = plaster(frame("expression", "frowning"), "glabella")
        try:
            return plotter.screenshot(None, return_img=True)
        finally:
            plotter.close()

    np.testing.assert_array_equal(pixels(), pixels())


def test_every_baseline_is_compared_and_small():
    names = {f"{kind}_{name}" for kind, name, _ in WRINKLES} | {f"looks_{name}" for name in LOOKS}
    names |= {f"field_{name}" for name in FIELDS} | {f"tears_{name}" for name in TEARS}
    files = list(BASELINES.glob("*.png"))
    assert len(names) <= 40
    assert {file.stem for file in files} == names
    assert sum(file.stat().st_size for file in files) < 3.2e6
