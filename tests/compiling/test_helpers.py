"""The processes that compile beside a command, or ahead of all: when they start, what they do, and that they end."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from numba import float64, int64
from numba.core import event

import facewrinkle as fw
from facewrinkle.cli import main
from facewrinkle.compiling import first_start, helpers, listed, worker
from facewrinkle.compiling.listed import Listed
from facewrinkle.geometry import compilation


def own(number):
    return number + 1


own.__module__, own.__qualname__ = "facewrinkle.geometry.smoothstep", "own"


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """A function of the package that was never compiled, with a folder of its own, by the types that are to be."""
    monkeypatch.setattr(compilation.settings, "CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(compilation, "functions", {**compilation.functions})
    compiled = compilation.njit(cache=True)(own)
    entries = [Listed("geometry.smoothstep.own", types) for types in ("float64", "int64")]
    monkeypatch.setattr(listed, "sections", lambda: {"express": entries, "others": entries[1:]})
    return compiled


@pytest.fixture
def heard():
    """Listeners stay no longer than a test."""
    before = list(event._registered["numba:compile"])
    yield event._registered["numba:compile"]
    event._registered["numba:compile"][:] = before


@pytest.mark.parametrize("lacking, sections", [(first_start.ENOUGH, ["tear"]), (first_start.ENOUGH - 1, [])])
def test_processes_start_once_where_much_has_to_be_compiled(fresh, heard, monkeypatch, lacking, sections):
    started = []
    monkeypatch.setattr(first_start, "allowed", True)
    monkeypatch.setattr(listed, "missing", lambda section: [section] * lacking)
    monkeypatch.setattr(helpers, "start_helpers", started.append)
    first_start.begin("tear")
    compilation.njit()(lambda x: x - 1)(1)
    assert started == []  # another's
    assert (fresh(1), fresh(1.0)) == (2, 2.0)
    assert started == sections


def test_a_library_starts_no_processes_unasked(heard):
    before = list(heard)
    first_start.begin("express")
    assert heard == before
    assert not first_start.allowed


@pytest.mark.parametrize("why", ["one core", "no interpreter", "nothing is kept", "there are some", "refused"])
def test_no_process_starts_where_it_would_not_help(fresh, monkeypatch, why):
    def refuse(*_, **__):
        assert why == "refused"
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    monkeypatch.setattr(helpers, "_cores", lambda: 1 if why == "one core" else 4)
    if why == "no interpreter":
        monkeypatch.setattr(sys, "executable", "")
    elif why == "nothing is kept":
        monkeypatch.setattr(compilation, "functions", {})
    there = SimpleNamespace(take_in_turn=bool, drop=bool) if why == "there are some" else None
    monkeypatch.setattr(compilation, "claims", there)
    assert helpers.start_helpers("express") == []
    assert compilation.claims is there
    fw.compile_ahead(lambda steps, n: steps)
    assert bool(fresh.signatures) == (why != "nothing is kept")


def test_there_are_as_many_as_cores_without_one(monkeypatch):
    for cores, count in ((1, 0), (2, 1), (4, 3), (64, helpers.MOST)):
        monkeypatch.setattr(helpers, "_cores", lambda cores=cores: cores)
        assert helpers.helpers() == count


@pytest.mark.parametrize("free", [True, False])
def test_a_process_compiles_what_no_other_has_claimed(fresh, monkeypatch, free):
    claimed, dropped = [], []

    class Some:
        def take(self, name):
            claimed.append(name)
            return free

        def take_in_turn(self, name):
            return False

        drop = dropped.append

    monkeypatch.setattr(compilation, "claims", Some())
    monkeypatch.setattr(worker.threading.Thread, "start", lambda self: None)
    worker.main("express", 0, 1, -1)
    name = "facewrinkle.geometry.smoothstep.own"
    assert set(fresh.signatures) == ({(float64,), (int64,)} if free else set())
    assert len(claimed) == (2 if free else 3)  # the second again: it is not on the disk yet
    assert set(dropped) == ({name} if free else set())


def test_entries_that_do_not_fit_are_passed_over(fresh, monkeypatch):
    odd = Listed("geometry.smoothstep.own", "none")
    monkeypatch.setattr(listed, "sections", lambda: {"express": [odd, Listed.read("a.b(c)")]})
    monkeypatch.setattr(worker.threading.Thread, "start", lambda self: None)
    monkeypatch.setattr(helpers, "_cores", lambda: 1)
    worker.main("express", 0, 1, -1)
    fw.compile_ahead(lambda steps, n: steps)
    assert not fresh.signatures


def test_all_is_compiled_ahead_and_only_once(fresh, monkeypatch):
    told = []

    def progress(steps, n):
        told.append(n)
        for step in steps:
            told.append(len(fresh.signatures))
            yield step

    monkeypatch.setattr(helpers, "_cores", lambda: 1)
    fw.compile_ahead(progress)
    assert told == [2, 1, 2]
    fw.compile_ahead(progress)
    assert told == [2, 1, 2]
    fw.compile_ahead()


def test_the_command_compiles_ahead(fresh, monkeypatch, capsys):
    monkeypatch.setattr(helpers, "_cores", lambda: 1)
    assert main(["compile"]) == 0
    assert len(fresh.signatures) == 2
    assert capsys.readouterr().out.strip().endswith(" s")
    assert main(["compile", "--quiet"]) == 0
    assert capsys.readouterr().out == ""


def test_processes_end_where_it_is_interrupted(fresh, monkeypatch):
    ended = []
    monkeypatch.setattr(helpers, "start_helpers", lambda section: [section])
    monkeypatch.setattr(helpers, "end_helpers", ended.append)

    def interrupted(steps, n):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fw.compile_ahead(interrupted)
    assert ended == [[""]]


STARTED = """
import sys
from facewrinkle.compiling import helpers
from facewrinkle.geometry import _mesh_kernels
helpers._cores = lambda: 3
print(*(process.pid for process in helpers.start_helpers("express")), flush=True)
sys.stdin.readline()
"""


def is_running(number):
    """Whether there is a process of this number that has not ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks for processes in /proc")
@pytest.mark.parametrize("how", ["end", "kill"])
def test_processes_compile_and_end_with_the_one_that_started_them(tmp_path, how):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", STARTED]
    with subprocess.Popen(command, stdin=-1, stdout=-1, text=True, env=environment) as process:
        numbers = process.stdout.readline().split()
        assert len(numbers) == 2
        assert all(map(is_running, numbers))
        limit = time.monotonic() + 60.0
        while not list(tmp_path.rglob("*.nbc")) and time.monotonic() < limit:
            time.sleep(0.02)
        if how == "kill":
            process.kill()
        else:
            process.communicate("\n")
    while any(map(is_running, numbers)) and time.monotonic() < limit:
        time.sleep(0.02)
    assert not any(map(is_running, numbers))
    assert list(tmp_path.rglob("*.nbc"))
    assert not list(tmp_path.rglob("*.tmp.*"))
