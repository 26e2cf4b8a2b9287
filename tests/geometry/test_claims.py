"""Claims on functions: one process at a time has a name, and loses it with its end."""

from __future__ import annotations

import subprocess
import sys

import pytest

from facewrinkle.geometry import compilation
from facewrinkle.geometry.claims import Claims

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such locks")

OTHER = """
import os, sys
from facewrinkle.geometry.claims import Claims
claims = Claims(os.fdopen(int(sys.argv[1]), "r+b"))
print(claims.take("a"), flush=True)
sys.stdin.readline()
if sys.argv[2] == "drop":
    claims.drop("a")
    print("dropped", flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def claims():
    claims = Claims.new()
    yield claims
    claims.close()
    claims.drop("a")
    assert not claims.take("a")


@pytest.fixture
def other(claims):
    """Begins another process that claims "a"; it goes on at each line that it is sent."""
    begun = []

    def begin(then="end"):
        command = [sys.executable, "-c", OTHER, str(claims.file.fileno()), then]
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, pass_fds=(claims.file.fileno(),)
        )
        begun.append(process)
        return process, process.stdout.readline().strip()

    yield begin
    for process in begun:
        process.communicate(timeout=60.0)


def test_a_name_is_taken_once(claims, other):
    assert claims.take("a")
    process, taken = other()
    assert taken == "False"
    assert claims.take("a")  # one's own, again
    claims.drop("a")
    process.communicate("\n")
    _, taken = other()
    assert taken == "True"
    assert claims.take("b")


@pytest.mark.parametrize("how", ["drop", "end", "kill"])
def test_who_waits_gets_the_name_when_it_is_dropped_or_its_process_ends(claims, other, how):
    process, taken = other(how)
    assert taken == "True"
    assert not claims.take("a")
    if how == "kill":
        process.kill()
    else:
        process.stdin.write("\n")
        process.stdin.flush()
    claims.take_in_turn("a")
    assert claims.take("a")


def test_without_locks_or_files_nothing_is_claimed(monkeypatch):
    def full():
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("facewrinkle.geometry.claims.tempfile.TemporaryFile", full)
    assert Claims.new() is None
    monkeypatch.setattr("facewrinkle.geometry.claims.fcntl", None)
    assert Claims.new() is None


def test_a_function_that_another_process_compiles_is_waited_for(tmp_path, monkeypatch):
    """What it has compiled is read then; what it has not, because it ended, is compiled here."""
    waited, then = [], "ended"

    class Turns:
        """Claims of which the first has to be waited for."""

        def take_in_turn(self, name):
            waited.append(name)
            if then == "compiled":
                monkeypatch.setattr(compilation, "claims", None)
                compilation.njit(cache=True)(quadrupled)(2)
            return True

        def drop(self, name):
            waited.append(f"dropped {name}")

    monkeypatch.setattr(compilation.settings, "CACHE_DIR", str(tmp_path))
    for then, hits in (("ended", 0), ("compiled", 1)):  # noqa: B007 - the claims look at it
        for file in tmp_path.rglob("*.nbi"):
            file.unlink()
        monkeypatch.setattr(compilation, "claims", Turns())
        compiled = compilation.njit(cache=True)(quadrupled)
        assert compiled(3) == 12
        assert sum(compiled.stats.cache_hits.values()) == hits
        name = compilation.full_name(compiled)
        assert waited == [name, f"dropped {name}"]
        waited.clear()


def quadrupled(number):
    return 4 * number
