"""The server of the studio, over real sockets.

frames that a page was sent                 | the frame of the simulation, to the step of the quantisation
who may connect: key, origin, host, number  | refused with the right code, and nobody else notices
messages: oversized, malformed, random      | an answer without a traceback, or the end of that page
a page that stalls or vanishes              | others go on at their pace; no more than one frame is under way to it
300 wishes in 5 s                           | the last is shown at once after
files of the page                           | only those of the package; a strict content policy
"""

from __future__ import annotations

import asyncio
import json
import random
import socket
import time
from contextlib import suppress

import aiohttp
import numpy as np
import pytest
from studio_pages import page, root

import facewrinkle as fw
from facewrinkle.errors import ParameterError
from facewrinkle.live import Studio
from facewrinkle.live.encoding import Box
from facewrinkle.live.protocol import LARGEST_MESSAGE


def positions(seen):
    low, size = np.array(seen.head["box"][:3]), seen.head["box"][3]
    return Box(low, size).restored(seen.arrays["skin"]["position"].astype(float)), size / 65535


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
    origin, triangles = studio._stage.parts.origin, np.vstack([seen.arrays["skin"][n] for n in ("index", "lined")])
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


@pytest.mark.parametrize("key", ["", "wrong", "x" * 32, "ключ"])
def test_without_the_key_nothing_is_told(studio, key):
    async def visit():
        async with page(studio, key=key) as seen:
            return await seen.receive(), seen.socket.close_code

    assert asyncio.run(visit()) == (None, 1008)


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
            for name in ("", "materials.js", *(name for name in studio._server._files if name != "index.html")):
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


def test_ten_thousand_random_messages_end_one_page_and_harm_nobody(studio):
    draw = random.Random(1)

    async def flood():
        async with page(studio) as seen:
            for _ in range(10_000):
                if seen.socket.closed:
                    break
                text = "".join(chr(draw.randrange(32, 127)) for _ in range(draw.randrange(60)))
                try:
                    await seen.socket.send_str(text)
                except (ConnectionError, aiohttp.ClientError):
                    break
            while await seen.receive(shown=False) is not None:
                pass
            return seen.socket.close_code

    async def visit():
        async with page(studio) as other:
            await other.until(lambda got: "step" in got)
            code = await flood()
            answer = await other.ask("copy", what="python")
            return code, answer

    code, answer = asyncio.run(visit())
    assert code in (1008, 1006)
    assert answer["value"].startswith("import facewrinkle")


def test_a_page_that_stalls_slows_nobody_and_gets_the_newest_frame(studio):
    async def visit():
        async with page(studio) as stalled, page(studio) as other:
            for seen in (stalled, other):
                await seen.until(lambda got: "step" in got)
            await other.send({"do": "change", "patches": [[["mixture", "AU12"], 1.0]], "gesture": ""})
            steps = []
            while len(steps) < 15:
                got = await other.receive()
                steps += [got["step"]] if "step" in got else []
            await other.settled(studio)
            while True:  # what is under way, as it acknowledges nothing
                try:
                    await stalled.receive(timeout=0.4, shown=False)
                except TimeoutError:
                    break
            unread = stalled.frames
            await stalled.send({"do": "shown"})
            newest = await stalled.until(lambda got: "step" in got)
            return unread, newest["step"], other.head["step"]

    unread, newest, last = asyncio.run(visit())
    assert unread <= 2  # the first, which it acknowledged, and the one that it has credit for
    assert newest == last


def test_a_page_that_vanishes_is_forgotten(studio):
    async def visit():
        async with page(studio) as other:
            async with page(studio) as gone:
                await gone.until(lambda got: "step" in got)
                gone.socket._response.close()  # without a word
            await other.send({"do": "change", "patches": [[["mixture", "AU12"], 1.0]], "gesture": ""})
            await other.until(lambda got: got.get("is") == "document" and got["data"]["mixture"])
            await other.settled(studio)
            return len(studio._server.clients)

    assert asyncio.run(visit()) == 1


def test_wishes_do_not_queue(studio):
    async def visit():
        async with page(studio) as seen:
            await seen.until(lambda got: "step" in got)
            reader = asyncio.create_task(seen.until(lambda got: False, timeout=60.0))
            for k in range(300):
                patch = [[["mixture", "AU26"], (k % 60) / 60.0 if k < 299 else 0.25]]
                await seen.send({"do": "change", "patches": patch, "gesture": "drag"})
                await asyncio.sleep(5.0 / 300)
            begin = time.monotonic()
            while not studio._settled():
                await asyncio.sleep(0.01)
            waited = time.monotonic() - begin
            reader.cancel()
            return waited, studio._document.history[0]

    before = studio._document.history[0]
    waited, steps = asyncio.run(visit())
    assert studio.rates == {"AU26": 0.25}
    assert steps == before + 1  # one drag is one step of undo
    assert waited < 6.0  # the jaw comes to rest; a queue of 300 steps would take longer on any machine


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
                return got["data"]["mixture"], one, two, late

    mixture, one, two, late = asyncio.run(visit())
    assert mixture == {"AU1": 0.7}
    for other in (two, late):
        assert np.array_equal(one.arrays["skin"]["position"], other.arrays["skin"]["position"])
        assert np.array_equal(one.arrays["skin"]["index"], other.arrays["skin"]["index"])


def test_no_more_than_eight_pages(studio):
    async def visit():
        async with aiohttp.ClientSession() as session:
            key = studio.url.partition("#")[2]
            open_pages = []
            for _ in range(8):
                ws = await session.ws_connect(f"{root(studio)}/socket", headers={"Origin": root(studio)})
                await ws.send_str(json.dumps({"do": "hello", "key": key}))
                await ws.receive()
                open_pages.append(ws)
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await session.ws_connect(f"{root(studio)}/socket", headers={"Origin": root(studio)})
            for ws in open_pages:
                await ws.close()
            return refused.value.status

    assert asyncio.run(visit()) == 503


def test_a_port_in_use_is_an_error(face):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ParameterError, match=rf"cannot listen at 127.0.0.1, port {port}: .*Choose another port"):
            Studio(face, port=port, browser=False)


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
                names |= {part["name"] for part in head["parts"] if part["arrays"]}
            return sorted(seen.bytes)[len(seen.bytes) // 2], names

    size, names = asyncio.run(visit())
    assert size < 12 * studio.frame().n_points  # bytes
    assert "skin" in names
    assert not names & {"brows", "upper_teeth"}
