"""Parts of a page against the meshes of pictures.

eyes: turned and between lids as the page works it out | the painted eye of pictures
brows, bound to triangles                              | the brows of pictures at rest; carried by a rigid motion
teeth and tongue with their matrix                     | those inside an open mouth
shade of furrows, exact                                | cavity_shading
blood, by its law of light                             | the flush of pictures
fibers of muscles, as far as positions are whole       | those of pictures
pins                                                   | places at rest, by the corners that they are told to have
numbers of formulas                                    | put in again, they add up to the heights of the layers
who made a height                                      | the muscle whose own W is the deepest there; the pattern
"""

import numpy as np
import pytest
from expressions import after

import facewrinkle as fw
from facewrinkle.appearance.fibers import Fibers
from facewrinkle.appearance.flush import ABSORBANCE, MOST
from facewrinkle.appearance.seen import Appearance
from facewrinkle.appearance.skin_paint import cavity_shading
from facewrinkle.layers.entries import Relief
from facewrinkle.live.fields import probe
from facewrinkle.live.protocol import LARGEST
from facewrinkle.live.visible_parts import VisibleParts


@pytest.fixture(scope="module")
def laughing(face):
    return after(fw.Simulation(face), "laughter", 12)


def parts_of(face, frame, **options):
    return {part.name: part for part in VisibleParts(face).at(frame, **options)}


def test_eyes_are_where_pictures_have_them(face, laughing):
    parts, seen = parts_of(face, laughing), Appearance.of(face).at(laughing)
    for side in "lr":
        part, ball = parts[f"eye_{side}"], seen.eyes[side]
        axes = np.array(part.info["axes"]).reshape(3, 3)
        points = np.array(part.info["centre"]) + part.info["radius"] * part.arrays["sphere"] @ axes
        assert np.abs(points - ball.points).max() < 1e-4
        assert np.abs(part.arrays["cornea"] @ axes - ball["Normals"]).max() < 1e-5
        across, up, ahead = np.array(part.info["lid_axes"]).reshape(3, 3)
        towards = part.arrays["sphere"] @ axes
        places = np.linspace(-1.1, 1.1, part.arrays["lids"].shape[1])
        height = np.degrees(np.arctan2(towards @ up, towards @ ahead))
        below = np.interp(towards @ across, places, part.arrays["lids"][0]) - height
        above = height - np.interp(towards @ across, places, part.arrays["lids"][1])
        shade = 0.28 * np.exp(-np.maximum(below, 0) / 4) + 0.34 * np.exp(-np.maximum(below, 0) / 16)
        shade += 0.26 * np.exp(-np.maximum(above - 1, 0) / 6)
        corner = np.array(part.info["corner"])
        away = np.degrees(np.arccos(np.clip(towards @ corner, -1, 1)))
        t = np.clip(1.25 - away / 11, 0, 1)[:, None]
        paint = part.arrays["color"] + t**2 * (3 - 2 * t) * (
            255 * np.array(part.info["caruncle"]) - part.arrays["color"]
        )
        wet = 0.6 * np.exp(-((np.maximum(above, 0) / 2.2) ** 2))[:, None]
        paint = paint + wet * (255 * np.array(part.info["tears"]) - paint)
        paint = np.clip(paint * (1 - np.minimum(shade, 0.85)[:, None] * [0.92, 1, 1]), 0, 255)
        assert np.percentile(np.abs(paint - ball["paint"]), 99) < 6.0  # lids are sampled at 48 places


def bound(part, points):
    a, b, c = (points[part.arrays["corners"][:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    s, t, h = part.arrays["place"].T[..., None]
    return a + s * (b - a) + t * (c - a) + h * normal


def test_brows_are_those_of_pictures_and_go_with_the_skin(face):
    part = parts_of(face, face.mesh)["brows"]
    lines = (
        Appearance.of(face)
        .bound_hair["brows"]
        .lines(face.points, face.triangles, Appearance.of(face).at(face.mesh).skin["Normals"])
    )
    assert np.abs(bound(part, face.points) - lines.points.reshape(-1, 3)).max() < 1e-3
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.abs(bound(part, face.points @ turn.T + 5.0) - (bound(part, face.points) @ turn.T + 5.0)).max() < 1e-3


@pytest.mark.parametrize("what", ["laughter", "AU19"])
def test_teeth_and_tongue_go_with_their_matrix(face, what):
    laughing = after(fw.Simulation(face, layers=[]), what, 12)
    parts, inside = parts_of(face, laughing), Appearance.of(face).at(laughing).inside_mouth
    assert set(inside) == {"upper_teeth", "lower_teeth", "tongue"}
    for name, mesh in inside.items():
        part = parts[name]
        matrix = np.array(part.info["matrix"]).reshape(4, 4).T
        moved = part.arrays["position"] @ matrix[:3, :3].T + matrix[:3, 3]
        assert part.info["visible"]
        assert np.abs(moved - mesh.points).max() < 1e-3
    assert not parts_of(face, face.mesh)["tongue"].info["visible"]


def test_furrows_are_shaded_as_in_pictures_once_the_face_rests(face, laughing):
    parts = VisibleParts(face)
    skin = parts.at(laughing, exact=True)[0]
    lost = 1.0 - cavity_shading(laughing)[:, 1] / 255.0
    assert np.abs(skin.arrays["normal"][:, 3] / 127.0 - lost[parts.origin]).max() <= 0.51 / 127
    assert lost.max() > 0.03


def test_gathered_skin_reddens_as_in_pictures(face, laughing):
    parts = VisibleParts(face)
    blood = parts.at(laughing)[0].arrays["blood"][:, None] * (MOST / 127.0)
    factors = np.exp(-blood * ABSORBANCE)
    factors /= np.maximum(factors.max(axis=1, keepdims=True), 1.0)
    theirs = Appearance.of(face).at(laughing).flush[parts.origin]
    away, own = np.abs(factors - theirs), parts.origin < len(face.points)
    assert away[own].max() < 0.5 / 255
    assert away.max() < 1.5 / 255  # elsewhere, pictures mix the factors, and the page the blood
    assert theirs.min() < 0.96
    assert not parts.at(face.mesh)[0].arrays["blood"].any()


def test_fibers_are_those_of_pictures(face, laughing):
    parts = VisibleParts(face)
    part = parts.fibers(laughing, {"corrugator_l": 0.4})
    box = parts.box
    points = box.low + part.arrays["position"] * (box.size / LARGEST)
    assert np.abs(points - Fibers.of(face).at(laughing).reshape(-1, 3)).max() < box.size / LARGEST
    assert {part.info["names"][k]: part.arrays["rate"][k] for k in part.arrays["rate"].nonzero()[0]} == {
        "corrugator_l": 102
    }


def test_pins_stay_where_they_are_at_rest_while_triangles_split(face, laughing):
    parts, random = VisibleParts(face), np.random.default_rng(5)
    corners = face.points[face.triangles[random.choice(face.mesh.n_cells, 40, replace=False)]]
    places = (random.dirichlet([1.0, 1.0, 1.0], 40)[..., None] * corners).sum(axis=1)
    named = {str(k): place.tolist() for k, place in enumerate(places)}
    for frame in (face.mesh, laughing):
        part = parts.pins(frame, named)
        rest = np.asarray(frame["rest"] if "rest" in frame.point_data else frame.points)
        told = (part.arrays["shares"][..., None] * rest[part.arrays["corners"]]).sum(axis=1)
        assert part.info["names"] == list(named)
        assert np.abs(told - places).max() < 1e-3
    assert laughing.n_points > face.mesh.n_points + 1000


def test_only_arrays_that_changed_are_others(face, laughing):
    parts = VisibleParts(face)
    first, again, moved = ({part.name: part for part in parts.at(mesh)} for mesh in (face.mesh, face.mesh, laughing))

    def others(name, then):
        return {key for key, array in then[name].arrays.items() if array is not first[name].arrays.get(key)}

    assert not any(others(name, again) for name in first)
    assert others("skin", moved) >= {"index", "position", "normal"}
    assert moved["skin"].info["version"] > again["skin"].info["version"] == first["skin"].info["version"]
    assert others("eye_l", moved) == {"lids"}
    assert others("brows", moved) == others("upper_teeth", moved) == set()


def test_a_scan_without_landmarks_is_only_skin():
    import pyvista as pv

    sheet = fw.surface(pv.Plane(i_resolution=4, j_resolution=4).triangulate())
    assert [part.name for part in VisibleParts(sheet).at(sheet.mesh)] == ["skin"]
    assert VisibleParts(sheet).photos() == {}


# --- all that is known at a vertex ----------------------------------------------------------------


@pytest.fixture(scope="module")
def happy(face):
    """A simulation of a smile with a dimple whose heights are not leveled, and its frame."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Relief, "leveled", lambda relief, areas: relief)
        dimple = fw.PatternLayer("dimple", [38.8, -30.8, 95.0], name="mine", size=12.0, depth=2.0)
        sim = fw.Simulation(face, layers=[fw.Creases(), fw.WaveFolds(), dimple])
        sim.express({"happiness": 1.0, "AU4": 0.5})
        yield sim, sim.settle()


def test_the_numbers_add_up_to_the_heights(happy):
    sim, frame = happy
    muscles, waves, _ = sim.layers
    folded = np.flatnonzero(np.abs(frame["W"]) > 0.1)[::40]
    assert len(folded) > 20
    for vertex in folded:
        told = waves.explained(int(vertex))
        others = muscles.fields()["W"][vertex] + frame["pattern_mine"][vertex]
        assert sum(each["W"] for each in told) + others == pytest.approx(frame["W"][vertex], abs=1e-6)
        for each in told:  # the formula of the docstring, by its numbers
            s, alpha = each["theta"] / np.pi, each["alpha"]
            bulge = (2.0 ** (alpha + 1.0) - 1.0) / (2.0 * (alpha + 1.0))
            assert each["W"] == pytest.approx(each["D"] * (bulge - abs(s) * (1 + s * s) ** alpha) / 2.0**alpha)
            deepest = min(0.75 * each["P"] * 2.0 / np.pi * each["L"] * np.sqrt(each["e"]), 0.22 * each["L"])
            assert each["D"] == pytest.approx(each["share"] * each["S"] * deepest)
        own = muscles.explained(int(vertex))
        assert sum(each["W"] for each in own) == pytest.approx(muscles.fields()["W"][vertex], abs=1e-9)
        for each in own:
            product = each["k0"] * each["rate"] * each["H At"] * each["A"] * each["share"]
            assert each["W"] == pytest.approx(product)


def at(vertex):
    """A corner of a triangle."""
    return np.array([vertex, 0, 1]), np.array([1.0, 0.0, 0.0])


def test_the_card_tells_what_pin_and_program_tell(happy, face):
    """At ten places between vertices: the same interpolation, in the triangle."""
    sim, frame = happy
    generator, triangles = np.random.default_rng(0), frame.regular_faces
    for corners in generator.choice(triangles[(np.abs(frame["W"][triangles]) > 0.05).all(axis=1)], 10):
        shares = generator.dirichlet([2.0, 2.0, 2.0])
        told = probe(frame, face, sim.layers, corners, shares)
        assert told["values"]["W"] == pytest.approx(shares @ frame["W"][corners], abs=1e-5)
        assert fw.mesh.values_at(frame, "W", [told["rest"]])[0] == pytest.approx(told["values"]["W"], abs=1e-4)


def test_the_maker_is_the_deepest(happy, face):
    sim, frame = happy
    creases = sim.fields("zygomaticus_major_l")["W"]
    told = probe(frame, face, sim.layers, *at(np.argmin(creases)))
    assert told["made_by"] == "zygomaticus_major_l"
    assert told["added"]["zygomaticus_major_l"] == pytest.approx(creases.min(), abs=1e-3)
    assert "k0 (mm)" in told["numbers"]
    dimple = int(np.argmin(frame["pattern_mine"]))
    assert probe(frame, face, sim.layers, *at(dimple))["made_by"] == "the pattern 'mine'"
