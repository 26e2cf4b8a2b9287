"""``facewrinkle studio``: it prints its address, serves its page, and ends with Ctrl-C.

what cannot be done | one line that says so
a run               | the address leads to the page; SIGINT ends it as it ends all commands
"""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

from facewrinkle.cli import main

pytest.importorskip("aiohttp", reason="the studio needs aiohttp")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["a.obj", "--face", "b.obj"], "the face is named twice: leave out --face"),
        (["--port", "70000"], r"port must lie in \[0, 65535\], received 70000"),
        (["nowhere.obj"], "nowhere.obj"),
    ],
)
def test_errors_are_one_line(words, message, capsys):
    assert main(["studio", "--no-browser", *words]) == 1
    error = capsys.readouterr().err
    assert re.search(message, error)
    assert error.count("\n") == 1


def test_a_port_in_use_is_one_line(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["studio", "--no-browser", "--port", str(port)]) == 1
    assert f"cannot listen at 127.0.0.1, port {port}" in capsys.readouterr().err


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
