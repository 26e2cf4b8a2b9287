"""What a user of the command line waits for: the first sign of life, and all files of an expression and of the demo.

Seconds of a new interpreter; beside them those of the processor, which other work on the machine changes less, and the
time of as many of the cheapest drawings as the command makes pictures.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

import facewrinkle as fw

COMMANDS = {
    "express surprise": (["express", "surprise"], 20.0, 315),
    "first express surprise --frames 20": (["express", "surprise", "--frames", "20"], 12.0, 75),
    "demo": (["demo"], 25.0, 490),
}
"""Arguments, goal in seconds, and how many pictures are drawn."""


def run(arguments, folder, environment):
    """Seconds of a command, and seconds of the processor with those of the processes that it starts."""
    before, begin = os.times(), time.perf_counter()
    command = [sys.executable, "-m", "facewrinkle", *arguments, "--quiet", "--out", str(folder)]
    subprocess.run(command, env=environment, check=True)
    seconds, after = time.perf_counter() - begin, os.times()
    return seconds, after.children_user + after.children_system - before.children_user - before.children_system


@pytest.mark.parametrize("what", COMMANDS)
def test_command(benchmark, results, notes, draw, installed, tmp_path, what):
    arguments, goal, pictures = COMMANDS[what]
    environment = dict(installed)
    if what.startswith("first"):
        environment["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")
    measured = []
    benchmark.group = "commands"
    benchmark.pedantic(lambda: measured.append(run(arguments, tmp_path / "out", environment)), rounds=1)
    assert any((tmp_path / "out").rglob("*.mp4"))
    if benchmark.disabled:
        return
    face = fw.default_face()
    frame = face.mesh.compute_normals(split_vertices=False)
    begin = time.perf_counter()
    for _ in range(20):
        frame.Modified()
        draw(frame)
    cheapest = (time.perf_counter() - begin) / 20.0
    seconds, processor = measured[0]
    benchmark.extra_info.update(goal=goal, cpu_seconds=processor)
    results.record(what, seconds, pictures * cheapest, f"{seconds:.1f} s", f"< {goal:g} s", seconds < goal)
    notes[what] = f"{processor:.1f} s of the processor; beside it, {pictures} of the cheapest drawings"


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_first_sign_of_life(benchmark, results, installed):
    """Until the first character is on the terminal."""
    import pty

    def first():
        ours, theirs = pty.openpty()
        command = [sys.executable, "-m", "facewrinkle", "info", "nothing.obj"]
        process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=installed)
        begin = time.perf_counter()
        os.read(ours, 1)
        seconds.append(time.perf_counter() - begin)
        os.close(theirs)
        process.kill()
        process.wait()
        os.close(ours)

    seconds = []
    benchmark.group = "commands"
    benchmark.pedantic(first, rounds=5, warmup_rounds=1)
    if not benchmark.disabled:
        worst = max(seconds[1:])
        results.record("first sign of life of a command", worst, None, f"{worst:.2f} s", "< 1 s", worst < 1.0)
