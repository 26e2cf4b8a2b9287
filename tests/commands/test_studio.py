"""``facewrinkle studio``: it prints its address, serves its page, and ends with Ctrl-C.

what cannot be done | one line that says so
a run               | the address leads to the page; SIGINT ends it as it ends all commands
a signal            | what was changed just before is in the session
a saved session     | it shows whom the command named, read anywhere
"""

import asyncio
import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS
from facewrinkle.cli import main

aiohttp = pytest.importorskip("aiohttp", reason="the studio needs aiohttp")

from studio_pages import page  # noqa: E402

LOWER = {"mouth_l": [25.2, -32.7, 103.3]}


@pytest.mark.usefixtures("signals_heard")
def test_it_prints_its_address_and_ends_with_ctrl_c():
    command = [sys.executable, "-u", "-m", "facewrinkle", "studio", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ) as run:
        try:
            address = re.search(r"http://127\.0\.0\.1:\d+/#[\w-]{32}", run.stdout.readline())[0]
            with urllib.request.urlopen(address.partition("#")[0], timeout=20) as page:
                assert b"facewrinkle studio" in page.read()
            run.send_signal(signal.SIGINT)
            assert run.wait(30) == 130
        finally:
            run.kill()


@pytest.mark.slow
@pytest.mark.usefixtures("signals_heard")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_change_just_before_a_signal_is_in_the_session(tmp_path, name):
    if not hasattr(signal, name):
        pytest.skip("there is no such signal here")
    command = [sys.executable, "-u", "-m", "facewrinkle", "studio", "--no-browser", "--save-to", str(tmp_path)]

    async def change(address):
        place, _, key = address.partition("/#")
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f"{place}/socket", headers={"Origin": place}, max_msg_size=0) as page,
        ):
            await page.send_json({"do": "hello", "key": key})
            for number, weight in ((1, 0.25), (2, 0.5)):  # the second replaces what was saved of the first
                patch = [["mixture", "AU12"], weight]
                await page.send_json({"do": "change", "id": number, "patches": [patch], "gesture": ""})
                async for got in page:
                    if got.type is aiohttp.WSMsgType.TEXT and got.json().get("id") == number:
                        break
                while number == 1 and not (tmp_path / "session.json").exists():
                    await asyncio.sleep(0.02)
            run.send_signal(getattr(signal, name))

    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ) as run:
        try:
            asyncio.run(change(re.search(r"http://\S+", run.stdout.readline())[0]))
            assert run.wait(30) == 128 + getattr(signal, name)
        finally:
            run.kill()
    assert json.loads((tmp_path / "session.json").read_text())["mixture"] == {"AU12": 0.5}
    assert [path.name for path in tmp_path.iterdir()] == ["session.json"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ("--identity jaw=0.5,age=1 --atlas mine.toml", lambda face: fw.default_face({"jaw": 0.5, "age": 1.0})),
        ("scan.face --identity age=0.5", lambda face: face.aged(0.5)),
        ("mine.json", lambda face: face.aged(0.75).with_landmarks(LOWER)),
    ],
)
def test_a_session_keeps_whom_the_studio_was_opened_with(face, tmp_path, monkeypatch, options, expected):
    """A reset, and a choice of the face, lead back to them; the file is read in another folder."""
    scowl = "[expressions]\nscowl = { corrugator = 0.5 }"
    Path(tmp_path, "mine.toml").write_text(DEFAULT_ATLAS.read_text("utf-8").replace("[expressions]", scowl), "utf-8")
    fw.write_face(face, tmp_path / "scan.face")
    fw.Session(face="scan.face", identity={"age": 0.75}, landmarks=LOWER).write(tmp_path / "mine.json")
    mixture = {"scowl" if "mine.toml" in options else "frowning": 0.5}

    def used(window):
        began = window.session
        with page(window) as seen:
            for away, back in (({"age": 0.25}, {"do": "reset"}), ({}, {"do": "show", "name": ""})):
                seen.change("identity", away)
                assert window.session.identity == away
                seen.ask(**back)
                assert window.session == began
            seen.change("mixture", mixture)
        window.frame()
        shown.append(window.face)

    shown = []
    monkeypatch.setattr(fw.live.Studio, "wait", used)
    monkeypatch.chdir(tmp_path)
    assert main(["studio", *options.split(), "--no-browser", "--save-to", "kept"]) == 0
    monkeypatch.chdir("/")
    session = fw.Session.read(tmp_path / "kept" / "session.json")
    assert session.mixture == mixture
    for found in (shown[0], session.subject().face):
        np.testing.assert_allclose(found.points, expected(face).points, atol=1e-9)
        np.testing.assert_allclose(found.landmarks["mouth_l"], expected(face).landmarks["mouth_l"], atol=1e-3)
