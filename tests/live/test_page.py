"""The page in a real browser without a window; skipped where there is none.

sliders by keyboard and by number | the document of the studio, and the pixels
search, lock, undo, reset         | the same
parameters of a person            | each has a slider
what is not 0                     | counted, and in another slider, which does the same
small screens                     | nothing lies outside, and the face is seen beside what is open
picks                             | VTK's ray through the same pixel
patterns and tears by a click     | the document
pictures of parts beside the skin  | those of `Scene`
the outline, and the skin          | that of pictures; its rims are those of the frame
the picture, and long hair         | those of `Scene` with the same camera
shares of the key light            | those of `Lamp`
names of controls                 | every one has one
colors, dark and light            | the contrast of WCAG
eyes, landmarks, rings, muscles    | dragged: the document
fibers and sliders                 | each is seen while the other is pointed at, or has the focus
probes, by pointer and by keyboard | their places in the document, and the numbers of the frame there
a state that is kept               | left of the curtain the picture before, right of it that of now
captures                           | side by side in one picture, as they were shown
a double click on a slider         | its usual value, which has a tick
the list of all controls           | finds sliders, buttons and expressions that were kept
ranges of fields                   | the pixels; the number under the pointer is that of the frame
a mesh that is dropped            | its face is shown, and undone
a lost connection, a new server   | the page goes on, or says what to do
"""

import base64
import io
import itertools
import json
import re
from dataclasses import fields, replace

import numpy as np
import pytest
import pyvista as pv
from outlines import turns
from PIL import Image
from scipy.ndimage import gaussian_filter
from studio_pages import document, head_files, port, until

from facewrinkle import default_face
from facewrinkle.anatomy import Identity, Part
from facewrinkle.appearance.smooth_skin import SAGITTA, SmoothSkin
from facewrinkle.geometry import Lamp, unit
from facewrinkle.live import Studio
from facewrinkle.mesh import with_normals
from facewrinkle.plotting import Scene, Style
from facewrinkle.plotting.lighting import LEAST, RAYS, SOFT, STEP
from facewrinkle.plotting.views import LIGHTS
from facewrinkle.session import Look
from facewrinkle.session.player import view_of

pytestmark = pytest.mark.slow

SLIDER = "input[type=range][aria-label='{}']"
AXES = ("x", "width"), ("y", "height")


def shown(page, studio):
    """Wait until the page shows the studio at rest, in full resolution."""
    until(lambda: studio.stage.settled)
    until(lambda: int(page.evaluate("document.body.dataset.step")) == studio.stage.shown.step)
    ready = "(v) => !v.asked && !v.coarse && !v.pending && performance.now() > v.busyUntil"
    until(lambda: page.evaluate(f"({ready})(app.view)"))


def picture(page):
    return np.asarray(Image.open(io.BytesIO(page.locator("#canvas").screenshot())).convert("RGB"), float)


def find(page, text):
    """Go to the first control of a name by the list of all controls."""
    page.keyboard.press("Control+k")
    page.keyboard.type(text)
    page.keyboard.press("Enter")


def names_of_muscles(page):
    """Where they are shown, in one moment, as they are made anew with each picture. None covers another."""
    boxes = "[...document.querySelectorAll('.handle-name')].map((e) => e.getBoundingClientRect().toJSON())"
    found = [box for box in page.evaluate(boxes) if box["width"]]
    for one, other in itertools.combinations(found, 2):
        apart = [abs(one[a] + one[b] / 2 - other[a] - other[b] / 2) - (one[b] + other[b]) / 2 for a, b in AXES]
        assert max(apart) >= 0.0
    return found


def lies_in(box, whole):
    for at, long in AXES:
        assert whole[at] <= box[at] < box[at] + box[long] <= whole[at] + whole[long]


def test_a_slider_by_keyboard_changes_the_face_and_undo_takes_it_back(page, studio):
    shown(page, studio)
    before = picture(page)
    page.locator(SLIDER.format("Jaw drop")).focus()
    page.keyboard.press("End")
    until(lambda: studio.rates == {"AU26": 1.0})
    shown(page, studio)
    assert (np.abs(picture(page) - before).max(axis=2) > 30).mean() > 0.01
    page.keyboard.press("Control+z")
    until(lambda: studio.rates == {})
    shown(page, studio)
    assert np.abs(picture(page) - before).mean() < 1.0
    page.keyboard.press("Control+Shift+z")
    until(lambda: studio.rates == {"AU26": 1.0})
    page.keyboard.press("Delete")
    until(lambda: studio.rates == {})


def test_a_number_can_be_typed_and_sides_be_opened(page, studio):
    page.locator(".row", has_text="Lip corner puller").locator("output").first.dblclick()
    page.keyboard.type("40")
    page.keyboard.press("Enter")
    until(lambda: studio.rates == {"AU12L": 0.4, "AU12R": 0.4})
    page.keyboard.press("m")
    right = page.locator(SLIDER.format("Lip corner puller, right"))
    until(lambda: right.input_value() == "0.4")  # the page has it back
    right.focus()
    page.keyboard.press("Home")
    until(lambda: studio.rates == {"AU12L": 0.4})
    page.keyboard.press("r")
    until(lambda: studio.rates == {})


def test_what_is_not_0_is_counted_and_has_another_slider_below(page, studio):
    studio.change(mixture={"AU26": 0.5, "AU12L": 0.3, "AU12R": 0.3, "zygomaticus_minor_l": 0.2}, gaze=[10.0, 0.0])
    active = page.get_by_role("group", name="Active")
    until(lambda: active.locator(".row").count() == 4)
    headings = page.evaluate("[...document.querySelectorAll('h2')].map((e) => [e.textContent, e.dataset.count])")
    assert {title: int(count) for title, count in headings if count} == {"Eyes": 1, "Mouth and chin": 2, "Muscles": 1}
    page.locator(SLIDER.format("Lip corner puller, active")).focus()
    page.keyboard.press("End")
    until(lambda: studio.rates["AU12L"] == studio.rates["AU12R"] == 1.0)
    page.keyboard.press("Home")
    until(lambda: "AU12L" not in studio.rates)
    page.keyboard.press("ArrowRight")  # it stays while it is used
    until(lambda: studio.rates.get("AU12R") == 0.01)
    page.locator(SLIDER.format("Look sideways, active")).focus()
    page.keyboard.press("Delete")
    until(lambda: document(studio)["gaze"] == [0.0, 0.0])
    page.locator(SLIDER.format("Zygomaticus minor, left, active")).focus()
    page.keyboard.press("End")
    until(lambda: studio.rates["zygomaticus_minor_l"] == 1.0)
    assert "zygomaticus_minor_r" not in studio.rates
    until(lambda: active.locator(".row").count() == 3)
    page.keyboard.press("r")
    until(lambda: studio.rates == {})
    page.get_by_label("Search sliders").focus()
    studio.change(intensity=0.5)
    until(active.is_hidden)


def test_a_slider_does_not_jump_back_when_documents_come_late(opened, studio):
    routed, late = [], None

    def route(socket):
        def passed(message):
            if late is not None and isinstance(message, str) and '"is": "document"' in message:
                late.append(message)
            else:
                socket.send(message)

        routed.append(socket)
        socket.connect_to_server().on_message(passed)

    page = opened(studio.url, lambda page: page.route_web_socket("**/socket", route))
    slider = page.locator(SLIDER.format("Jaw drop"))
    slider.focus()
    late = []
    for count, key in enumerate(("End", "Home"), 1):
        page.keyboard.press(key)
        until(lambda count=count: page.evaluate("true") and len(late) == count)  # evaluating lets messages pass
    routed[0].send(late[0])  # what was said after the first key
    assert slider.input_value() == "0"
    page.keyboard.press("ArrowRight")
    until(lambda: page.evaluate("true") and studio.rates == {"AU26": 0.01})


@pytest.mark.parametrize("size", [(390, 844), (768, 1024), (844, 390), (1024, 768)])
def test_nothing_is_cut_off_on_small_screens(opened, studio, size):
    key = {"unit": "AU26", "weight": 0.5, "onset": 0.0, "apex": 0.5, "offset": 1.0, "end": 2.0}
    studio.change(mixture={"AU12": 0.5}, timeline={"length": 2.0, "loop": True, "keys": {"k": key}})
    width, height = size
    page = opened(studio.url, width=width, height=height)
    page.wait_for_selector(".track")
    for side, control in (("Sliders", "#search"), ("Details", "#tab-save"), ("Sliders", "#search")):
        button = page.get_by_role("button", name=side)
        if width <= 1080 and button.get_attribute("aria-expanded") == "false":
            button.click()
        assert page.locator(control).is_visible()
        outside = page.evaluate(
            """() => [...document.querySelectorAll("button, input, select, label, output, h2, canvas, .track span")]
            .filter((e) => e.checkVisibility() && !e.closest("dialog")).filter((e) => {
              const { left, right, top, bottom } = e.getBoundingClientRect();
              const inside = e.closest("header, .transport, canvas") ? top >= 0 && bottom <= innerHeight : true;
              return left < 0 || right > innerWidth || !inside;
            }).map((e) => e.outerHTML)"""
        )
        assert not outside
        assert page.locator("#help-button").is_visible()
        assert page.locator("#reset").is_visible()
        assert page.locator("header").bounding_box()["height"] < 80.0  # two rows at most
        face = page.locator("#canvas").bounding_box()
        assert face["width"] * face["height"] > 0.2 * width * height
    shown(page, studio)
    page.mouse.click(face["x"] + 0.5 * face["width"], face["y"] + 0.5 * face["height"])
    page.wait_for_selector("#probe:visible")
    lies_in(page.locator("#probe").bounding_box(), face)
    page.get_by_role("button", name="Save …").click()
    page.get_by_role("button", name="Copy as Python").click()
    page.wait_for_selector("pre:visible")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.locator("#muscles").check()
    until(lambda: page.evaluate("Boolean(app.fibers.part?.points)"))
    page.evaluate("app.fibers.light(app.welcome.atlas.moves.disgust)")
    until(lambda: page.locator(".handle-name:visible").count() == 6)
    for name in names_of_muscles(page):
        lies_in(name, page.locator("#canvas").bounding_box())
    if width <= 1080:
        page.get_by_role("button", name="Details").click()
        assert page.locator("#search").is_hidden()
        find(page, "lip corner puller")
        assert page.evaluate("document.activeElement.ariaLabel") == "Lip corner puller"


def test_a_session_that_cannot_be_resumed_yet_stays_on_offer(opened, face, tmp_path):
    session = {"facewrinkle session": 1, "intensity": 0.5, "face": "other.ply"}
    (tmp_path / "session.json").write_text(json.dumps(session))
    with Studio(face, browser=False, save_to=tmp_path) as studio:
        page = opened(studio.url, width=390, height=844)
        offer, compare = page.locator("#offer").bounding_box(), page.locator("#compare").bounding_box()
        assert compare["y"] + compare["height"] < offer["y"]  # neither covers the other
        assert 0.0 < offer["x"] < offer["x"] + offer["width"] < 390.0
        find(page, "dimple")
        hint = page.locator("#hint").bounding_box()  # lies over it as long as a place is chosen
        seen = [
            page.evaluate("([x, y]) => document.elementFromPoint(x, y).id", [hint["x"] + 20, hint["y"] + at])
            for at in (9, hint["height"] - 9)
        ]
        assert seen == ["hint", "hint"]
        page.keyboard.press("Escape")
        page.get_by_role("button", name="Resume").click()
        until(lambda: "other.ply' is not open" in page.inner_text("#message"))
        assert page.locator("#offer").is_visible()
        page.get_by_role("button", name="Start new").click()
        until(page.locator("#offer").is_hidden)


def test_search_finds_everyday_words(page):
    page.keyboard.press("/")
    page.keyboard.type("crow's feet")
    until(lambda: page.locator("#sliders .row:visible").count() == 1)
    assert "Cheek raiser" in page.locator("#sliders .row:visible").inner_text()


def test_each_parameter_of_a_person_has_a_slider(page, studio):
    page.get_by_role("tab", name="Face").click()
    page.evaluate(
        """() => { for (const input of document.querySelectorAll("#panel-face input[type=range]")) {
        input.value = 0.5; input.dispatchEvent(new Event("input")); } }"""
    )
    names = [field.name for field in fields(Identity)]
    until(lambda: document(studio)["identity"] == dict.fromkeys(names, 0.5))
    shown(page, studio)
    assert page.locator("#panel-face output", has_text="0.50").count() == len(names)


def drawn_skin(page):
    """Points and triangles of the skin as the page draws it."""
    skin = "app.view.parts.get('skin')"
    points, triangles = page.evaluate(f"[[...{skin}.points], {skin}.smooth.lists.flatMap((list) => [...list])]")
    return np.reshape(points, (-1, 3)), np.reshape(triangles, (-1, 3))


def rims(triangles):
    """Edges of only one triangle."""
    edges, uses = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0, return_counts=True)
    return edges[uses == 1]


def test_edges_of_the_outline_meet_at_less_than_six_degrees_and_at_ten_while_software_draws_a_moving_face(page, studio):
    shown(page, studio)
    points, triangles = drawn_skin(page)
    page.evaluate("() => { app.view.busyUntil = performance.now() + 1e6; app.view.draw(); }")
    fewer, coarse = drawn_skin(page)
    page.evaluate("() => { app.view.busyUntil = 0; app.view.request(); }")
    assert len(studio.face.triangles) < len(coarse) < 0.6 * len(triangles)
    for view in ("front", "left_three_quarter", "left_profile"):
        assert turns(studio.face, points, view).max() < 6.0
        assert turns(studio.face, fewer, view).max() < 10.0


@pytest.mark.parametrize("rates", [{}, {"AU1": 1.0, "AU12": 1.0, "AU6": 1.0}])
def test_the_skin_is_that_of_pictures_without_cracks(page, studio, rates):
    studio.rates = rates
    frame = studio.frame()
    shown(page, studio)
    points, triangles = drawn_skin(page)
    np.testing.assert_array_equal(rims(triangles), rims(frame.regular_faces))
    surface = SmoothSkin(studio.face, with_normals(frame)).mesh
    _, places = surface.find_closest_cell(points, return_closest_point=True)
    assert np.linalg.norm(places - points, axis=1).max() < 0.1 + SAGITTA  # mm, what either may be flat


def test_edges_at_a_seam_are_halved_alike_and_rims_stay(page):
    points, normals = [0, 0, 0, 2, 0, 0, 1, 3, -1], [-0.6, 0, 0.8, 0, 0.6, 0, 0.8, 0, 0, 0, 1, 0]
    split = """async ([list, points, normals]) => { const { Smooth } = await import("/smooth.js");
        const smooth = new Smooth([list], points, normals, 0);
        return [smooth.ends, [...smooth.lifted(points, normals).points]]; }"""
    ends, lifted = page.evaluate(split, [[0, 1, 2, 4, 3, 5], [*points, 0, 0, 0, 2, 0, 0, 1, -3, -1], 2 * normals])
    assert ends[:4] == [0, 1, 4, 3]
    np.testing.assert_allclose(np.reshape(lifted, (-1, 3))[6:8], [[1.0, 0.0, 0.24]] * 2, atol=1e-6)
    assert page.evaluate(split, [[0, 1, 2], points, normals])[0] == []


def test_picks_are_those_of_vtk(page, studio):
    studio.rates = {"happiness": 1.0}
    shown(page, studio)
    frame, box = studio.frame(), page.locator("canvas").bounding_box()
    frame.points = SmoothSkin(studio.face, with_normals(frame)).points[: frame.n_points]
    hits = 0
    for share in ((0.5, 0.4), (0.42, 0.5), (0.58, 0.62), (0.5, 0.2), (0.05, 0.05)):
        x, y = box["x"] + share[0] * box["width"], box["y"] + share[1] * box["height"]
        found, ray = page.evaluate(
            """([x, y]) => { const v = app.view, b = v.canvas.getBoundingClientRect();
            const r = v.camera.ray(2 * (x - b.left) / b.width - 1, 1 - 2 * (y - b.top) / b.height, b.width / b.height);
            return [v.pick(x, y), r]; }""", [x, y],
        )  # fmt: skip
        start = np.array(ray["start"])
        hit = frame.ray_trace(start, start + 5000.0 * np.array(ray["direction"]))[0]
        assert (found is None) == (len(hit) == 0)
        if found is not None:
            hits += 1
            points = hit[np.argmin(np.linalg.norm(hit - start, axis=1))]
            assert np.linalg.norm(np.array(found["place"]) - points) < 0.05
            origin = studio.stage.parts.origin[found["vertex"]]
            assert np.linalg.norm(np.asarray(frame.points)[origin] - points) < 12.0
    assert hits >= 4


def test_a_click_tells_what_made_the_fold(page, studio):
    studio.rates = {"surprise": 1.0}
    shown(page, studio)
    box = page.locator("canvas").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.24 * box["height"])
    page.wait_for_selector("#probe:visible")
    told = ("forehead", "height W (mm)", "wavelength L (mm)")
    until(lambda: all(each in page.inner_text("#probe") for each in told))
    page.keyboard.press("Escape")
    page.wait_for_selector("#probe", state="hidden")


def test_a_dimple_and_a_tear_are_placed_by_clicks_and_undone(page, studio):
    shown(page, studio)
    box = page.locator("canvas").bounding_box()
    page.locator("#tab-patterns").click()
    page.get_by_label("On both sides").check()
    page.get_by_role("button", name="Dimple", exact=True).click()
    page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.63 * box["height"])
    until(lambda: len(document(studio)["patterns"]) == 2)
    one, two = (np.array(entry["center"]) for entry in document(studio)["patterns"].values())
    assert np.allclose(one * [-1.0, 1.0, 1.0], two)
    until(lambda: studio.frame()["W"].min() < -0.8)
    page.locator("#tab-tears").click()
    page.get_by_role("button", name="Place a tear").click()
    page.mouse.click(box["x"] + 0.57 * box["width"], box["y"] + 0.47 * box["height"])
    until(lambda: document(studio)["tears"])
    until(lambda: page.evaluate("[...app.view.parts.values()].some((part) => part.kind === 'tear')"))
    page.keyboard.press("Escape")
    page.locator("#undo").click()
    page.locator("#undo").click()
    until(lambda: not document(studio)["patterns"] and not document(studio)["tears"])


def test_files_are_saved_into_the_folder(page, studio, saved):
    page.locator("#tab-save").click()
    page.get_by_role("button", name="Mesh (GLB)").click()
    file = until(lambda: next(saved.glob("face_*.glb"), None))
    until(lambda: "Saved as" in page.inner_text("#panel-save"))
    assert pv.read(file).n_blocks >= 1
    page.get_by_label("Height of pictures").fill("640")
    page.keyboard.press("Enter")
    until(lambda: studio.session.look.size == (1200, 640))
    page.get_by_role("button", name="Picture", exact=True).click()
    told = until(lambda: re.search(r"Saved as (.*\.png)", page.inner_text("#panel-save")))
    assert pv.read(told[1]).dimensions == (1200, 640, 1)
    page.get_by_role("button", name="Cut-out").click()
    file = until(lambda: next(saved.glob("cutout_*.png"), None))
    until(lambda: file.name in page.inner_text("#panel-save"))
    with Image.open(file) as cut:
        assert cut.size == (1200, 640)
        assert [cut.getpixel(at)[3] for at in ((2, 2), (600, 320))] == [0, 255]
    page.get_by_role("button", name="Copy as Python").click()
    until(lambda: "sim.express" in page.inner_text("#panel-save"))


def test_a_movie_is_cancelled(page):
    page.get_by_role("button", name="Save …").click()
    page.get_by_role("button", name="Movie", exact=True).click()
    page.get_by_role("button", name="Cancel").click()
    until(lambda: "the movie was not made." in page.inner_text("#panel-save"))
    assert page.locator("#progress").is_hidden()


LIT = """() => {
  const { gl, camera, parts } = app.view, { points, normals, buffers } = parts.get("skin");
  const lit = new Float32Array(points.length / 3);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffers.lit.buffer);
  gl.getBufferSubData(gl.ARRAY_BUFFER, 0, lit);
  const { right, up, towards } = camera.basis();
  return [points, normals, lit, [...right, ...up, ...towards]].map((array) => [...array]);
}"""


@pytest.mark.parametrize("turn", [(0.0, 0.0), (-0.7, 0.1), (1.5, 0.0), (0.3, -0.6), (3.0, 0.3)])
def test_the_skin_gets_the_share_of_the_key_light_that_it_has_in_pictures(page, studio, turn):
    """The share that the page's graphics card finds at each vertex, and that of the rays of `Lamp`."""
    studio.rates = {"AU26": 0.8}
    frame, face = studio.frame(), studio.face
    page.evaluate("([x, y]) => { app.view.camera.turn(x, y); app.view.request(true); }", turn)
    shown(page, studio)
    points, normals, lit, basis = (np.array(values) for values in page.evaluate(LIT))
    normals = unit(normals.reshape(-1, 4)[:, :3])
    head = np.asarray(frame.points, float)[: len(face.points)], face.triangles
    lamp = Lamp(head, LIGHTS[0][0] @ basis.reshape(3, 3), STEP * face.frame.scale)
    hidden = lamp.hidden(points.reshape(-1, 3), normals, soft=SOFT * face.frame.scale, rays=RAYS, least=LEAST)
    assert 0.3 < hidden.mean() < 0.8
    off = np.abs(1.0 - hidden - lit)
    assert off.mean() < 0.03
    assert np.percentile(off, 99) < 0.15  # three rays of 24, at the rims of what casts the shadow


def test_the_page_shows_what_pictures_show(page, studio):
    """The same camera and hues, from aside, the same light and shade, and the same details; with brows that are not
    lifted out of folds. The mean of several pictures, which a face at rest is drawn by without a graphics card, is
    nearer to it than a single one.
    """
    page.emulate_media(color_scheme="dark")  # the ground of pictures
    studio.rates = {"happiness": 1.0}
    page.evaluate("app.view.camera.turn(-0.6, 0.2); app.view.request(true)")
    shown(page, studio)
    mine = picture(page)
    height, width = mine.shape[:2]
    view = view_of(Look(view=page.evaluate("app.cameraNumbers()")), studio.face)
    with Scene(studio.face, Style((width, height), view)) as scene:
        theirs = np.asarray(scene.picture(studio.frame()), float)
    assert page.evaluate("app.view.taken") == 8
    page.evaluate("app.view.mean = null; app.view.request()")
    shown(page, studio)
    face = slice(height // 4, 7 * height // 10), slice(width // 4, 6 * width // 10)  # below the fringe of single hairs
    mean, single = (np.abs(details(own) - details(theirs)).max(axis=2) for own in (mine, picture(page)))
    assert np.median(mean[face]) < 4.0
    places = [studio.face.landmarks[f"eye_{side}_centre"].tolist() for side in "lr"]
    eyes = [page.evaluate("(p) => app.view.project(p)", place) for place in places]
    row, column = np.mgrid[:height, :width]
    away = np.all([np.hypot(column - at["x"], row - at["y"]) > 0.03 * height for at in eyes], axis=0)
    assert (mean[face] > 40)[away[face]].mean() < 0.001  # pages draw eyes without corneas
    outline = slice(height // 8, -height // 8), slice(width // 4, -width // 4)
    below = slice(height // 2, -height // 8), slice(width // 4, -width // 4)  # the hair, which pages do not shade
    light = np.abs(gaussian_filter(mine - theirs, (4.0, 4.0, 0.0)))[below]
    assert np.percentile(light, 99) < 4.0  # 35 without cast shadows
    assert (mean[outline] ** 2).mean() < 0.9 * (single[outline] ** 2).mean()
    hues = [each[face] / each[face].sum(axis=2, keepdims=True) for each in (mine, theirs)]
    assert 255.0 * np.median(np.abs(hues[0] - hues[1])) < 0.6  # 0.7 without the flush of cheeks


def details(image):
    """What differs from its surroundings within eight pixels."""
    return image - gaussian_filter(image, (8.0, 8.0, 0.0))


@pytest.mark.parametrize("stranded", [True, False])
def test_long_hair_is_that_of_pictures(opened, stranded):
    """Its light, its strands, and where they end; hair of your own has no strands."""
    face = default_face({"hair_length": 0.5, "hair_combed": -0.3})
    if not stranded:
        own = face.parts["hair"].mesh.copy()
        del own.point_data["strand_at"]
        face = replace(face, parts={"hair": Part(own, "skull")})
    with Studio(face, browser=False) as studio:
        page = opened(studio.url)
        page.emulate_media(color_scheme="dark")
        page.evaluate("app.view.camera.turn(-0.6, 0.2); app.view.request(true)")
        shown(page, studio)
        mine = picture(page)
        view = view_of(Look(view=page.evaluate("app.cameraNumbers()")), face)
        with Scene(face, Style((mine.shape[1], mine.shape[0]), view)) as scene:
            theirs = np.asarray(scene.picture(studio.frame()), float)
    height, width = mine.shape[:2]
    hair = slice(height // 8, height // 2), slice(13 * width // 20, 16 * width // 20)
    light = np.abs(gaussian_filter(mine - theirs, (4.0, 4.0, 0.0)))[hair]
    strands = [details(each)[hair].ravel() for each in (mine, theirs)]
    assert np.percentile(light, 99) < 16.0  # 38 if it is lit as skin is
    assert np.corrcoef(strands)[0, 1] > 0.6


def test_every_control_has_a_name_and_is_reached_in_its_order(page, studio):
    studio.rates = {"AU26": 0.5}
    shown(page, studio)
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, [role=slider], [role=tab], canvas")]
        .filter((e) => !e.hidden && !(e.ariaLabel || e.title || e.textContent.trim() || e.labels?.length))
        .map((e) => e.outerHTML)"""
    )
    assert not unnamed
    sliders = page.evaluate("[...document.querySelectorAll('input[type=range]')].map((e) => e.ariaLabel)")
    assert len(sliders) > 100
    assert [name for name in set(sliders) if sliders.count(name) > 1] == []
    page.keyboard.press("h")  # handles are controls, too
    page.keyboard.press("k")
    page.wait_for_selector(".track")
    name = "(e) => e.getAttribute('aria-label') || e.id || e.textContent"
    controls = page.evaluate(
        f"""() => [...document.querySelectorAll("button, input, select, canvas, [tabindex='0']")]
        .filter((e) => e.checkVisibility() && !e.disabled && e.tabIndex >= 0).map({name})"""
    )
    reached = []
    while len(reached) < 300 and (not reached or "Remove the key" not in reached[-1]):
        page.keyboard.press("Tab")
        reached.append(page.evaluate(f"({name})(document.activeElement)"))
    assert len(controls) > 130
    assert [each for each in controls if each != "sliders"] == [each for each in reached if each != "sliders"]


def test_parts_of_a_scan_have_their_pictures(opened, face):
    """A sheet before the face: red, green, and clear, where the face is seen; as `Scene` draws it."""
    sheet = pv.Plane(center=(0.0, 20.0, 140.0), i_size=90.0, j_size=60.0, i_resolution=6, j_resolution=6).triangulate()
    colors = np.zeros((64, 96, 4), np.uint8)
    colors[:, :32] = 255, 0, 0, 255
    colors[:, 32:64] = 0, 255, 0, 255
    carried = replace(face, parts={"other": Part(sheet, "skull", texture=colors)})
    with Studio(carried, browser=False) as studio:
        page = opened(studio.url)
        shown(page, studio)
        until(lambda: page.evaluate("app.view.photos.has('own other')"))
        shown(page, studio)
        places = [(-30.0, 20.0, 140.0), (0.0, 20.0, 140.0), (30.0, 20.0, 140.0)]
        pixels = [page.evaluate("(p) => app.view.project(p)", place) for place in places]
        red = round(pixels[0]["y"]), round(pixels[0]["x"])
        until(lambda: picture(page)[red].argmax() == 0)  # the sheet has been drawn with its picture
        mine = picture(page)
        height, width = mine.shape[:2]
        view = view_of(Look(view=page.evaluate("app.cameraNumbers()")), carried)
        frame = studio.frame()
    with Scene(carried, Style((width, height), view)) as scene:
        theirs = np.asarray(scene.picture(frame), float)
    seen = [(mine[round(p["y"]), round(p["x"])], theirs[round(p["y"]), round(p["x"])]) for p in pixels]
    for own, other in seen:
        assert np.abs(own - other).max() < 30.0
    assert seen[0][0].argmax() == 0
    assert seen[1][0].argmax() == 1
    assert seen[2][0].min() > 40.0  # skin


def drag(page, start, by):
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + by[0], start[1] + by[1], steps=4)
    page.mouse.up()


def centre(page, selector):
    box = page.locator(selector).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_an_eye_is_dragged(page, studio):
    """The pupil goes along with the pointer: the turn is that of the eyeball by the arc that was dragged."""
    shown(page, studio)
    eye = studio.face.eyes[0]
    front = eye.centre + eye.radius * studio.face.frame.axes[2]
    at = page.evaluate("(p) => app.view.project(p)", front.tolist())
    box = page.locator("canvas").bounding_box()
    drag(page, (box["x"] + at["x"], box["y"] + at["y"]), (6, -3))
    until(lambda: any(document(studio)["gaze"]))
    pixel = page.evaluate("app.view.camera.height / app.view.canvas.clientHeight")
    wanted = np.degrees(np.arctan2([6 * pixel, 3 * pixel], eye.radius))
    until(lambda: np.allclose(document(studio)["gaze"], wanted, atol=0.1))
    before = document(studio)["gaze"]
    up = page.locator(SLIDER.format("Look up"))
    until(lambda: abs(float(up.input_value()) - wanted[1]) < 0.5)  # the page has it back
    up.focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowUp")
    until(lambda: document(studio)["gaze"][1] > wanted[1] + 0.5)
    studio.undo()
    assert document(studio)["gaze"] == before  # keys that follow each other are one step


def test_keys_of_the_timeline_are_changed_by_keyboard_and_pointer(page, studio):
    length, message = page.get_by_label("Length of the timeline"), page.locator("#message")
    for typed, told in (("", 4.0), ("0.1", 0.2), ("4", 4.0)):
        length.fill(typed)
        page.keyboard.press("Enter")
        until(lambda told=told: document(studio)["timeline"]["length"] == told)
        until(lambda told=told: float(length.input_value()) == told)
        assert message.is_hidden()  # there are no keys to speak of
    page.keyboard.press("Escape")  # letters are typed no more
    studio.rates = {"AU26": 0.5}
    until(lambda: page.evaluate("app.data.mixture.AU26") == 0.5)
    page.keyboard.press("k")
    (name,) = until(lambda: document(studio)["timeline"]["keys"])

    def key():
        return document(studio)["timeline"]["keys"][name]

    before = key()
    page.get_by_label("AU26: end").focus()
    for k in range(2):
        page.keyboard.press("ArrowRight")
        until(lambda k=k: key()["end"] == pytest.approx(before["end"] + 0.1 * (k + 1)))
    page.locator(".track svg").focus()
    page.keyboard.press("ArrowUp")
    until(lambda: key()["weight"] == pytest.approx(0.55))
    width = page.locator(".track svg").bounding_box()["width"]
    drag(page, centre(page, "[aria-label='AU26: apex']"), (0.05 * width, 0))
    until(lambda: key()["apex"] == pytest.approx(before["apex"] + 0.05 * 4.0, abs=0.02))
    length.fill("")
    page.keyboard.press("Enter")
    until(lambda: length.input_value() == "4")
    assert message.is_hidden()
    length.fill("1")
    page.keyboard.press("Enter")
    until(lambda: document(studio)["timeline"]["length"] == pytest.approx(key()["end"]))  # not shorter than its keys
    until(lambda: message.inner_text() == f"The last key of the timeline ends at {key()['end']:.2f} s.")


def test_a_key_keeps_what_is_shown(page, studio):
    """With one track for both sides of a unit where they are equal, and one for each where they are not."""
    studio.change(mixture={"AU12L": 0.8, "AU12R": 0.8, "AU4": 0.6, "AU6L": 0.4, "AU26": 0.5}, intensity=0.5)
    for at in (0.0, 1.0, 4.0):  # at the beginning and at the end, too
        page.evaluate("(time) => app.connection.send('pose', { time })", at)
        shown(page, studio)
        until(lambda at=at: page.evaluate("app.timeline.time") == at)
        before, points = document(studio), np.asarray(studio.frame().points)
        page.get_by_role("button", name="Add key").click()
        until(lambda: not document(studio)["mixture"])
        keys = list(document(studio)["timeline"]["keys"].values())
        assert {key["unit"]: key["weight"] for key in keys} == {"AU12": 0.4, "AU4": 0.3, "AU6L": 0.2, "AU26": 0.25}
        until(lambda: page.locator(".track").count() == 4)
        shown(page, studio)
        assert np.abs(np.asarray(studio.frame().points) - points).max() < 1e-3
        studio.undo()
        assert document(studio) == before


def test_a_muscle_is_pulled_along_its_fibers(page, studio):
    shown(page, studio)
    page.keyboard.press("h")
    handle = "[data-handle=zygomaticus_major_l]"
    way = page.evaluate("app.overlay.handles.find((each) => each.name === 'zygomaticus_major_l').way()")
    drag(page, centre(page, handle), (0.5 * way["x"], 0.5 * way["y"]))
    both = {"zygomaticus_major_l": 0.5, "zygomaticus_major_r": 0.5}
    until(lambda: studio.rates == pytest.approx(both, abs=0.02))
    before = studio.rates["zygomaticus_major_l"]
    studio.undo()
    assert studio.rates == {}  # it was one step
    studio.redo()
    page.keyboard.press("m")
    until(lambda: page.locator(handle).get_attribute("aria-valuenow") == str(round(100 * before)))
    page.locator(handle).focus()
    page.keyboard.press("ArrowUp")
    until(lambda: studio.rates["zygomaticus_major_l"] == pytest.approx(before + 0.05))
    assert studio.rates["zygomaticus_major_r"] == before
    until(lambda: page.locator(handle).get_attribute("aria-valuenow") == str(round(100 * before + 5)))


def test_fibers_and_sliders_point_at_each_other(page, studio):
    shown(page, studio)
    plain = picture(page)
    studio.rates = {"zygomaticus_major_l": 1.0}
    page.locator("#muscles").check()
    until(lambda: page.evaluate("Boolean(app.fibers.part?.points)"))
    shown(page, studio)
    assert page.locator("#contraction").is_visible()
    assert (np.abs(picture(page) - plain).max(axis=2) > 20).mean() > 0.02
    tags = page.locator(".handle-name:visible")
    page.locator("#sliders .row", has_text="Lip corner puller").hover()
    both = ["Zygomaticus major, left: 100", "Zygomaticus major, right: 0"]
    until(lambda: sorted(tags.all_text_contents()) == both)
    page.locator("#sliders .row", has_text="Disgust").hover()
    until(lambda: tags.count() == 6)
    assert len(names_of_muscles(page)) == 6
    part = studio.stage.shown.fields["fibers"]
    muscle = part.info["names"].index("zygomaticus_major_l")
    fiber = int(np.flatnonzero(part.arrays["muscle"] == muscle)[1])
    box = studio.stage.shown.box
    numbers = part.arrays["position"].reshape(-1, part.info["knots"], 3)[fiber, 5]
    at = page.evaluate("(p) => app.view.project(p)", (box.low + numbers * (box.size / 65535)).tolist())
    canvas = page.locator("canvas").bounding_box()
    page.mouse.move(canvas["x"] + at["x"], canvas["y"] + at["y"])
    until(lambda: tags.all_text_contents() == ["Zygomaticus major, left: 100"])
    linked = page.locator(".row.linked > span").all_inner_texts()
    assert {"Happiness", "AU12Lip corner puller", "Zygomaticus major"} <= set(linked)
    assert not any("Frontalis" in each for each in linked)
    slider = page.locator("#sliders .row", has_text="Zygomaticus major")
    until(lambda: slider.bounding_box()["y"] < page.locator("#left").bounding_box()["height"])  # it was scrolled to
    page.mouse.move(2, 2)
    until(lambda: page.locator(".row.linked").count() == 0)
    page.locator("[data-handle=corrugator_l]").focus()  # by keyboard
    until(lambda: "AU4" in " ".join(page.locator(".row.linked").all_inner_texts()))
    page.locator("[data-handle=corrugator_l]").blur()
    page.locator(SLIDER.format("Jaw drop")).focus()
    until(lambda: tags.count() == 0)  # it turns a bone, and pulls no skin
    page.locator("#muscles").uncheck()
    until(lambda: not page.evaluate("Boolean(app.fibers.part)"))


def test_opening_and_saving_are_found_at_once(page, studio):
    hint = page.locator("#drop")
    while studio.undo():
        pass
    until(hint.is_visible)
    assert "Drop your own head here" in hint.inner_text()
    with page.expect_file_chooser():
        page.get_by_role("button", name="Open …").click()
    page.get_by_role("button", name="Save …").click()
    assert page.get_by_role("button", name="Picture", exact=True).is_visible()
    studio.rates = {"AU26": 1.0}
    until(hint.is_hidden)


def test_a_program_that_cannot_be_made_is_told(page):
    page.get_by_role("button", name="Save …").click()
    page.evaluate("() => { app.connection.ask = async () => { throw new Error('It cannot be made.'); }; }")
    page.get_by_role("button", name="Copy as Python").click()
    until(lambda: page.inner_text("#message") == "It cannot be made.")


def test_probes_are_pinned_to_the_skin(page, studio):
    studio.rates = {"surprise": 1.0}
    page.locator("#tab-fields").click()
    page.locator("#field").select_option("W")
    shown(page, studio)
    button = page.get_by_role("button", name="Place a probe")
    button.click()
    box = page.locator("canvas").bounding_box()
    page.mouse.click(box["x"] + 0.53 * box["width"], box["y"] + 0.24 * box["height"])
    until(lambda: "probe 1" in document(studio)["probes"])
    button.focus()
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "canvas"
    page.keyboard.press("Enter")
    until(lambda: "probe 2" in document(studio)["probes"])
    middle = page.evaluate(
        "([x, y]) => app.view.pick(x, y).vertex", [box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]]
    )
    frame = studio.frame()
    there = frame["rest"][studio.stage.parts.origin[middle]]
    assert np.linalg.norm(there - document(studio)["probes"]["probe 2"]) < 4.0  # the nearest vertex

    def values():
        """The numbers of a finer mesh, nearest to where the probes are at rest."""
        frame = studio.frame()
        near = [
            np.argsort(((frame["rest"] - place) ** 2).sum(axis=1))[:3] for place in document(studio)["probes"].values()
        ]
        return [frame["W"][each] for each in near]

    def told():
        shown(page, studio)
        return [float(text) for text in page.locator("#probes output").all_inner_texts()]

    for mixture in ({"surprise": 1.0}, {"surprise": 0.6}):
        studio.rates = mixture
        for value, around in zip(until(told), values(), strict=True):
            assert around.min() - 0.05 < value < around.max() + 0.05
    at = page.locator("[data-handle='probe 1']")
    y = at.bounding_box()["y"]
    studio.rates = {}
    shown(page, studio)
    until(lambda: at.bounding_box()["y"] > y + 1)  # it goes down with the brow
    page.locator("#view").select_option("right_profile")
    shown(page, studio)
    assert at.is_hidden()
    page.reload()
    page.wait_for_selector("[data-handle='probe 1']")
    at.focus()
    before = document(studio)["probes"]["probe 1"]
    page.keyboard.press("ArrowUp")
    until(lambda: document(studio)["probes"]["probe 1"][1] > before[1] + 0.3)
    page.keyboard.press("Delete")
    until(lambda: list(document(studio)["probes"]) == ["probe 2"])
    page.keyboard.press("Control+z")
    until(lambda: list(document(studio)["probes"]) == ["probe 1", "probe 2"])
    page.locator("#tab-fields").click()
    page.get_by_role("button", name="Remove Probe 2").click()
    until(lambda: list(document(studio)["probes"]) == ["probe 1"])


def test_a_state_is_kept_and_compared_by_a_curtain(page, studio):
    shown(page, studio)
    rest = picture(page)
    page.keyboard.press("a")
    curtain = page.get_by_role("slider", name="Curtain")
    assert curtain.evaluate("(e) => e === document.activeElement")
    studio.change(mixture={"AU26": 1.0, "AU4": 1.0}, identity={"skin": 0.8})
    shown(page, studio)
    until(lambda: np.abs(picture(page) - rest).mean() > 3.0)  # its colors have come, too
    shown(page, studio)
    both, middle = picture(page), rest.shape[1] // 2
    page.keyboard.press("Home")
    until(lambda: curtain.get_attribute("aria-valuenow") == "0")
    shown(page, studio)
    now = picture(page)
    left, right, top = slice(0, middle - 40), slice(middle + 60, -90), slice(90, None)  # beside labels and buttons
    assert np.abs(both - rest)[top, left].mean() < 0.3
    assert np.abs(both - now)[top, right].mean() < 0.3
    assert np.abs(now - rest)[top, left].mean() > 3.0
    page.keyboard.press("End")
    until(lambda: curtain.get_attribute("aria-valuenow") == "100")
    shown(page, studio)
    assert np.abs(picture(page) - rest)[top, right].mean() < 0.3
    page.evaluate("app.view.camera.turn(0.5, 0); app.view.request()")  # what was kept is turned, too
    shown(page, studio)
    turned = picture(page)
    box = page.locator("canvas").bounding_box()
    drag(page, centre(page, "#curtain"), (-0.7 * box["width"], 0))
    until(lambda: abs(float(curtain.get_attribute("aria-valuenow")) - 30) < 2)
    page.get_by_role("button", name="Compare").click()
    assert curtain.is_hidden()
    studio.change(mixture={}, identity={})
    until(lambda: np.abs(picture(page) - turned)[top, right].mean() < 0.3)


def test_captures_come_side_by_side_in_a_sheet(page, studio):
    page.get_by_role("button", name="Save …").click()
    sheet = page.get_by_role("button", name="Sheet (PNG)")
    assert sheet.is_disabled()
    seen = []
    for mixture in ({}, {"AU26": 1.0}, {"AU4": 0.5}):
        studio.rates = mixture
        until(lambda mixture=mixture: page.evaluate("app.data.mixture") == mixture)
        shown(page, studio)
        seen.append(picture(page))
        page.get_by_role("button", name="Capture", exact=True).click()
    words = page.get_by_role("textbox", name="Words below capture")
    assert [each.input_value() for each in words.all()] == ["At rest", "AU26 100", "AU4 50"]
    page.get_by_role("button", name="Remove capture 3").click()
    with page.expect_download() as download:
        sheet.click()
    image = Image.open(download.value.path()).convert("RGB")
    height, width = seen[0].shape[:2]
    gap, below = 16, 28
    assert image.size == (2 * width + 3 * gap, height + below + 2 * gap)
    pixels, alone = np.asarray(image, float), slice(60, height - 40)  # without buttons and words that lie over the view
    for k, shot in enumerate(seen[:2]):
        left = gap + k * (width + gap)
        cell = pixels[gap:, left : left + width]
        assert np.abs(cell[alone] - shot[alone]).mean() < 0.5
        assert cell[height : height + below].min() < 100.0 < 250.0 < np.median(cell[height : height + below])  # words


def test_a_double_click_resets_a_slider_to_its_tick(page, studio):
    depth = page.locator(SLIDER.format("Folds: Depth"))
    box = depth.bounding_box()
    page.mouse.click(box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2)
    until(lambda: document(studio)["folds"]["depth"] > 2.5)
    page.wait_for_timeout(1000)  # so that the next clicks are a gesture of their own
    page.mouse.dblclick(box["x"] + 0.6 * box["width"], box["y"] + box["height"] / 2)
    until(lambda: document(studio)["folds"]["depth"] == 1.0)
    until(lambda: depth.input_value() == "1")
    studio.undo()
    assert document(studio)["folds"]["depth"] > 2.5  # both clicks were one step
    usual = page.evaluate(
        "(e) => [(1 - e.min) / (e.max - e.min), Number(e.style.getPropertyValue('--usual'))]", depth.element_handle()
    )
    assert usual[0] == usual[1] == 0.25


def test_any_control_is_found_and_expressions_are_named_by_keyboard(page, studio):
    find(page, "jaw drop")
    page.keyboard.press("End")
    until(lambda: page.evaluate("app.data.mixture.AU26") == 1.0)
    page.keyboard.press("Control+k")
    page.keyboard.type("name expr")
    assert page.locator("#palette li").count() >= 1
    page.keyboard.press("Escape")
    page.locator("#own button").focus()
    page.keyboard.press("Enter")
    page.keyboard.type("Open wide!" + 40 * "!")
    page.keyboard.press("Enter")
    name = "Open wide" + 31 * "!"
    until(lambda: document(studio)["mixtures"] == {name: {"AU26": 1.0}})
    studio.rates = {}
    until(lambda: page.locator(SLIDER.format("Jaw drop")).input_value() == "0")
    find(page, "open wide")
    until(lambda: studio.rates == {"AU26": 1.0})


def test_the_range_of_a_field_is_locked_and_its_number_told(page, studio):
    studio.rates = {"surprise": 1.0}
    page.locator("#tab-fields").click()
    page.locator("#field").select_option("W")
    shown(page, studio)
    box = page.locator("canvas").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.24 * box["height"]
    told = until(lambda: page.evaluate("([x, y]) => app.view.valueAt(app.view.pick(x, y))", [x, y]))
    hit = page.evaluate("([x, y]) => app.view.pick(x, y)", [x, y])
    values = np.asarray(studio.frame()["W"])[studio.stage.parts.origin[hit["corners"]]]
    assert told == pytest.approx(values @ hit["shares"], abs=1e-3)
    free = picture(page)
    page.get_by_label("Maximum of the color range").fill("9")
    page.keyboard.press("Enter")
    until(lambda: page.locator("#legend .ends span").last.inner_text() == "9")
    until(lambda: (np.abs(picture(page) - free).max(axis=2) > 20).mean() > 0.05)
    page.evaluate("app.showField('W')")  # as when the connection comes back: the lock stays, and is seen
    assert page.get_by_label("Lock").is_checked()
    assert page.get_by_label("Maximum of the color range").input_value() == "9"
    page.get_by_label("Lock").uncheck()
    until(lambda: page.locator("#legend .ends span").last.inner_text() != "9")


def test_landmarks_and_patterns_are_dragged(page, studio, face):
    page.locator("#tab-face").click()
    page.evaluate("Object.assign(app.face.landmarks.mouth_l, { confidence: 0.42, estimated: true })")  # as of a scan
    page.get_by_label("Show on the face; drag to correct").check()
    page.wait_for_selector("[data-handle=mouth_l]")
    page.locator("[data-handle=mouth_l]").hover()
    assert page.inner_text(".handle-name").lower() == "mouth l, estimated, confidence 42 %"
    shown(page, studio)
    drag(page, centre(page, "[data-handle=mouth_l]"), (0, -8))
    pixel = page.evaluate("app.view.camera.height / app.view.canvas.clientHeight")
    found = face.landmarks

    def moved():
        return np.array(document(studio)["landmarks"].get("mouth_l", found["mouth_l"])) - found["mouth_l"]

    until(lambda: abs(moved()[1] - 8 * pixel) < 1.0)
    other = np.array(document(studio)["landmarks"]["mouth_r"]) - found["mouth_r"]
    assert np.allclose(other, moved() * [-1.0, 1.0, 1.0], atol=1e-3)  # both sides are moved together
    studio.frame()
    assert np.allclose(studio.face.landmarks["mouth_l"], document(studio)["landmarks"]["mouth_l"])
    page.get_by_role("button", name="Reset landmarks").click()
    until(lambda: not document(studio)["landmarks"])
    studio.change(patterns={"d": {"kind": "dimple", "center": [38.8, -30.8, 95.0], "size": 30.0, "depth": 2.0}})
    page.locator("#tab-patterns").click()
    page.wait_for_selector("#overlay .ring")
    shown(page, studio)
    until(lambda: page.locator("#overlay .ring").get_attribute("r") is not None)
    x, y = centre(page, "#overlay .placed")
    radius = float(page.locator("#overlay .ring").get_attribute("r"))
    drag(page, (x + radius, y), (10, 0))
    until(lambda: abs(document(studio)["patterns"]["d"]["size"] - 30.0 - 20 * pixel) < 2.0)
    page.locator("#overlay .placed").focus()
    page.keyboard.press("ArrowDown")
    until(lambda: document(studio)["patterns"]["d"]["center"][1] < -31.0)


def test_a_mesh_that_is_dropped_is_shown_and_undone(page, studio, tmp_path):
    files = [tmp_path / name for name in head_files(studio.face, tmp_path)]
    dropped = page.evaluate_handle(
        """(all) => all.reduce((data, [name, text]) => {
          data.items.add(new File([Uint8Array.from(atob(text), (letter) => letter.charCodeAt())], name));
          return data;
        }, new DataTransfer())""",
        [[path.name, base64.b64encode(path.read_bytes()).decode()] for path in files],
    )
    page.dispatch_event("#canvas", "dragenter", {"dataTransfer": dropped})
    assert page.locator("#veil").inner_text() == "Drop a mesh, an animation, a take or a session"
    page.dispatch_event("#canvas", "drop", {"dataTransfer": dropped})
    assert page.locator("#veil").is_hidden()
    page.wait_for_selector("#progress:visible")
    page.wait_for_selector("#progress", state="hidden")
    assert document(studio)["face"].startswith("head.ply")  # with a number if that is open
    assert page.evaluate("app.face.faces.shown") == document(studio)["face"]
    shown(page, studio)
    assert not page.evaluate("Boolean(app.view.parts.get('skin').arrays.texture)")
    page.keyboard.press("Control+z")
    until(lambda: page.evaluate("app.face.faces.shown") == "")
    shown(page, studio)
    assert page.evaluate("Boolean(app.view.parts.get('skin').arrays.texture)")


def test_a_take_that_is_opened_plays_and_is_scrubbed(page, studio, tmp_path):
    path = tmp_path / "take.csv"
    path.write_text("time,jawOpen\n" + "".join(f"{t},{t / 2}\n" for t in (0.0, 0.5, 1.0, 1.5, 2.5)))
    page.locator("input[type=file]").set_input_files(path)
    page.wait_for_selector("#message.note:visible")
    assert page.inner_text("#message").startswith("Weights outside [0, 1] are clamped")
    until(lambda: page.inner_text("#play") == "Stop" and page.evaluate("app.timeline.time") > 0.2)
    page.locator("#canvas").focus()
    page.keyboard.press("Space")
    assert page.inner_text("#play") == "Play"
    page.get_by_role("slider", name="Time", exact=True).fill("1.5")
    until(lambda: abs(studio.stage.shown.time - 1.5) < 1e-6 and studio.stage.settled)
    slider = page.locator(SLIDER.format("Jaw drop"))
    assert slider.is_disabled()
    assert "Double-click" not in slider.get_attribute("title")  # but why
    page.locator("#muscles").check()  # its fibers show what the take contracts; nobody else can pull
    until(lambda: page.evaluate("app.view.parts.has('fibers')"))
    assert page.locator("#overlay circle").count() == 0
    page.locator("#muscles").uncheck()
    page.get_by_role("button", name="Save …").click()
    page.get_by_role("button", name="Copy as Python").click()
    until(lambda: "fw.read_take" in page.inner_text("#panel-save"))


def test_the_tour_leads_through_the_page(page):
    page.locator("#tour-button").click()
    page.wait_for_selector("#tour:visible")
    titles = []
    while page.locator("#tour").is_visible():
        titles.append(page.inner_text("#tour h2"))
        assert page.locator(".outlined").count() >= 1
        page.keyboard.press("Enter")  # the button for the next step has the focus
    assert len(titles) == len(set(titles)) == 10
    assert page.evaluate("document.activeElement.id") == "tour-button"


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_words_are_readable_in_the_colors_that_the_system_asks_for(opened, studio, scheme):
    """By the contrast of WCAG 2.2: 4.5 for all words, on panels and on buttons. The ground of the face goes along."""
    page = opened(studio.url, color_scheme=scheme)
    names = ("panel", "raised", "main", "text", "quiet", "accent", "error")
    read = "(names) => names.map((name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`))"
    colors = dict(zip(names, page.evaluate(read, list(names)), strict=True))

    def luminance(name):
        share = np.array([int(colors[name].strip()[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        return linear @ [0.2126, 0.7152, 0.0722]

    assert (luminance("panel") > 0.5) == (scheme == "light")
    shown(page, studio)
    assert (picture(page)[100:, :20].min() > 150.0) == (scheme == "light")
    for words, ground in (*((name, "panel") for name in names[3:]), ("text", "raised"), ("text", "main")):
        low, high = sorted((luminance(words), luminance(ground)))
        assert (high + 0.05) / (low + 0.05) > 4.5, (words, ground)


def test_a_lost_connection_comes_back_and_a_new_server_is_not_mistaken(opened, face):
    routed = []

    def route(socket):
        routed.append(socket)
        socket.connect_to_server()

    with Studio(face, browser=False) as first:
        page = opened(first.url, lambda page: page.route_web_socket("**/socket", route))
        routed[0].close(code=1001)
        until(lambda: "reconnecting" not in page.inner_text("#state") and len(routed) == 2)
        first.rates = {"AU26": 1.0}
        until(lambda: page.locator(SLIDER.format("Jaw drop")).input_value() == "1")
        first.frame()
    until(lambda: "reconnecting" in page.inner_text("#state"))
    with Studio(face, browser=False, port=port(first)) as second:
        page.wait_for_selector("#message:visible", timeout=20_000)
        assert "No studio is running" in page.inner_text("#message")
        page.goto(second.url)
        page.reload()  # else the address differs by its fragment alone
        page.wait_for_selector("body[data-step]", timeout=60_000)
