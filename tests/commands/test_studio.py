"""``facewrinkle studio``: it prints its address, serves its page, and ends with Ctrl-C.

what cannot be done | one line that says so
a run               | the address leads to the page; SIGINT ends it as it ends all commands
a signal            | what was changed just before is in the session
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import subprocess
import sys
import urllib.request

import pytest

aiohttp = pytest.importorskip("aiohttp", reason="the studio needs aiohttp")


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
