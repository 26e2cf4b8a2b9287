"""Compiling ahead: what commands call afterwards is compiled, and nothing else is left behind."""

import subprocess
import sys

import pytest

import facewrinkle as fw
from facewrinkle.commands import compile as command

SEVERAL = """
import sys
from numba.core.registry import CPUDispatcher
import facewrinkle as fw
from facewrinkle.cli import main
from facewrinkle.files import inputs_kept

def compiled():
    modules = [module for name, module in sys.modules.items() if name.startswith("facewrinkle.")]
    kernels = {x for module in modules for x in vars(module).values() if isinstance(x, CPUDispatcher)}
    return {(kernel.__module__, kernel.__name__, types) for kernel in kernels for types in kernel.signatures}

done = []
def progress(steps, what, n):
    for step in steps:
        done.append(n)
        yield step

with inputs_kept():  # as the command does
    fw.compile_ahead(progress)
assert done == [len(done)] * len(done) and len(done) > 5, done
before = compiled()
assert len(before) > 40, len(before)
for command in (["express", "happiness", "--frames", "20"], ["tear", "one_tear", "--seconds", "1"]):
    assert main([*command, "--size", "64", "--quiet", "--out", sys.argv[1]]) == 0
print(compiled() - before)
"""


@pytest.mark.slow
def test_what_commands_call_is_compiled_ahead(tmp_path):
    run = [sys.executable, "-c", SEVERAL, str(tmp_path / "out")]
    done = subprocess.run(run, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.stdout.strip() == "set()", done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_command_plays_all_cases(monkeypatch, run):
    done = []
    monkeypatch.setattr(command, "_cases", lambda folder: [lambda: done.append(folder.is_dir())] * 3)
    assert run("compile") == ("", "")
    fw.compile_ahead()
    assert done == [True] * 6
