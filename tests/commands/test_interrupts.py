"""Ctrl-C and SIGTERM in the middle of a command."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import subprocess
import sys
import time

import pytest

from facewrinkle.cli import main
from facewrinkle.commands.report import Report

PROGRAM = [sys.executable, "-m", "facewrinkle"]


@pytest.mark.skipif(os.name == "nt", reason="signals are another thing there")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("there", [False, True])
def test_an_interrupted_run_leaves_nothing_half_done(tmp_path, number, there):
    folder = tmp_path / "deep" / "out"
    command = [*PROGRAM, "express", "surprise", "--frames", "100000", "--size", "100", "--out", str(folder)]
    if there:
        folder.mkdir(parents=True)
        (folder / "surprise.mp4").write_bytes(b"of an earlier run")
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 120.0
        while len(list(folder.glob(".*"))) < 2 and time.monotonic() < deadline:  # movie and series have begun
            time.sleep(0.1)
        assert len(list(folder.glob(".*"))) == 2
        time.sleep(0.5)
        try:
            process.send_signal(number)
            out, err = process.communicate(timeout=60.0)
        finally:
            process.kill()
    assert (process.returncode, out) == (128 + number, "")
    assert "Traceback" not in err
    assert err.splitlines()[-1] == "facewrinkle: interrupted."
    if there:
        assert [(path.name, path.read_bytes()) for path in folder.iterdir()] == [("surprise.mp4", b"of an earlier run")]
    else:
        assert not list(tmp_path.iterdir())


def test_interrupt_inside_a_finalizer_is_not_lost(monkeypatch, capsys):
    class Finalized:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    def work(*_: object, **__: object) -> None:
        Finalized()
        for _ in range(200):  # the interrupt was dropped in there; it comes again
            time.sleep(0.05)

    monkeypatch.setattr("facewrinkle.cli.app", work)
    hooks = signal.getsignal(signal.SIGINT), sys.unraisablehook
    assert main(["info"]) == 130
    assert capsys.readouterr().err == "facewrinkle: interrupted.\n"
    assert (signal.getsignal(signal.SIGINT), sys.unraisablehook) == hooks


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_that_a_library_drops_ends_a_long_work(number, monkeypatch, capsys):
    begun = []

    def work(*_: object, **__: object) -> None:
        for item in Report(quiet=True).progress(iter(range(10)), "Frames", 10):
            begun.append(item)
            with contextlib.suppress(KeyboardInterrupt):
                if item == 3:
                    signal.raise_signal(number)

    monkeypatch.setattr("facewrinkle.cli.app", work)
    assert main(["info"]) == 128 + number
    assert capsys.readouterr().err == "facewrinkle: interrupted.\n"
    assert begun == [0, 1, 2, 3]


def test_nothing_complains_after_an_interrupt(tmp_path, monkeypatch, capfd):
    def interrupted(*_, **__):
        try:
            os.kill(os.getpid(), signal.SIGINT)
        finally:
            logging.error("Failure when calling method: ProcessRequest")  # as pyvista passes on what VTK says

    monkeypatch.setattr("facewrinkle.commands.express.record", interrupted)
    assert main(["express", "AU1", "--out", str(tmp_path)]) == 130
    assert capfd.readouterr().err == "facewrinkle: interrupted.\n"
    assert logging.getLogger().isEnabledFor(logging.ERROR)
