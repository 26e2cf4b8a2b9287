"""Files that are sent to a studio: who may, what is taken, and that nothing stays.

the key and the origin | refused without
names, number and size | an error as a sentence
forms that make no sense | the same, and nothing in the terminal
forms that never end     | the same, after a while
what names other files | only those that were sent with it
undo                   | the face before
a take                 | a performer of its own in a Simulation, at rest
"""

import json
import select
import socket
import tempfile
from http.client import HTTPResponse
from pathlib import Path

import numpy as np
import pytest
from studio_pages import document, head_files, page, port, sent, until

import facewrinkle as fw
from facewrinkle.live import server
from facewrinkle.live.protocol import LARGEST_MESSAGE
from facewrinkle.session.player import layers_of


@pytest.fixture
def scan(face, tmp_path):
    return {name: (tmp_path / name).read_bytes() for name in head_files(face, tmp_path)}


@pytest.mark.slow
def test_a_scan_is_shown_and_undone(studio, scan, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    studio.change(mixture={"AU12": 1.0}, gaze=[10.0, 0.0])
    status, text = sent(studio, scan)
    assert status == 200
    studio.frame()
    assert document(studio)["face"] == json.loads(text)["name"]  # "head.ply", or with a number if that is open
    assert document(studio)["face"].startswith("head.ply")
    assert studio.face.texture is None
    assert (studio.rates, document(studio)["gaze"]) == ({}, [0.0, 0.0])  # the expression does not jump onto it
    assert not list(tmp_path.glob("facewrinkle-*"))
    studio.undo()
    studio.frame()
    assert studio.face.texture is not None
    assert studio.rates == {"AU12": 1.0}


def test_a_take_moves_the_face_that_is_shown(studio, face):
    """As the performer of takes moves it; what lies on the face stays."""
    dimple = {"kind": "dimple", "center": [38.8, -30.8, 95.0], "size": 12.0, "depth": 2.0, "strength": 1.0}
    studio.change(patterns={"d": dimple})
    rest = studio.frame()
    rows = ["0,0,0,0,0", *(f"{t},0.8,0.5,1,0.5" for t in (0.5, 1.0, 1.5, 2.0))]
    table = "time,jawOpen,mouthSmileLeft,jawLeft,wink\n" + "\n".join(rows)
    status, text = sent(studio, {"take.csv": table.encode()})
    answer = json.loads(text)
    assert (status, answer["plays"]) == (200, True)
    assert "wink" in " ".join(answer["said"])
    assert (document(studio)["face"], document(studio)["take"]) == ("", answer["name"])
    assert document(studio)["timeline"]["length"] == 2.0
    assert list(document(studio)["patterns"]) == ["d"]
    studio.stage.go_to(1.5)
    frame = studio.frame()
    weights = {"jawOpen": [0.8, 0.8], "mouthSmileLeft": [0.5, 0.5], "jawLeft": [1.0, 1.0]}
    take = fw.Take(tuple(weights), np.array([0.0, 9.0]), np.array(list(weights.values())).T)
    layers = layers_of(studio.session, face)
    *_, own = fw.Simulation(face, layers=layers, motion=fw.Performer(take, face)).run(60)
    n = face.mesh.n_points
    moved = [np.asarray(each.points)[:n] for each in (frame, own, rest)]
    assert np.abs(moved[0] - moved[1]).max() < 0.1
    assert np.abs(moved[0] - moved[2]).max() > 10.0
    assert studio.stage.shown.rates["zygomaticus_major_l"] == pytest.approx(0.5, abs=0.1)  # and so redden the fibers
    with page(studio) as seen:
        welcome = seen.heard("welcome")
    assert set(welcome["off"].values()) == {"a recorded animation moves this face"}
    assert welcome["contracts"]
    studio.stage.go_to(0.0)
    assert np.abs(np.asarray(studio.frame().points)[:n] - moved[2]).max() < 0.1
    studio.undo()
    assert document(studio)["take"] == ""


def test_a_take_of_mediapipe_is_opened_as_one(studio):
    shapes = [{"categoryName": name, "score": 0.5} for name in ("_neutral", "jawOpen", "mouthSmileLeft")]
    frames = [{"timestamp": 40 * k, "faceBlendshapes": [{"categories": shapes}]} for k in range(51)]
    status, text = sent(studio, {"take.json": json.dumps({"results": frames}).encode()})
    assert (status, json.loads(text)["plays"]) == (200, True)
    assert document(studio)["take"] == "take.json"
    assert document(studio)["timeline"]["length"] == 2.0


def test_a_take_of_which_the_face_makes_nothing_is_a_sentence(studio):
    status, text = sent(studio, {"take.csv": b"hair,nose\n1,2\n"})
    assert (status, "no column of a shape" in json.loads(text)["error"]) == (400, True)
    assert document(studio)["face"] == ""


def test_a_session_is_opened_however_long_it_is(studio):
    """64 expressions of 512 names are allowed: far more than a message of the socket may have."""
    names = [*studio.face.atlas.action_units, *studio.face.atlas.muscles, *studio.face.atlas.expressions]
    long = {f"mine {k}": dict.fromkeys(names, 0.25) for k in range(64)}
    studio.change(mixtures=long, intensity=0.5)
    text = json.dumps({"facewrinkle session": 1, **document(studio)})
    assert len(text) > 2 * LARGEST_MESSAGE
    studio.change(mixtures={}, intensity=1.0)
    assert sent(studio, {"session.json": text.encode()})[0] == 200
    assert document(studio)["mixtures"] == long
    assert document(studio)["intensity"] == 0.5
    status, answer = sent(studio, {"session.json": b"[]"})
    assert status == 400
    assert "has no frames" in answer
    assert document(studio)["mixtures"] == long


@pytest.mark.parametrize("how", [{"key": ""}, {"key": "wrong"}, {"origin": "http://evil.example"}, {"origin": ""}])
def test_others_may_not_send_files(studio, how):
    assert sent(studio, {"head.ply": b""}, **how)[0] == 403
    assert document(studio)["face"] == ""


def test_bad_files_are_sentences(studio, monkeypatch):
    for name in ("head.ply", "../head.ply"):
        status, text = sent(studio, {name: b"nonsense"})
        assert status == 400
        assert tempfile.gettempdir() not in text
    assert not Path(tempfile.gettempdir(), "head.ply").exists()
    monkeypatch.setattr(server, "LARGEST_UPLOAD", 100)
    status, text = sent(studio, {"head.ply": b"x" * 101})
    assert (status, "Too Large" in text) == (400, True)
    assert document(studio)["face"] == ""


FILE = b'--x\r\nContent-Disposition: form-data; name=a; filename="a.ply"\r\n\r\n'
FORM = "multipart/form-data; boundary=x"


def request(studio, body, kind=FORM, length=None):
    """A form as it is sent; more of it may be promised."""
    address, _, key = studio.url.partition("/#")
    lines = [
        "POST /open HTTP/1.1", f"Host: {address.removeprefix('http://')}", f"Origin: {address}", f"X-Key: {key}",
        f"Content-Type: {kind}", f"Content-Length: {length or len(body)}", "Connection: close", "", "",
    ]  # fmt: skip
    return "\r\n".join(lines).encode() + body


def answer(studio, *form, **more):
    """The status and the text that a form is answered with."""
    with socket.create_connection(("127.0.0.1", port(studio)), timeout=20.0) as page:
        page.sendall(request(studio, *form, **more))
        told = HTTPResponse(page)
        told.begin()
        return told.status, told.read().decode()


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        ("text/plain", b"abc"),
        ("multipart/form-data", b"abc"),
        ("multipart/form-data; boundary=" + "x" * 200, b"abc"),
        (FORM, b"abc"),
        (FORM, b"--x\r\n" + b"a" * 20_000),
        (FORM, b"--x\r\n\r\nabc"),
        (FORM, FILE + b"abc"),
    ],
)
def test_bad_forms_are_sentences(studio, kind, body, caplog):
    status, text = answer(studio, body, kind)
    assert status == 400
    assert json.loads(text)["error"].endswith(".")
    assert not caplog.records


def test_a_page_that_trickles_is_told_that_it_took_too_long(studio, monkeypatch, caplog):
    monkeypatch.setattr(server, "UPLOAD_TIME", 0.2)
    with socket.create_connection(("127.0.0.1", port(studio)), timeout=20.0) as page:
        page.sendall(request(studio, FILE, length=len(FILE) + 200))
        left = 200  # 10 s
        while left and not select.select([page], [], [], 0.05)[0]:
            page.sendall(b"a")
            left -= 1
        told = HTTPResponse(page)
        told.begin()
        assert told.status == 400
        assert "0.2 s" in json.loads(told.read())["error"]
        page.sendall(left * b"a")
    assert not caplog.records


def test_a_page_that_leaves_while_it_sends_is_no_error(studio, caplog):
    def folders():
        return set(Path(tempfile.gettempdir()).glob("facewrinkle-*"))

    before = folders()
    with socket.create_connection(("127.0.0.1", port(studio))) as page:
        page.sendall(request(studio, FILE + b"abc", length=100_000))
        until(lambda: folders() != before)
    until(lambda: folders() == before)
    assert not caplog.records


def test_a_file_cannot_fetch_others(studio, scan, tmp_path):
    """The materials name a file of the computer: it is not read."""
    from PIL import Image

    secret = tmp_path / "secret.png"
    Image.new("RGB", (4, 4), (255, 0, 0)).save(secret)
    lines = ["mtllib head.mtl", "usemtl skin"]
    from facewrinkle.mesh import read_surface

    (tmp_path / "head.ply").write_bytes(scan["head.ply"])
    mesh = read_surface(tmp_path / "head.ply")
    lines += [f"v {x} {y} {z}" for x, y, z in mesh.points]
    lines += ["vt 0 0", "vt 1 0", "vt 0 1"]
    lines += [f"f {a + 1}/1 {b + 1}/2 {c + 1}/3" for a, b, c in mesh.regular_faces]
    files = {
        "head.obj": "\n".join(lines).encode(),
        "head.mtl": f"newmtl skin\nmap_Kd {secret}\n".encode(),
        "head.json": scan["head.json"],
    }
    status, text = sent(studio, files)
    assert status in (200, 400)
    studio.frame()
    shown = studio.face.texture
    assert shown is None or not (shown.reshape(-1, 3) == [255, 0, 0]).all(axis=1).any(), text
