"""Ctrl-C, SIGTERM and SIGHUP at any moment of a command."""

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.usefixtures("signals_heard")
PROGRAM = [sys.executable, "-m", "facewrinkle"]
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
DELAYS = (0.1, 0.3, 0.6, 1.0, 1.8, 3.0)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals are another thing there")
@pytest.mark.parametrize(("number", "there"), list(zip(SIGNALS, (True, False, True), strict=False)))
def test_an_interrupted_run_leaves_nothing_half_done(tmp_path, number, there):
    folder = tmp_path / "deep" / "out"
    command = [*PROGRAM, "express", "surprise", "--frames", "100000", "--size", "100", "--series", "--out", str(folder)]
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


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals are another thing there")
@pytest.mark.parametrize(("delay", "number"), [*zip(DELAYS, 2 * SIGNALS, strict=False)])
def test_signals_from_the_very_start(tmp_path, number, delay):
    command = [*PROGRAM, "express", "AU12", "--frames", "4000", "--size", "100", "--out", str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        time.sleep(delay)
        try:
            process.send_signal(number)
            out, err = process.communicate(timeout=30.0)
        finally:
            process.kill()
    if process.returncode == -number or err.startswith("Fatal Python error: init_"):  # Python itself was not up yet
        return
    assert (process.returncode, out, err) == (128 + number, "", "facewrinkle: interrupted.\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="signals are another thing there")
def test_nohup_is_respected():
    program = (
        "import os, signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from facewrinkle.__main__ import end_at_signals; end_at_signals()\n"
        "os.kill(os.getpid(), signal.SIGHUP); print('still here')"
    )
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, check=True).stdout == b"still here\n"


@pytest.mark.skipif(os.name == "nt", reason="signals are another thing there")
def test_a_library_that_is_busy_does_not_delay_a_signal_for_long():
    """The machine code here holds no lock, but never looks for signals."""
    program = (
        "from facewrinkle.__main__ import end_at_signals; end_at_signals()\n"
        "import ctypes; print('busy', flush=True); ctypes.CDLL(None).sleep(60)\n"
        "ctypes.CDLL(None).sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(0.2)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=10.0) == 143


def test_a_ctrl_c_in_a_callers_own_process(monkeypatch, run):
    def work(*_: object, **__: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("facewrinkle.cli.app", work)
    assert run("info", code=130).err == "facewrinkle: interrupted.\n"
