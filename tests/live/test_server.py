"""The server of the studio, over real sockets.

frames that a page was sent                 | the frame of the simulation, to the step of the quantisation
who may connect: key, origin, host          | refused with the right code, and nobody else notices
messages: oversized, malformed, random      | an answer without a traceback, or the end of that page
an error in the simulation                  | is told; the next change goes on
a page that stalls or vanishes              | others go on at their pace; no more than one frame is under way to it
300 wishes in 2 s                           | the last is shown at once after
files of the page                           | only those of the package; a strict content policy
"""

from __future__ import annotations

import asyncio
import random
import socket
from contextlib import suppress

import aiohttp
import numpy as np
import pytest
from studio_pages import page, pages, port, restored, root

import facewrinkle as fw
from facewrinkle.errors import ParameterError
from facewrinkle.live import Studio
from facewrinkle.live.protocol import LARGEST_MESSAGE
from facewrinkle.live.server import page_files


def positions(seen):
    box = seen.head["box"]
    return restored(seen.arrays["skin"]["position"], box), box[3] / 65535


def test_a_frame_is_that_of_the_simulation(studio):
    async def visit():
        async with page(studio) as seen:
            await seen.send({"do": "change", "patches": [[["mixture", "surprise"], 1.0]], "gesture": ""})
            await seen.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
            await seen.settled(studio)
            return seen

    seen = asyncio.run(visit())
    frame = studio.frame()
    shown, step = positions(seen)
    origin, triangles = studio.stage.parts.origin, np.vstack([seen.arrays["skin"][n] for n in ("index", "lined")])
    used = np.unique(triangles)
    assert np.abs(shown - np.asarray(frame.points)[origin])[used].max() <= 0.5001 * step
    normals = seen.arrays["skin"]["normal"][:, :3] / 127.0
    assert np.abs(normals - np.asarray(frame["Normals"])[origin])[used].max() <= 0.5001 / 127.0
    drawn = origin[triangles.astype(int)]
    faces = {tuple(sorted(triangle)) for triangle in np.asarray(frame.regular_faces).tolist()}
    assert {tuple(sorted(triangle)) for triangle in drawn.tolist()} == faces
    assert frame.n_cells > studio.face.mesh.n_cells  # it was refined
    assert seen.photos["skin"][:2] == b"\xff\xd8"  # the texture came as JPEG


def test_the_frames_of_the_studio_are_those_of_a_simulation_of_its_own(face):
    """Nothing is asked but the expression; the same steps in a Simulation give the very same points."""
    from facewrinkle.live.document import Document
    from facewrinkle.live.library import Library
    from facewrinkle.live.stage import Stage
    from facewrinkle.live.wishes import eased

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
    async def visit():
        async with page(studio, key=key) as seen:
            return await seen.receive(), seen.socket.close_code

    assert asyncio.run(visit()) == (None, 1008)


def test_requests_that_make_no_sense_are_refused_in_silence(studio, capfd, caplog):
    async def asked(request):
        reader, writer = await asyncio.open_connection("127.0.0.1", port(studio))
        host = root(studio).removeprefix("http://").encode()
        writer.write(request + b" HTTP/1.1\r\nHost: %b\r\nOrigin: http://%b\r\nX-Key: \xff\r\n\r\n" % (host, host))
        status = (await reader.readline()).split()[1]
        writer.close()
        return status

    requests = b"POST /open", b"GET /" + b"a" * 9000, b"GET /%ff%00", b"GET /download/%ff", b"\xff /"
    assert [asyncio.run(asked(request)) for request in requests] == [b"403", b"400", b"404", b"404", b"400"]
    assert capfd.readouterr() == ("", "")
    assert not caplog.records


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1"])
def test_foreign_origins_are_refused(studio, origin):
    async def visit():
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            async with page(studio, origin=origin):
                pass
        return refused.value.status

    assert asyncio.run(visit()) == 403


def test_foreign_hosts_and_unknown_files_are_refused(studio):
    async def visit():
        found = []
        async with aiohttp.ClientSession() as session:
            for path, headers in (
                ("/", {"Host": "evil.example"}),
                ("/pyproject.toml", {}),
                ("/..%2f..%2f__init__.py", {}),
                ("/%2e%2e/server.py", {}),
                ("/download/nothing", {}),
                ("/socket", {}),
            ):
                async with session.get(root(studio) + path, headers=headers) as response:
                    found.append((response.status, "Traceback" in await response.text()))
        return found

    assert asyncio.run(visit()) == [(403, False), *[(404, False)] * 4, (403, False)]


def test_the_page_has_a_strict_content_policy(studio):
    async def visit():
        async with aiohttp.ClientSession() as session:
            found = {}
            for name in ("", "materials.js", *(page_files().keys() - {"index.html"})):
                async with session.get(f"{root(studio)}/{name}") as response:
                    found[name] = response.status, dict(response.headers), await response.text()
            return found

    for name, (status, headers, text) in asyncio.run(visit()).items():
        policy = headers["Content-Security-Policy"]
        assert status == 200, name
        assert policy.startswith("default-src 'none'")
        assert "unsafe" not in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert "http://" not in text.replace("http://www.w3.org/2000/svg", ""), f"{name} loads something from elsewhere"
        assert "https://" not in text


def test_bad_messages_are_answered_without_a_traceback(studio):
    bad = [
        "nonsense", "[]", "{}", '{"do": 3}', '{"do": "reboot"}', '{"do": "change"}', '{"do": "undo", "now": 1}',
        '{"do": "change", "patches": [[["mixture", "AU99"], 1]], "gesture": ""}',
        '{"do": "change", "patches": [[["mixture", "AU12"], 7]], "gesture": ""}',
        '{"do": "change", "patches": [[["__class__"], 1]], "gesture": ""}',
        '{"do": "change", "patches": [[["folds", "depth"], NaN]], "gesture": ""}',
        '{"do": "probe", "corners": [1, 2, 99999999], "shares": [0, 0, 1], "version": 1}',
        '{"do": "save", "what": "/etc/passwd", "camera": []}',
        '{"do": "save", "what": "picture", "camera": [0, 0, 0, 0, 0, 0]}',
        '{"do": "change", "patches": [[["patterns", "\\ud800"], {}]], "gesture": ""}',
        '{"do": "change", "patches": [[["face"], "\\ud800"]], "gesture": ""}',
        '{"do": "change", "patches": [[["patterns", "a"], {"kind": [], "centre": [0, 0, 0]}]], "gesture": ""}',
        f'{{"do": "change", "patches": [[["tears", "a"], {{"start": [1{400 * "0"}, 0, 0]}}]], "gesture": ""}}',
        '{"do": "field", "name": "../x"}', '{"do": "live", "weights": {"AU12": 1e999}}', "[" * 2000 + "]" * 2000,
    ]  # fmt: skip

    async def visit():
        async with page(studio) as seen:
            await seen.until(lambda got: got.get("is") == "document")
            answers = []
            for text in bad:
                await seen.socket.send_str(text)
                answers.append((await seen.until(lambda got: got.get("is") == "error"))["text"])
            return answers

    before = studio.document
    for text, answer in zip(bad, asyncio.run(visit()), strict=True):
        assert answer, text
        assert "Traceback" not in answer
        assert "error in facewrinkle itself" not in answer, text
    assert studio.document == before


def test_oversized_and_binary_messages_end_the_page(studio):
    async def visit(send):
        async with page(studio) as seen:
            await seen.until(lambda got: got.get("is") == "document")
            with suppress(aiohttp.ClientConnectionResetError):  # it may be closed before all is sent
                await send(seen.socket)
            while await seen.receive() is not None:
                pass
            return seen.socket.close_code

    closed = asyncio.run(visit(lambda ws: ws.send_str("x" * (LARGEST_MESSAGE + 1))))
    assert closed in (1009, 1006)  # a page that is still sending may not hear the reason
    assert asyncio.run(visit(lambda ws: ws.send_bytes(b"\0" * 64))) in (1003, 1006)


@pytest.mark.slow
def test_random_messages_are_answered_and_harm_nobody(studio):
    draw = random.Random(1)

    async def visit():
        async with page(studio) as other, page(studio) as seen:
            for _ in range(200):
                text = "".join(chr(draw.randrange(32, 127)) for _ in range(draw.randrange(60)))
                await seen.socket.send_str(text)
            return (
                await seen.ask("copy", camera=[0, 0, 1100, 0, 0, 0]),
                await other.ask("copy", camera=[0, 0, 1100, 0, 0, 0]),
                seen,
            )

    one, two, seen = asyncio.run(visit())
    assert one["value"] == two["value"]
    assert one["value"].startswith("import facewrinkle")
    assert sum(got["is"] == "error" for got in seen.texts) == 200


def test_times_that_are_no_numbers_do_not_end_the_pictures(studio):
    async def visit():
        async with page(studio) as other, page(studio) as seen:
            for time_ in ("1e999", "NaN", '"nan"', "-1e999", "1e99"):
                await seen.socket.send_str(f'{{"do": "pose", "time": {time_}}}')
                await seen.until(lambda got: got.get("is") == "error")
            await seen.send({"do": "change", "patches": [[["mixture", "AU12"], 1.0]], "gesture": ""})
            for each in (other, seen):
                await each.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
                await each.settled(studio)
            return other.head["time"], seen.head["time"]

    assert asyncio.run(visit()) == (0.0, 0.0)


def test_an_error_in_the_simulation_is_told_and_the_face_goes_on_with_the_next_change(studio, monkeypatch, capfd):
    def broken(_):
        raise ZeroDivisionError("in a step")

    async def visit():
        async with page(studio) as seen:
            await seen.until(lambda got: "step" in got)
            with monkeypatch.context() as patch:
                patch.setattr(fw.Simulation, "step", broken)
                await seen.send({"do": "change", "patches": [[["mixture", "AU26"], 0.1]], "gesture": ""})
                error = await seen.until(lambda got: got.get("is") == "error")
            await seen.send({"do": "change", "patches": [[["mixture", "AU26"], 1.0]], "gesture": ""})
            await seen.until(lambda got: got.get("is") == "document" and got["data"]["mixture"]["AU26"] == 1.0)
            await seen.settled(studio)
            return error["text"]

    told = asyncio.run(visit())
    assert told.startswith("An error in facewrinkle itself stopped the face, see the terminal")
    assert "ZeroDivisionError: in a step" in capfd.readouterr().err
    n = studio.face.mesh.n_points
    assert np.abs(np.asarray(studio.frame().points)[:n] - studio.face.points).max() > 5.0  # the jaw is open


@pytest.mark.slow
def test_a_page_that_stalls_slows_nobody_and_gets_the_newest_frame(studio):
    async def visit():
        async with page(studio) as stalled, page(studio) as other:
            for seen in (stalled, other):
                await seen.until(lambda got: "step" in got)
            await other.send({"do": "change", "patches": [[["mixture", "AU12"], 1.0]], "gesture": ""})
            await other.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
            await other.settled(studio)
            await stalled.send({"do": "copy", "id": 1, "camera": [0, 0, 1100, 0, 0, 0]})
            while (await stalled.receive(shown=False)).get("id") != 1:  # it acknowledges nothing
                pass
            unread = stalled.frames
            await stalled.send({"do": "shown"})
            newest = await stalled.until(lambda got: "step" in got)
            return unread, newest["step"], other.head["step"]

    unread, newest, last = asyncio.run(visit())
    assert unread <= 2  # the first, which it acknowledged, and the one that it has credit for
    assert newest == last


@pytest.mark.slow
def test_a_page_that_vanishes_is_forgotten(studio):
    async def visit():
        async with page(studio) as other:
            async with page(studio) as gone:
                await gone.until(lambda got: "step" in got)
                gone.socket.get_extra_info("socket").shutdown(socket.SHUT_RDWR)  # without a word
            await other.send({"do": "change", "patches": [[["mixture", "AU12"], 1.0]], "gesture": ""})
            await other.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
            await other.settled(studio)
            return pages(studio)

    assert asyncio.run(visit()) == 1


@pytest.mark.slow
def test_wishes_do_not_queue(studio):
    async def visit():
        async with page(studio) as seen:
            await seen.until(lambda got: "step" in got)
            reader = asyncio.create_task(seen.until(lambda got: False, timeout=60.0))
            for k in range(300):
                patch = [[["mixture", "AU26"], (k % 60) / 60.0 if k < 299 else 0.25]]
                await seen.send({"do": "change", "patches": patch, "gesture": "drag"})
                await asyncio.sleep(2.0 / 300)
            begin = studio.stage.shown.step
            while not studio.stage.settled:
                await asyncio.sleep(0.01)
            reader.cancel()
            return studio.stage.shown.step - begin

    steps = asyncio.run(visit())
    assert studio.rates == {"AU26": 0.25}
    studio.undo()
    assert studio.rates == {}  # one drag is one step of undo
    assert steps < 150  # the jaw comes to rest; a queue would take 300


def test_two_pages_see_the_same_and_a_new_one_gets_everything(studio):
    async def visit():
        async with page(studio) as one, page(studio) as two:
            await one.until(lambda got: "step" in got)
            await one.send({"do": "change", "patches": [[["mixture", "AU1"], 0.7]], "gesture": ""})
            got = await two.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
            await one.settled(studio)
            await two.settled(studio)
            async with page(studio) as late:
                await late.until(lambda got: "step" in got)
                await two.ask("continue", on=False)
                await late.until(lambda got: got.get("is") == "earlier")  # nobody is asked any more
                for seen in (one, two, late):
                    await seen.settled(studio)
                return got["data"]["mixture"], one, two, late

    mixture, one, two, late = asyncio.run(visit())
    assert mixture == {"AU1": 0.7}
    for other in (two, late):
        assert np.array_equal(one.arrays["skin"]["position"], other.arrays["skin"]["position"])
        assert np.array_equal(one.arrays["skin"]["index"], other.arrays["skin"]["index"])


def status_of(address, host):
    async def visit():
        async with (
            aiohttp.ClientSession() as session,
            session.get(address, headers={"Host": host, "Origin": f"http://{host}"}) as response,
        ):
            return response.status, dict(response.headers)

    return asyncio.run(visit())


def test_with_all_addresses_those_at_which_requests_come_in_are_hosts(face):
    """127.0.0.2 stands for the address of another network: it is one of this computer, and not the usual one."""
    with Studio(face, host="0.0.0.0", browser=False) as everywhere:
        shown, port = everywhere.url.split("/")[2].rsplit(":", 1)
        assert shown != "0.0.0.0"
        for address in ("127.0.0.1", "127.0.0.2", "localhost", shown):
            status, headers = status_of(f"http://{address}:{port}/", f"{address}:{port}")
            assert status == 200
            assert f"ws://{address}:{port}" in headers["Content-Security-Policy"]
        for host in ("evil.example", f"evil.example:{port}", f"127.0.0.3:{port}", "127.0.0.1:1", "127.0.0.1"):
            assert status_of(f"http://127.0.0.2:{port}/", host)[0] == 403


def test_browsers_leave_port_80_out(face):
    try:
        with socket.socket() as taken:
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            taken.bind(("127.0.0.1", 80))
    except OSError:
        pytest.skip("port 80 is not free here, or not allowed")
    with Studio(face, port=80, browser=False):
        assert status_of("http://127.0.0.1/", "127.0.0.1")[0] == 200
        assert status_of("http://127.0.0.1/", "127.0.0.1:80")[0] == 200
        assert status_of("http://127.0.0.1/", "evil.example")[0] == 403


def test_a_port_in_use_is_an_error(face):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ParameterError, match=rf"cannot listen at 127.0.0.1, port {port}: .*Choose another port"):
            Studio(face, port=port, browser=False)


@pytest.mark.slow
def test_a_frame_is_small_and_what_rests_is_not_sent_again(studio):
    async def visit():
        async with page(studio) as seen:
            await seen.until(lambda got: "step" in got)
            await seen.send({"do": "change", "patches": [[["mixture", "happiness"], 1.0]], "gesture": ""})
            await seen.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
            await seen.settled(studio)
            seen.bytes.clear()
            names = set()
            for k in range(20):
                weight = 1.0 - 0.01 * (k % 2)
                await seen.send({"do": "change", "patches": [[["mixture", "happiness"], weight]], "gesture": "d"})
                head = await seen.until(lambda got: "step" in got)
                names |= {part["name"] for part in head["parts"] if any(part["arrays"].values())}
            return sorted(seen.bytes)[len(seen.bytes) // 2], names

    size, names = asyncio.run(visit())
    assert size < 12 * studio.frame().n_points  # bytes
    assert "skin" in names
    assert not names & {"brows", "upper_teeth"}
