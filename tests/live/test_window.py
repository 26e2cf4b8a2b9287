"""The object that users hold, against simulations of their own.

rates, frame, undo          | the same asked of a Simulation
folds of one side           | none, against a simulation without waves; the other side
copied Python               | run, it gives the frame that is shown
saved files                 | in one folder, never over another file
live weights                | units of ARKit's shapes
sliders that do nothing     | their reasons, on faces without eyes, mouth or muscles
handles of muscles          | every muscle that pulls has one on the skin, apart from others; sides are mirrored
a disk that is full         | told once, and the session is saved at the end, when there is room again
what cannot be done         | a sentence, and the document as it was
"""

import ast
import functools
import json
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
import pyvista as pv
from expressions import settled
from PIL import Image
from studio_pages import document, page, sent

import facewrinkle as fw
from facewrinkle.errors import (
    FaceWrinkleError,
    MissingPackageError,
    OutputError,
    ParameterError,
    UnknownNameError,
)
from facewrinkle.live import saving
from facewrinkle.live.answers import ROOM, mixture_of_live, pulls_of, without_effect
from facewrinkle.live.document import Document
from facewrinkle.live.saving import atlas_with, environment
from facewrinkle.session.player import Player, layers_of
from facewrinkle.session.session import START

CAMERA = [700.0, 200.0, 1100.0, 0.0, 0.0, 0.0]


def test_a_frame_is_that_of_a_settled_simulation(studio, face):
    studio.rates = {"AU4": 1.0}
    assert studio.rates == {"AU4": 1.0}
    own = settled(fw.Simulation(face), {"AU4": 1.0})
    n = face.mesh.n_points
    assert np.abs(np.asarray(studio.frame().points)[:n] - np.asarray(own.points)[:n]).max() < 0.05
    assert studio.undo()
    assert studio.rates == {}
    with pytest.raises(UnknownNameError, match="'AU99'"):
        studio.rates = {"AU99": 1.0}


@pytest.mark.slow
def test_folds_of_one_side_can_be_changed(studio, face):
    """With none on the left, the left has the anatomical creases alone; the right is as it was, but for the fifth, at
    most, by which heights are leveled.
    """
    studio.rates = {"AU6": 1.0, "AU12": 1.0}
    n, left = face.mesh.n_points, face.points[:, 0] > 10.0
    even = studio.frame()["W"][:n]
    studio.change(folds={**document(studio)["folds"], "left": 0.0})
    bare = studio.frame()["W"][:n]
    creases = settled(fw.Simulation(face, layers=[fw.Creases()]), {"AU6": 1.0, "AU12": 1.0})["W"][:n]
    right = face.points[:, 0] < -10.0
    assert np.abs(bare - creases)[left].max() < 0.02
    leveled = np.abs(even - creases) + np.abs(creases)  # each by itself, and they may cancel
    assert (np.abs(bare - even) <= 0.2 * leveled + 1e-3)[right].all()
    assert np.abs(bare - even)[left].max() > 0.1
    feet = np.linalg.norm(face.points - face.landmarks["eye_l_outer"], axis=1)
    studio.change(folds={**document(studio)["folds"], "left": 1.0}, regions={"crow's feet": 0.0})
    without = studio.frame()["W"][:n]
    assert np.abs(without - creases)[feet < 0.1 * face.frame.pupil_distance].max() < 0.02
    assert np.abs(without - even)[face.points[:, 1] < face.landmarks["nose_tip"][1]].max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("shows", [{"name": None}, {"name": None, "muscles": True}, {"name": "W"}])
def test_copied_python_gives_what_is_shown_its_picture_and_probes(studio, tmp_path, monkeypatch, capsys, shows):
    def vertex(mark, aside):
        return studio.face.points[
            np.linalg.norm(studio.face.points - studio.face.landmarks[mark] - aside, axis=1).argmin()
        ]

    key = {"unit": "AU26", "weight": 0.5, "onset": 0.0, "apex": 0.5, "offset": 1.0, "end": 2.0}
    on_crease = vertex("mouth_l", [9.0, 9.0, 0.0])
    studio.change(
        mixture={"AU1": 1.0, "AU2": 0.5, "AU12": 1.0},
        gaze=[12.0, -5.0],
        patterns={"d": {"kind": "dimple", "center": [38.8, -30.8, 95.0], "size": 12.0, "depth": 2.0}},
        regions={"forehead": 0.5},
        tears={"t": {"start": vertex("eye_r_inner", [0.0, -6.0, 0.0]).tolist()}},
        probes={"probe 1": on_crease.tolist()},
        timeline={"length": 2.0, "loop": True, "keys": {"k": key}},
    )
    studio.stage.go_to(0.5)
    frame = studio.frame()
    with page(studio) as seen:
        seen.ask("field", **shows)
        seen.settled(studio)
        path = seen.ask("save", what="picture", camera=CAMERA)["value"]["path"]
        program = seen.ask("copy", camera=CAMERA)["value"]
        seen.ask("field", name=None)
        seen.settled(studio)
        plain = seen.ask("save", what="picture", camera=CAMERA)["value"]["path"]
    monkeypatch.chdir(tmp_path)
    words = {}
    exec(program, words)
    n = studio.face.mesh.n_points
    assert np.abs(np.asarray(frame.points)[:n] - np.asarray(words["frame"].points)[:n]).max() < 0.1
    assert np.abs(np.asarray(frame["W"])[:n] - np.asarray(words["frame"]["W"])[:n]).max() < 0.05
    assert words["frame"]["W"].min() == pytest.approx(frame["W"].min(), abs=0.05)
    told = ast.literal_eval(capsys.readouterr().out.splitlines()[-1])
    nearest = np.linalg.norm(frame["rest"] - on_crease, axis=1).argmin()
    assert told == {"probe 1": pytest.approx(frame["W"][nearest], abs=0.05)}
    ours, theirs, bare = (np.asarray(Image.open(each), float) for each in (path, tmp_path / "picture.png", plain))
    apart = np.abs(ours - theirs).max(axis=2)
    assert apart.mean() < 0.5
    assert (apart > 40.0).mean() < 1e-3
    assert (np.abs(ours - bare).max(axis=2).mean() > 1.0) == (shows != {"name": None})


def private_names(program):
    """What a program uses of the package that is not public."""
    found = set()
    for node in ast.walk(ast.parse(program)):
        text = ast.unparse(node)
        if isinstance(node, ast.Import | ast.ImportFrom) and text != "import facewrinkle as fw":
            found.add(text)
        if isinstance(node, ast.Attribute) and text.startswith("fw."):
            *rooms, name = text.split(".")[1:]
            if name not in getattr(functools.reduce(getattr, rooms, fw), "__all__", ()):
                found.add(text)
    return found


@pytest.mark.parametrize(
    ("path", "clip"),
    [("", None), ("head.face", None), ("head.obj", None), ("head.glb", "recorded"), ("head.face", "take")],
)
def test_copied_python_uses_public_names_alone(face, path, clip):
    assert private_names("import facewrinkle.live\nfw.live.stage\nfw.plotting.Style(fw.Face)") == {
        "import facewrinkle.live", "fw.live.stage",
    }  # fmt: skip
    place = face.landmarks["nose_tip"].tolist()
    session = fw.Session(
        face=path,
        landmarks={"mouth_l": face.landmarks["mouth_l"].tolist()},
        mixture={"AU12": 1.0},
        gaze=(1.0, 2.0),
        folds={"depth": 0.5, "left": 2.0, "age": 0.5, "seed": 3},
        regions={"nose": 2.0, "chin": 1.0},
        identity={"jaw": 1.0},
        patterns={"b": {"kind": "dimple", "center": place, "size": 12.0, "depth": 1.0}},
        tears={"a": {"start": place}},
        probes={"c": place},
        take="take.csv" if clip == "take" else "",
        look=fw.session.Look(view="mouth", field="W", muscles=True),
    )
    clips = {
        "recorded": fw.Recorded.of_positions([face.points, face.points], fps=1.0),
        "take": fw.Take(("jawOpen",), [0.0, 1.0], [[0.0], [1.0]]),
    }
    program = session.as_python(fw.session.Subject(face, clips.get(clip)))
    assert program.count("fw.") >= 9
    assert "{'left': 2.0, 'nose': 2.0}" in program
    assert private_names(program) == set()


def test_kept_expressions_of_an_atlas_mean_nothing_else(face, tmp_path):
    names = ("closing-eye", "a b", "a-b", "AU12", "studio", "zygomaticus_major")
    document = Document(face.atlas)
    document.change([(("mixture", "AU4"), 1.0), *((("mixtures", name), {"AU26": 0.5}) for name in names)])
    path = tmp_path / "atlas.toml"
    path.write_text(atlas_with(face, document.session))
    atlas, jaw = fw.read_atlas(path), face.atlas.contractions({"AU26": 0.5})
    assert atlas.expressions == {
        **face.atlas.expressions,
        "studio": face.atlas.resolve("AU4"),
        **dict.fromkeys(("closing_eye_2", "a_b", "a_b_2", "AU12_2", "studio_2", "zygomaticus_major_2"), jaw),
    }
    for name in ("AU12", "zygomaticus_major"):
        assert atlas.resolve(name) == face.atlas.resolve(name)


@pytest.mark.slow
def test_movies_animations_and_atlases_are_saved(studio):
    key = {"unit": "AU26", "weight": 1.0, "onset": 0.0, "apex": 0.1, "offset": 0.2, "end": 0.2}
    timeline = {"length": 0.2, "loop": False, "keys": {"k": key}}
    studio.change(timeline=timeline, mixtures={"My smile": {"AU12": 1.0}}, look={"size": [320, 240]})
    with page(studio) as seen:
        seen.frame()
        seen.send("save", id=900, what="movie", camera=CAMERA)
        seen.until(lambda got: got.get("text") == "Movie")
        seen.send("change", patches=[[["mixture", "AU12L"], 0.5]], gesture="")
        for _ in range(3):  # the face goes on meanwhile
            assert "step" in seen.until(lambda got: "step" in got or got.get("id") == 900)
        paths = {"movie": seen.until(lambda got: got.get("id") == 900)["value"]["path"]}
        for what in ("animation", "atlas", "face"):
            paths[what] = seen.ask("save", what=what, camera=CAMERA)["value"]["path"]
        told = {got["text"] for got in seen.texts if got["is"] == "progress"}
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    assert ffmpeg.count_frames_and_secs(paths["movie"])[0] == 5  # 0.2 s of 25 pictures
    with closing(ffmpeg.read_frames(paths["movie"])) as film:
        assert next(film)["size"] == (320, 240)
    _, recorded = fw.read_animation(paths["animation"], mesh="face")
    assert recorded.duration == pytest.approx(0.16)
    atlas = fw.read_atlas(paths["atlas"])
    assert atlas.expressions["studio"] == {"zygomaticus_major_l": 0.5}
    assert atlas.expressions["My_smile"] == {"zygomaticus_major_l": 1.0, "zygomaticus_major_r": 1.0}
    assert fw.read_face(paths["face"]).mesh.n_points == studio.face.mesh.n_points
    assert told >= {"Movie", "Animation", ""}  # the last of which ends the bar


def test_what_cannot_be_made_is_taken_back_with_a_sentence(studio):
    with page(studio) as seen:
        seen.frame()
        seen.send("change", patches=[[["tears", "far"], {"start": [5000.0, 0.0, 0.0]}]], gesture="")
        assert seen.heard("error")["text"].startswith("start must lie on the surface")
        while [got for got in seen.texts if got["is"] == "document"][-1]["data"]["tears"]:
            seen.receive()  # it may have come before the sentence
    assert document(studio)["tears"] == {}


@pytest.mark.slow
def test_pictures_meshes_and_sessions_are_saved_in_one_folder(studio, saved):
    with page(studio) as seen:
        seen.frame()
        paths = [
            Path(seen.ask("save", what=what, camera=CAMERA)["value"]["path"]) for what in ("picture", "glb", "glb")
        ]
    assert len(set(paths)) == 3
    assert all(path.parent == saved.resolve() for path in paths)
    assert pv.read(paths[0]).dimensions[:2] == (1200, 1200)
    assert paths[1].read_bytes()[:4] == b"glTF"


def test_no_picture_is_drawn_while_a_file_is_read(studio, monkeypatch):
    """VTK in two threads at once may wait for ever: here reading ends only once the picture was asked for."""
    events, reading, asked, drawing = [], threading.Event(), threading.Event(), threading.Event()

    def opened(*_):
        reading.set()
        assert asked.wait(20.0)
        drawing.wait(0.3)
        events.append("read")
        raise ParameterError("no face")

    def save(*_):
        drawing.set()
        events.append("drawn")
        return "drawn.png", b""

    monkeypatch.setattr("facewrinkle.live.answers.opened", opened)
    monkeypatch.setattr("facewrinkle.live.answers.save", save)
    with ThreadPoolExecutor() as pool:
        read = pool.submit(sent, studio, {"head.ply": b""})
        assert reading.wait(20.0)
        with page(studio) as seen:
            seen.send("save", id=1, what="picture", camera=CAMERA)
            seen.until(lambda got: got.get("text") == "Saving")
            asked.set()
            assert seen.until(lambda got: got.get("id") == 1)["value"]["name"] == "drawn.png"
        status, text = read.result(20.0)
    assert (status, "no face" in text) == (400, True)
    assert events == ["read", "drawn"]


def test_live_weights_are_units_or_shapes(face):
    assert mixture_of_live({"mouthSmileLeft": 0.5, "jawOpen": 1.0, "AU4": 0.2}, face) == {
        "AU12L": 0.5, "AU27": 1.0, "AU4": 0.2,
    }  # fmt: skip
    assert mixture_of_live({}, face) == {}
    with pytest.raises(ParameterError, match="none of the names"):
        mixture_of_live({"hairLong": 1.0}, face)


def test_the_timeline_plays_and_is_scrubbed(studio):
    key = {"unit": "AU26", "weight": 1.0, "onset": 0.0, "apex": 0.4, "offset": 1.0, "end": 2.0}
    studio.change(timeline={"length": 2.0, "loop": True, "keys": {"k": key}})
    n = studio.face.mesh.n_points
    closed = np.asarray(studio.frame().points)[:n]
    studio.stage.go_to(0.7)
    assert np.abs(np.asarray(studio.frame().points)[:n] - closed).max() > 5.0
    studio.stage.play(True)
    with pytest.raises(FaceWrinkleError, match="still moves after 0.3 s"):
        studio.frame(timeout=0.3)
    studio.stage.play(False)


def test_the_playhead_stays_on_a_timeline_that_becomes_shorter(studio):
    studio.change(timeline={"length": 100.0})
    studio.stage.go_to(90.0)
    studio.frame()
    studio.change(timeline={"length": 4.0})
    studio.frame()
    assert studio.stage.shown.time == 4.0
    assert studio.session.time == 4.0


def test_a_slow_machine_plays_in_real_time(studio, monkeypatch):
    step = Player.step

    def slow(*arguments):
        time.sleep(0.1)
        return step(*arguments)

    monkeypatch.setattr(Player, "step", slow)
    studio.change(timeline={"length": 60.0, "loop": True, "keys": {}})
    stage, moments = studio.stage, []
    stage.play(True)
    for _ in range(12):
        with stage.condition:
            stage.condition.wait(5.0)
            moments.append((stage.shown.time, time.monotonic(), stage.shown.step))
    stage.play(False)
    shown, passed, steps = np.subtract(moments[-1], moments[1])
    assert shown == pytest.approx(passed, abs=0.4)
    assert shown > 2.0 * steps * stage.time_step


def test_a_session_that_could_not_be_saved_is_saved_at_the_end(face, tmp_path, monkeypatch, capsys):
    with fw.live.Studio(face, browser=False, save_to=tmp_path) as studio:
        with page(studio) as seen, monkeypatch.context() as disk:
            disk.setattr(saving, "write_whole", Mock(side_effect=OutputError("no space left.")))
            seen.change("intensity", 0.3)
            told = seen.heard("error")["text"]
        assert "no space left" in told
        assert not list(tmp_path.iterdir())
    assert json.loads((tmp_path / "session.json").read_text())["intensity"] == 0.3
    assert capsys.readouterr().err.splitlines() == [told]


@pytest.mark.slow
def test_a_program_that_ends_without_closing_the_studio_has_saved(tmp_path):
    program = "import facewrinkle as fw; fw.studio(browser=False, save_to='.').rates = {'AU12': 0.5}"
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=environment(), check=True, timeout=120)
    assert json.loads((tmp_path / "session.json").read_text())["mixture"] == {"AU12": 0.5}


def test_a_widget_without_anywidget_says_what_to_install(studio, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "facewrinkle.live.widget", raising=False)
    with pytest.raises(MissingPackageError, match=r"the widget needs .*pip install \"facewrinkle\[studio\]\""):
        studio.widget()


@pytest.mark.slow
def test_without_its_package_the_studio_says_what_to_install():
    program = """
import sys
sys.modules["aiohttp"] = None
import facewrinkle as fw
from facewrinkle.cli import main
from facewrinkle.errors import MissingPackageError
try:
    fw.studio
except MissingPackageError as error:
    print(error)
sys.exit(main(["studio", "--no-browser"]))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment())
    message = "the studio needs the package aiohttp, which is not installed. To install it: "
    message += 'pip install "facewrinkle[studio]"'
    assert done.stdout.splitlines() == [message]
    assert (done.returncode, done.stderr.splitlines()) == (1, [f"facewrinkle: {message}"])


# --- what a page is told of a face ----------------------------------------------------------------


def test_sliders_that_do_nothing_say_why(face):
    shut = SimpleNamespace(atlas=face.atlas, muscles=face.muscles, mouth_opens=False, eyelid_openings={}, eyes=())
    off = without_effect(shut)
    assert "mouth" in off["AU26"]
    assert "lids" in off["AU43"]
    assert "eyes" in off["gaze"]
    assert "AU12" not in off
    assert without_effect(face) == {}
    bare = SimpleNamespace(atlas=face.atlas, muscles={})
    assert set(without_effect(bare).values()) == {"this surface has no muscles"}


def test_each_muscle_that_pulls_has_a_handle_of_its_own(face):
    pulls = pulls_of(face)
    pulling = {name for name, muscle in face.muscles.items() if np.abs(muscle.force(face.points)).max() > 0.0}
    assert set(pulls) == pulling | {"jaw"}
    places = np.array([face.points[each["vertex"]] + each["offset"] for each in pulls.values()])
    seen = places @ face.frame.axes[:2].T
    apart = np.linalg.norm(seen[:, None] - seen, axis=2) + 1e9 * np.eye(len(seen))
    assert apart.min() > 0.5 * ROOM * face.frame.pupil_distance
    assert max(np.linalg.norm(each["offset"]) for each in pulls.values()) < 0.25 * face.frame.pupil_distance
    for name in pulls:
        if name.endswith("_l"):
            left, right = (np.array(pulls[each]["pull"]) for each in (name, f"{name[:-2]}_r"))
            assert np.abs(left * [-1.0, 1.0, 1.0] - right).max() < 0.02


def test_a_depth_goes_to_all_layers_and_into_what_is_written_down(face):
    session = fw.Session(mixture={"AU12": 1.0}, folds=fw.session.Folds(depth=0.8))
    assert {layer.depth for layer in layers_of(session, face)} == {0.8}
    assert "layers = fw.fold_layers(face, 'wave', depth=0.8)" in session.as_python().splitlines()
    assert "depth" not in START.as_python()
