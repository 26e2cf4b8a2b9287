"""Sessions: what is set in the studio, in a file and in a program, is one and the same face.

documents that pages can make | run as a program and by the command line: the frame that the studio saves, to the byte
a session through the studio  | the mesh that the page saves, that of the command line, and that of the program
what is not allowed           | a sentence that names it
places on triangles           | the same numbers of the same triangle on another person
sessions of earlier versions  | open, with coordinates as places
"""

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from real_faces import built_in

import facewrinkle as fw
from facewrinkle.cli import main
from facewrinkle.errors import FaceWrinkleError, ParameterError, UnknownNameError
from facewrinkle.live.document import Document
from facewrinkle.live.library import Library
from facewrinkle.session import Folds, Pattern, Place, Session, Tear
from facewrinkle.session.content import MARK
from facewrinkle.session.parts import point_of, ranges
from facewrinkle.session.player import Player
from facewrinkle.session.session import START

FACE = built_in()
UNITS = [*FACE.atlas.action_units, *FACE.atlas.expressions, *FACE.atlas.muscles]
FRONT = np.flatnonzero(
    (FACE.points[:, 2] > FACE.landmarks["nose_tip"][2] - 35.0)
    & (np.abs(FACE.points[:, 1] - FACE.landmarks["nose_tip"][1]) < 70.0)
)
"""Vertices at which a page can be clicked."""


def numbers(kind):
    """Tables with some of the numbers of a part."""
    some = {name: st.floats(*limits, width=32) for name, limits in ranges(kind).items()}
    return st.fixed_dictionaries({}, optional=some)


PLACES = st.sampled_from(FRONT.tolist()).map(lambda vertex: FACE.points[vertex].tolist())
MIXTURES = st.dictionaries(st.sampled_from(UNITS), st.floats(0.0, 1.0, width=16), max_size=3)
KEYS = st.tuples(st.sampled_from(UNITS), st.lists(st.floats(0.0, 4.0, width=16), min_size=4, max_size=4)).map(
    lambda key: (
        {"unit": key[0], "weight": 0.75} | dict(zip(("onset", "apex", "offset", "end"), sorted(key[1]), strict=True))
    )
)
DOCUMENTS = st.fixed_dictionaries(
    {},
    optional={
        "mixture": MIXTURES,
        "mixtures": st.dictionaries(st.sampled_from(["My smile", "b"]), MIXTURES.filter(len), max_size=2),
        "intensity": st.floats(0.0, 1.0, width=16),
        "gaze": st.lists(st.floats(-30.0, 30.0, width=16), min_size=2, max_size=2),
        "folds": numbers(Folds).flatmap(lambda table: st.integers(0, 3).map(lambda seed: {**table, "seed": seed})),
        "regions": st.dictionaries(st.sampled_from(["forehead", "crow's feet", "nose"]), st.floats(0, 4, width=16)),
        "identity": st.dictionaries(st.sampled_from(["jaw", "sex", "lips"]), st.sampled_from([-1.0, 0.5]), max_size=1),
        "patterns": st.dictionaries(
            st.sampled_from("ab"),
            st.builds(
                lambda kind, center, size, depth: {"kind": kind, "center": center, "size": size, "depth": depth},
                st.sampled_from(["dimple", "eye_pouch"]),
                PLACES,
                st.floats(6.0, 20.0, width=16),
                st.floats(-2.0, 2.0, width=16),
            ),
            max_size=1,
        ),
        "landmarks": st.sampled_from([-1.5, 2.0]).map(
            lambda way: {"mouth_l": (FACE.landmarks["mouth_l"] + [0.0, way, 0.0]).tolist()}
        ),
        "probes": st.dictionaries(st.just("probe 1"), PLACES, max_size=1),
        "timeline": st.dictionaries(st.sampled_from("kl"), KEYS, max_size=2).map(lambda keys: {"keys": keys}),
        "time": st.floats(0.0, 4.0, width=16),
        "look": st.fixed_dictionaries(
            {}, optional={"view": st.sampled_from(sorted(fw.plotting.VIEWS)), "muscles": st.booleans()}
        ),
    },
)
"""What a page can set; tears have their own test, as they lie on a frame, and are none of it."""


def assert_same(one, other):
    """Assert that two frames are the same to the byte."""
    assert np.array_equal(one.regular_faces, other.regular_faces)
    assert np.asarray(one.points).tobytes() == np.asarray(other.points).tobytes()
    assert one.point_data.keys() == other.point_data.keys()
    for name in one.point_data:
        assert np.asarray(one.point_data[name]).tobytes() == np.asarray(other.point_data[name]).tobytes(), name


@pytest.mark.slow
@settings(
    max_examples=30,  # of 300, which take half an hour
    deadline=None,
    derandomize=True,
    phases=[Phase.generate],  # each takes seconds: too long to look for a smaller one that fails, too
    suppress_health_check=list(HealthCheck),
)
@given(DOCUMENTS)
def test_program_and_command_give_the_frame_of_the_studio_whatever_is_set(tmp_path, parts):
    library = Library(FACE)
    document = Document(FACE.atlas, library.accepted)
    document.change([((name,), value) for name, value in parts.items()])
    player = Player(document.session, library.subject_of(document.session))
    page = player.settled()
    path = library.outside(document.session).write(tmp_path / "session.json")
    session = Session.read(path)
    assert session == document.session
    command = ["express", "--session", str(path), "--save-mesh", "ply", "--no-movie", "--size", "16", "--quiet"]
    assert main([*command, "--out", str(tmp_path)]) == 0
    written = fw.write_mesh(page, tmp_path / "page" / "session.ply", player.face)
    assert (tmp_path / "session.ply").read_bytes() == written.read_bytes()
    words = {}
    exec(session.as_python().partition("style = ")[0], words)
    assert_same(words["frame"], page)


@pytest.mark.slow
def test_what_the_page_saves_everybody_can_make(tmp_path):
    """With tears, which lie on the frame: one .glb of the page, of the command line and of the program."""
    pytest.importorskip("aiohttp")
    from studio_pages import page

    from facewrinkle.live import Studio

    place = FACE.points[np.linalg.norm(FACE.points - FACE.landmarks["eye_l_inner"] - [4, -9, 0], axis=1).argmin()]
    with Studio(FACE, browser=False, save_to=tmp_path / "page") as studio:
        studio.change(mixture={"AU12L": 0.6, "AU4": 0.3}, tears={"t": {"start": place.tolist()}}, regions={"nose": 2.0})
        studio.frame()
        with page(studio) as seen:
            seen.settled(studio)
            paths = [
                Path(seen.ask("save", what=what, camera=[0.0, 0.0, 900.0, 0.0, 0.0, 0.0])["value"]["path"])
                for what in ("glb", "session")
            ]
    command = ["express", "--session", str(paths[1]), "--save-mesh", "glb", "--no-movie", "--size", "64"]
    assert main([*command, "--out", str(tmp_path / "command")]) == 0
    words = {}
    exec(Session.read(paths[1]).as_python().partition("style = ")[0], words)
    fw.write_mesh(words["frame"], tmp_path / "program.glb", words["face"], parts=True, tears=words["tears"])
    contents = [paths[0], tmp_path / "command" / f"{paths[1].stem}.glb", tmp_path / "program.glb"]
    one, *others = [path.read_bytes() for path in contents]
    assert others == [one, one]


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"mixture": {"AU99": 1.0}}, "unknown expression, action unit or muscle 'AU99'"),
        ({"look": {"view": "behind"}}, "unknown view 'behind'"),
        ({"look": {"size": [9, 100]}}, r"look.size\[0\] must be at least 16, received 9"),
        ({"look": {"view": [1, 2, 3]}}, "look.view must be a list of 6 entries"),
        ({"look": {"view": 3}}, "look.view must be a text or a list, received 3"),
        ({"tears": {"t": Tear(Place(1, (2.0, 0.0, 0.0)))}}, r"tears.t.start.shares\[0\] must be at most 1"),
        ({"folds": Folds(depth=9.0)}, "folds.depth must be at most 4, received 9.0"),
    ],
)
def test_what_is_not_allowed_is_a_sentence(parts, message):
    with pytest.raises(FaceWrinkleError, match=message):
        Session(**parts)


def test_a_place_stays_on_its_triangle_when_the_person_changes():
    place = Place.of(FACE.landmarks["nose_tip"], FACE.points, FACE.triangles)
    child = fw.default_face({"child": 1.0})
    expected = np.array(place.shares) @ child.points[child.triangles[place.triangle]] + place.offset
    np.testing.assert_allclose(place.on(child), expected)
    assert np.linalg.norm(expected - FACE.landmarks["nose_tip"]) > 3.0
    one, other = (Session(tears={"t": Tear(place)}, identity=who) for who in ({}, {"child": 1.0}))
    assert str(place.on(child)) in other.as_python()
    assert str(place.on(FACE)) in one.as_python()
    with pytest.raises(ParameterError, match="it was made on another face"):
        Place(4000, (1.0, 0.0, 0.0)).on(fw.surface(pv.Sphere()))


def test_a_session_of_the_first_version_opens():
    text = json.dumps({MARK: 1, "mixture": {"AU12": 0.5}, "probes": {"p": [0.0, 84.0, 100.0]}, "folds": {"age": 0.2}})
    session = Session.from_json(text)
    assert session == Session(mixture={"AU12": 0.5}, probes={"p": (0.0, 84.0, 100.0)}, folds=Folds(age=0.2))
    assert point_of(session.probes["p"], FACE) == [0.0, 84.0, 100.0]


def test_files_are_looked_for_beside_the_session(tmp_path):
    atlas = fw.write_atlas(FACE.with_expressions({"my doubt": "AU2L+AU14R"}).atlas, tmp_path / "mine.toml")
    path = Session(atlas=str(atlas), mixture={"my doubt": 1.0}).write(tmp_path / "a.json")
    path.write_text(path.read_text().replace(str(atlas), "mine.toml"))
    session = Session.read(path)
    assert session.atlas == str(atlas)
    assert "my doubt" in session.subject().face.atlas.expressions
    with pytest.raises(UnknownNameError, match="'my doubt'"):
        session.changed(atlas="")
    with pytest.raises(ParameterError, match="cannot be read"):
        Session.read(tmp_path / "b.json")


def test_numbers_told_at_probes_are_interpolated():
    frame = Session(mixture={"surprise": 1.0}).frame()
    rest, triangle = np.asarray(frame["rest"]), frame.regular_faces[np.abs(frame["W"]).argmax() % frame.n_cells]
    shares = np.array([0.2, 0.5, 0.3])
    told = fw.mesh.values_at(frame, "W", [shares @ rest[triangle]])
    np.testing.assert_allclose(told, [shares @ frame["W"][triangle]], atol=1e-6)
    with pytest.raises(UnknownNameError, match="'V'"):
        fw.mesh.values_at(frame, "V", [[0.0, 0.0, 0.0]])


def test_every_part_is_explained():
    explained = Session.__doc__.partition("Parameters\n")[2]
    assert all(f"    {field.name} : " in explained for field in fields(Session))


@pytest.mark.slow
def test_a_movie_shows_the_frames_and_a_picture_the_moment(tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    session = Session(mixture={"AU26": 1.0}, look={"size": (64, 48), "fps": 5.0})
    assert session.picture().shape == (48, 64, 3)
    moments = list(session.frames())
    assert [round(moment.time, 6) for moment in moments] == [round(0.2 * k, 6) for k in range(1, 13)]
    chin = np.argmin(np.linalg.norm(FACE.points - FACE.landmarks["pogonion"], axis=1))
    assert max(np.linalg.norm(moment.frame.points[chin] - FACE.points[chin]) for moment in moments) > 5.0
    from imageio_ffmpeg import count_frames_and_secs

    assert count_frames_and_secs(str(session.movie(tmp_path / "a.mp4")))[0] == 12


def test_a_pattern_is_that_of_its_kind():
    session = START.changed(patterns={"d": Pattern("dimple", (38.8, -30.8, 95.0), 12.0, 2.0)})
    assert session.frame()["W"].min() < -1.0
