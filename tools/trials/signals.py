"""Signals at random moments of every command: it ends soon, without a traceback, and every file is whole.

Each command writes its files once. Then it runs again over them, and is sent SIGINT, SIGTERM or SIGHUP at a random
moment; afterwards each file must have the bytes that it had, and there must be no other.
"""

from __future__ import annotations

import hashlib
import json
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pyvista as pv
from vtkmodules.vtkIOHDF import vtkHDFReader

import facewrinkle as fw

from .runner import OUTPUT, run

PROGRAM = (sys.executable, "-m", "facewrinkle")
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
SECONDS = 2.0
"""Time within which a process must have ended."""

SMALL = ("--size", "100")

COMMANDS: dict[str, tuple[str, ...]] = {
    "express": ("express", "AU12", "--frames", "8", *SMALL, "--save-mesh", "glb"),
    "play": ("play", "animation.vtkhdf", *SMALL, "--save-mesh", "obj"),
    "pattern": ("pattern", "dimple_l", "--frames", "4", *SMALL, "--save-mesh", "ply"),
    "tear": ("tear", "one_tear", "--seconds", "0.4", *SMALL),
    "fit": ("fit", "head.ply", "--landmarks", "head.json"),
    "demo": ("demo",),
    "info": ("info", "head.ply"),
    "atlas": ("atlas",),
    "rig": ("rig", "--shapes", "jawOpen+eyeBlinkLeft", "--level", "0"),
}
"""Words of a command by its name; the files are made by :func:`prepare`."""

PRINTS_ONLY = ("info", "atlas")


@cache
def prepared() -> tempfile.TemporaryDirectory[str]:
    """Return a folder with the files that the commands read; it is kept as long as the process."""
    kept = tempfile.TemporaryDirectory()
    folder = Path(kept.name)
    head = fw.default_face()
    fw.write_mesh(head.mesh, folder / "head.ply")
    marks = {name: place.tolist() for name, place in head.landmarks.items()}
    (folder / "head.json").write_text(json.dumps(marks))
    sim = fw.Simulation(head, refinement=None)
    sim.express("happiness")
    frames = list(sim.run(5))
    fw.export.write_series(frames, [0.1 * k for k in range(len(frames))], folder / "animation.vtkhdf")
    return kept


@cache
def undisturbed(name: str) -> tuple[float, dict[str, str]]:
    """Run a command to its end: return the seconds that it takes, and the digests of its files."""
    folder = Path(prepared().name)
    out = folder / f"out_{name}"
    out.mkdir()
    for _ in range(2):  # the first run may compile
        begin = time.monotonic()
        subprocess.run(words(name, out), cwd=folder, check=True, capture_output=True)
    return time.monotonic() - begin, contents(out)


def contents(folder: Path) -> dict[str, str]:
    """Return a digest of every file below a folder."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): _digest(path) for path in files}


def _digest(path: Path) -> str:
    """Digest of the bytes of a file; of all points and fields of a series, as HDF5 writes the time of day."""
    if path.suffix != ".vtkhdf":
        return hashlib.sha256(path.read_bytes()).hexdigest()
    digest = hashlib.sha256()
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        mesh = pv.wrap(reader.GetOutput())
        digest.update(np.asarray(mesh.points).tobytes() + np.asarray(mesh.regular_faces).tobytes())
        for name in sorted(mesh.point_data):
            digest.update(np.asarray(mesh.point_data[name]).tobytes())
    return digest.hexdigest()


def words(name: str, out: Path) -> list[str]:
    """Return the words of a command that writes into a folder."""
    return [*PROGRAM, *COMMANDS[name], *(() if name in PRINTS_ONLY else ("--out", str(out)))]


def play(name: str, number: str, index: int) -> dict[str, object]:
    """Run a command, send it a signal at a random moment, and return what came of it."""
    span, whole = undisturbed(name)
    delay = float(np.random.default_rng([index, SIGNALS.index(number)]).uniform(0.0, span))
    folder = Path(prepared().name)
    out = folder / f"out_{name}"
    sent = getattr(signal, number)
    with subprocess.Popen(words(name, out), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        try:
            _, said = process.communicate(timeout=delay)
            after = 0.0
        except subprocess.TimeoutExpired:
            begin = time.monotonic()
            process.send_signal(sent)
            try:
                _, said = process.communicate(timeout=30.0)
            except subprocess.TimeoutExpired:
                process.kill()
                said = process.communicate()[1]
            after = time.monotonic() - begin
    found = contents(out)
    faults = {
        "hang": after > SECONDS,
        "traceback": b"Traceback" in said or b"Exception" in said,
        "code": process.returncode not in (0, 128 + sent, -sent),  # Python itself may not be up yet
        "changed": any(found.get(path) != digest for path, digest in whole.items()),
        "partial": bool(set(found) - set(whole)),
    }
    return {
        "delay": round(delay, 3),
        "after": round(after, 3),
        "code": process.returncode,
        "faults": [fault for fault, is_there in faults.items() if is_there],
        "said": said.decode(errors="replace")[-500:] if any(faults.values()) else "",
        "files": sorted(set(found.items()) ^ set(whole.items()))[:4],
    }


def signals(
    *,
    count: int = 30,
    only: list[str] | None = None,
    workers: int = 1,
    minutes: float = np.inf,
    out: Path = OUTPUT,
) -> None:
    """Send signals at random moments, and print what did not end well.

    Parameters
    ----------
    count
        Moments of each signal, over all commands.
    only
        Names of commands. Default: all.
    workers
        Commands that run at a time.
    minutes
        Time after which no command is begun.
    out
        Folder for signals.jsonl, which a later run continues.
    """
    names = only or list(COMMANDS)
    cases = [(names[k % len(names)], number, k) for k in range(count) for number in SIGNALS]
    outcomes = run(out / "signals.jsonl", play, cases, workers=workers, minutes=minutes)
    for case, outcome in outcomes.items():
        if outcome["faults"]:
            print(case, outcome)
    print(Counter(fault for outcome in outcomes.values() for fault in outcome["faults"] or ["none"]))
    print("longest wait:", max(outcome["after"] for outcome in outcomes.values()), "s")
