"""The server of the studio, over real sockets.

frames that a page was sent                 | the frame of the simulation, to the step of the quantization
colors of a person                         | of the eyes, the brows and the photo of the skin
who may connect: key, origin, host          | refused with the right code, and nobody else notices
messages: oversized, malformed              | an answer without a traceback, or the end of that page
an error in the simulation                  | is told; the next change goes on
a page that stalls or vanishes              | others go on at their pace; no more than one frame is under way to it
300 wishes in 2 s                           | the last is shown at once after
files of the page                           | only those of the package; a strict content policy
"""

import socket
import time
from contextlib import suppress
from http.client import HTTPConnection
from io import BytesIO
from unittest.mock import Mock

import aiohttp
import numpy as np
import pytest
from PIL import Image
from studio_pages import document, page, pages, port, restored, root

import facewrinkle as fw
from facewrinkle.appearance.smooth_skin import SmoothSkin
from facewrinkle.live.document import Document
from facewrinkle.live.library import Library
from facewrinkle.live.protocol import LARGEST_MESSAGE
from facewrinkle.live.server import page_files
from facewrinkle.live.stage import Stage
from facewrinkle.session.player import eased


@pytest.fixture
def seen(studio):
    """A page that has drawn its first frame."""
    with page(studio) as seen:
        seen.frame()
        yield seen


def test_a_frame_is_that_of_the_simulation(studio, seen):
    seen.change("mixture", "surprise", 1.0)
    seen.settled(studio)
    frame, skin, box = studio.frame(), seen.arrays["skin"], seen.head["box"]
    origin, triangles = studio.stage.parts.origin, np.vstack([skin[name] for name in ("index", "lined")])
    used = np.unique(triangles)
    shown, smooth = restored(skin["position"], box), SmoothSkin(studio.face, fw.mesh.with_normals(frame))
    assert np.abs(shown - smooth.points[origin])[used].max() <= 0.5001 * box[3] / 65535
    normals = skin["normal"][:, :3] / 127.0
    assert np.abs(normals - np.asarray(frame["Normals"])[origin])[used].max() <= 0.5001 / 127.0
    drawn = origin[triangles.astype(int)]
    faces = {tuple(sorted(triangle)) for triangle in np.asarray(frame.regular_faces).tolist()}
    assert {tuple(sorted(triangle)) for triangle in drawn.tolist()} == faces
    assert frame.n_cells > studio.face.mesh.n_cells  # it was refined
    assert seen.photos["skin"][:2] == b"\xff\xd8"  # the texture came as JPEG


def test_colors_of_a_person_are_shown(studio, seen):
    def colors(**person):
        seen.change("identity", person)
        seen.settled(studio)
        skin = Image.open(BytesIO(seen.photos["skin"])).convert("L")
        return seen.arrays["eye_l"]["color"].mean(axis=0), seen.arrays["brows"]["tint"].mean(), np.percentile(skin, 2)

    blue, fair, shaved = colors(iris=-1.0, hair=-1.0, hair_density=-1.0)
    brown, black, dense = colors(iris=1.0, hair=1.0, hair_density=1.0)
    assert blue[2] - blue[0] > brown[2] - brown[0] + 10.0
    assert fair > black + 10.0
    assert shaved > dense + 50.0


def test_the_frames_of_the_studio_are_those_of_a_simulation_of_its_own(face):
    """Nothing is asked but the expression; the same steps in a Simulation give the very same points."""
    document = Document(face.atlas)
    document.change([(("mixture",), {"AU12": 0.8, "AU4": 0.3})])
    stage, frames = Stage(Library(face), document), []
    stage.listeners.append(lambda: frames.append(stage.shown.frame))
    stage.start()
    try:
        with stage.condition:
            assert stage.condition.wait_for(lambda: len(frames) > 12, 60.0)
    finally:
        stage.close()
    sim, rates = fw.Simulation(face), {}
    target = face.atlas.contractions({"AU12": 0.8, "AU4": 0.3})
    for frame in frames[:12]:
        rates = eased(rates, target)
        sim.contract(rates)
        sim.look()
        own = sim.step()
        assert np.array_equal(own.points, frame.points)
        assert np.array_equal(own.faces, frame.faces)


@pytest.mark.parametrize("key", ["", "wrong", "x" * 32, "ключ", "\ud800"])
def test_without_the_key_nothing_is_told(studio, key):
    with page(studio, key=key) as seen:
        assert seen.receive() is None
        assert seen.socket.close_code == 1008


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1"])
def test_foreign_origins_are_refused(studio, origin):
    with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
        page(studio, origin=origin)
    assert refused.value.status == 403


def test_requests_that_make_no_sense_are_refused_in_silence(studio, capfd, caplog):
    host = root(studio).removeprefix("http://").encode()
    found = []
    for request in (b"POST /open", b"GET /" + b"a" * 9000, b"GET /%ff%00", b"GET /download/%ff", b"\xff /"):
        with socket.create_connection(("127.0.0.1", port(studio)), timeout=20.0) as page:
            page.sendall(request + b" HTTP/1.1\r\nHost: %b\r\nOrigin: http://%b\r\nX-Key: \xff\r\n\r\n" % (host, host))
            found.append(page.recv(100).split()[1])
    assert found == [b"403", b"400", b"404", b"404", b"400"]
    assert capfd.readouterr() == ("", "")
    assert not caplog.records


def got(address, path, **headers):
    """Status, headers and text that a path is answered with."""
    connection = HTTPConnection(address, timeout=20.0)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    text = response.read().decode()
    connection.close()
    return response.status, dict(response.headers), text


def test_foreign_hosts_and_unknown_files_are_refused(studio):
    address = root(studio).removeprefix("http://")
    assert got(address, "/", Host="evil.example")[0] == got(address, "/socket")[0] == 403
    for path in ("/pyproject.toml", "/..%2f..%2f__init__.py", "/%2e%2e/server.py", "/download/nothing"):
        status, _, text = got(address, path)
        assert status == 404
        assert "Traceback" not in text


@pytest.mark.parametrize("name", ["", *sorted(page_files().keys() - {"index.html"})])
def test_the_page_has_a_strict_content_policy(studio, name):
    status, headers, text = got(root(studio).removeprefix("http://"), f"/{name}")
    assert status == 200
    assert headers["Content-Security-Policy"].startswith("default-src 'none'")
    assert "unsafe" not in headers["Content-Security-Policy"]
    assert headers["X-Content-Type-Options"] == "nosniff"
    text = text.replace("http://www.w3.org/2000/svg", "")
    assert "http://" not in text
    assert "https://" not in text


def test_with_all_addresses_those_at_which_requests_come_in_are_hosts(face):
    """127.0.0.2 stands for the address of another network: it is one of this computer, and not the usual one."""
    with fw.live.Studio(face, host="0.0.0.0", browser=False) as everywhere:
        shown, port = everywhere.url.split("/")[2].rsplit(":", 1)
        assert shown != "0.0.0.0"
        for address in ("127.0.0.1", "127.0.0.2", "localhost", shown):
            for host in (f"{address}:{port}", address):  # browsers leave port 80 out
                status, headers, _ = got(f"{address}:{port}", "/", Host=host, Origin=f"http://{host}")
                assert status == 200
                assert f"ws://{host};" in headers["Content-Security-Policy"]
        for host in ("evil.example", f"evil.example:{port}", f"127.0.0.3:{port}", "127.0.0.1:1"):
            assert got(f"127.0.0.2:{port}", "/", Host=host, Origin=f"http://{host}")[0] == 403


def test_a_port_in_use_is_an_error(face):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(
            fw.errors.ParameterError, match=rf"cannot listen at 127.0.0.1, port {port}: .*Choose another port"
        ):
            fw.live.Studio(face, port=port, browser=False)


def test_bad_messages_are_answered_without_a_traceback(studio, seen):
    before = document(studio)
    for text in (
        "nonsense", "[]", "{}", '{"do": 3}', '{"do": "reboot"}', '{"do": "change"}', '{"do": "undo", "now": 1}',
        '{"do": "change", "patches": [[["mixture", "AU99"], 1]], "gesture": ""}',
        '{"do": "change", "patches": [[["mixture", "AU12"], 7]], "gesture": ""}',
        '{"do": "change", "patches": [[["__class__"], 1]], "gesture": ""}',
        '{"do": "change", "patches": [[["folds", "depth"], NaN]], "gesture": ""}',
        '{"do": "probe", "corners": [1, 2, 99999999], "shares": [0, 0, 1], "version": 1}',
        '{"do": "save", "what": "/etc/passwd", "camera": [0, 0, 1, 0, 0, 0]}',
        '{"do": "save", "what": "picture", "camera": [0, 0, 0, 0, 0, 0]}',
        '{"do": "change", "patches": [[["patterns", "\\ud800"], {}]], "gesture": ""}',
        '{"do": "change", "patches": [[["face"], "\\ud800"]], "gesture": ""}',
        '{"do": "change", "patches": [[["patterns", "a"], {"kind": [], "center": [0, 0, 0]}]], "gesture": ""}',
        f'{{"do": "change", "patches": [[["tears", "a"], {{"start": [1{400 * "0"}, 0, 0]}}]], "gesture": ""}}',
        '{"do": "field", "name": "../x"}', "[" * 2000 + "]" * 2000,
        *(f'{{"do": "pose", "time": {number}}}' for number in ("1e999", "NaN", '"nan"', "-1e999", "1e99")),
    ):  # fmt: skip
        seen.say(text)
        answer = seen.heard("error")["text"]
        assert answer, text
        assert "Traceback" not in answer
        assert "internal error" not in answer, text
    assert document(studio) == before
    seen.change("mixture", "AU12", 1.0)
    seen.settled(studio)
    assert seen.head["time"] == 0.0


@pytest.mark.parametrize("codes", [(1009, 1006), (1003, 1006)])  # a page that is still sending may not hear the reason
def test_oversized_and_binary_messages_end_the_page(seen, codes):
    with suppress(aiohttp.ClientConnectionResetError):  # it may be closed before all is sent
        if 1009 in codes:
            seen.say("x" * (LARGEST_MESSAGE + 1))
        else:
            seen.run(seen.socket.send_bytes(b"\0" * 64))
    while seen.receive() is not None:
        pass
    assert seen.socket.close_code in codes


def test_an_error_in_the_simulation_is_told_and_the_face_goes_on(studio, seen, monkeypatch, capfd):
    with monkeypatch.context() as patch:
        patch.setattr(fw.Simulation, "step", Mock(side_effect=ZeroDivisionError("in a step")))
        seen.send("change", patches=[[["mixture", "AU26"], 0.1]], gesture="")
        told = seen.heard("error")["text"]
    assert told.startswith("An internal error stopped the simulation (see the terminal)")
    assert "ZeroDivisionError: in a step" in capfd.readouterr().err
    seen.change("mixture", "AU26", 1.0)
    seen.settled(studio)
    n = studio.face.mesh.n_points
    assert np.abs(np.asarray(studio.frame().points)[:n] - studio.face.points).max() > 5.0  # the jaw is open


@pytest.mark.slow
def test_a_page_that_stalls_slows_nobody_and_gets_the_newest_frame(studio, seen):
    with page(studio) as stalled:
        stalled.frame()
        seen.change("mixture", "AU12", 1.0)
        seen.settled(studio)
        stalled.send("copy", id=1, camera=[0, 0, 1100, 0, 0, 0])
        while stalled.receive(shown=False).get("id") != 1:  # it acknowledges nothing
            pass
        assert stalled.frames <= 2  # the first, which it acknowledged, and the one that it has credit for
        stalled.send("shown")
        assert stalled.frame()["step"] == seen.head["step"]


@pytest.mark.slow
def test_a_page_that_vanishes_is_forgotten(studio, seen):
    with page(studio) as gone:
        gone.frame()
        gone.socket.get_extra_info("socket").shutdown(socket.SHUT_RDWR)  # without a word
    seen.change("mixture", "AU12", 1.0)
    seen.settled(studio)
    assert pages(studio) == 1


@pytest.mark.slow
def test_wishes_do_not_queue(studio, seen):
    for k in range(300):
        patch = [["mixture", "AU26"], (k % 60) / 60.0 if k < 299 else 0.25]
        seen.send("change", patches=[patch], gesture="drag")
        time.sleep(2.0 / 300)
    begin = studio.stage.shown.step
    seen.settled(studio)
    assert studio.rates == {"AU26": 0.25}
    assert studio.stage.shown.step - begin < 150  # the jaw comes to rest; a queue would take 300
    studio.undo()
    assert studio.rates == {}  # one drag is one step of undo


def test_two_pages_see_the_same_and_a_new_one_gets_everything(studio, seen):
    with page(studio) as other:
        seen.change("mixture", "AU1", 0.7)
        assert other.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
        with page(studio) as late:
            late.frame()
            other.ask("continue", on=False)
            late.heard("earlier")  # nobody is asked any more
            for each in (seen, other, late):
                each.settled(studio)
                for name in ("position", "index"):
                    assert np.array_equal(seen.arrays["skin"][name], each.arrays["skin"][name])


@pytest.mark.slow
def test_a_frame_is_small_and_what_rests_is_not_sent_again(studio, seen):
    seen.change("mixture", "happiness", 1.0)
    seen.settled(studio)
    seen.bytes.clear()
    names = set()
    for k in range(20):
        seen.change("mixture", "happiness", 1.0 - 0.01 * (k % 2), gesture="d")
        names |= {part["name"] for part in seen.frame()["parts"] if any(part["arrays"].values())}
    assert (
        sorted(seen.bytes)[len(seen.bytes) // 2] < 13.5 * studio.frame().n_points
    )  # 6 of places, 4 of normals, 1 of blood
    assert "skin" in names
    assert not names & {"brows", "upper_teeth"}
