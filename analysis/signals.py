"""Signals at random moments of every command: it ends soon, without a traceback, and every file is whole.

    python -m analysis.signals [COUNT] [--minutes M]

Each command writes its files once. Then it runs again over them, and is sent SIGINT, SIGTERM or SIGHUP at a random
moment; afterwards each file must have the bytes that it had, and there must be no other. Outcomes are written into
``output/signals``, and a run goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pyvista as pv
from vtkmodules.vtkIOHDF import vtkHDFReader

PROGRAM = (sys.executable, "-m", "facewrinkle")
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
SECONDS = 2.0
"""Time within which a process must have ended."""

SMALL = ("--size", "100")

COMMANDS: dict[str, tuple[str, ...]] = {
    "express": ("express", "AU12", "--frames", "8", *SMALL, "--save-mesh", "glb"),
    "play": ("play", "animation.vtkhdf", *SMALL, "--save-mesh", "obj"),
    "pattern": ("pattern", "dimple_l", "--frames", "4", *SMALL, "--save-mesh", "ply"),
    "tear": ("tear", "one_tear", "--seconds", "0.4", "--plain", *SMALL),
    "fit": ("fit", "head.ply", "--landmarks", "head.json"),
    "demo": ("demo",),
    "info": ("info", "head.ply"),
    "atlas": ("atlas",),
    "rig": ("rig", "--shapes", "jawOpen+eyeBlinkLeft", "--level", "0"),
}
"""Words of a command by its name; the files are made by :func:`prepare`."""

PRINTS_ONLY = ("info", "atlas")


def prepare(folder: Path) -> None:
    """Write the files that the commands read."""
    import facewrinkle as fw

    head = fw.default_face()
    fw.write_mesh(head.mesh, folder / "head.ply")
    marks = {name: place.tolist() for name, place in head.landmarks.items()}
    (folder / "head.json").write_text(json.dumps(marks))
    sim = fw.Simulation(head, refinement=None)
    sim.express("happiness")
    frames = list(sim.run(5))
    fw.export.write_series(frames, [0.1 * k for k in range(len(frames))], folder / "animation.vtkhdf")


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


def outcome(name: str, number: str, delay: float, folder: Path, out: Path, whole: dict[str, str]) -> dict[str, object]:
    """Run a command, send it a signal after some seconds, and return what came of it."""
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
        "name": name,
        "signal": number,
        "delay": round(delay, 3),
        "after": round(after, 3),
        "code": process.returncode,
        "faults": [fault for fault, is_there in faults.items() if is_there],
        "said": said.decode(errors="replace")[-500:] if any(faults.values()) else "",
        "files": sorted(set(found.items()) ^ set(whole.items()))[:4],
    }


def main() -> None:
    """Send signals at random moments, and print what did not end well."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("count", type=int, nargs="?", default=30, help="moments of each signal, over all commands")
    parser.add_argument("--minutes", type=float, default=np.inf)
    parser.add_argument("--only", nargs="*", default=list(COMMANDS), choices=list(COMMANDS))
    options = parser.parse_args()
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    table = Path("output") / "signals" / "outcomes.jsonl"
    table.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in table.read_text().splitlines()] if table.exists() else []
    end = time.monotonic() + 60.0 * options.minutes
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        prepare(folder)
        spans: dict[str, float] = {}
        for i in range(len(known), len(SIGNALS) * options.count):
            if time.monotonic() > end:
                break
            number, name = SIGNALS[i % len(SIGNALS)], options.only[i // len(SIGNALS) % len(options.only)]
            out = folder / f"out_{name}"
            if name not in spans:
                out.mkdir()
                for _ in range(2):  # the first run may compile
                    begin = time.monotonic()
                    subprocess.run(words(name, out), cwd=folder, check=True, capture_output=True)
                    spans[name] = time.monotonic() - begin
                kept = contents(out)
                (folder / f"{name}.json").write_text(json.dumps(kept))
            whole = json.loads((folder / f"{name}.json").read_text())
            delay = float(np.random.default_rng(i).uniform(0.0, spans[name]))
            known.append(outcome(name, number, delay, folder, out, whole))
            with table.open("a") as lines:
                lines.write(json.dumps(known[-1]) + "\n")
            if known[-1]["faults"]:
                print(known[-1], flush=True)
    print(Counter(fault for found in known for fault in found["faults"] or ["none"]))
    print("longest wait:", max(found["after"] for found in known), "s")


if __name__ == "__main__":
    main()
