"""The stub of the package: what type checkers and editors know is what there is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import facewrinkle as fw
from tools.write_stub import STUB, stub

SCRIPT = """
import numpy as np
import pyvista as pv
import facewrinkle as fw

face = fw.default_face(fw.Identity(jaw=0.5))
sim = fw.Simulation(face, fw.Refinement(max_level=1), [fw.MuscleWrinkles()], 0.02, material=fw.SkinMaterial())
sim.express("surprise")
frames: list[pv.PolyData] = list(sim.run(3))
path = fw.write_mesh(frames[-1], "x.glb", face, parts=True)
path.with_suffix(".obj")
tears = [fw.SheddingTear(frames[-1], start=(0.0, 0.0, 1.0))]
water: list[pv.PolyData] = fw.tears.surfaces(tears, 1.0)
sheet: fw.Face = fw.surface(pv.Plane())
layer = fw.PatternLayer("dimple", (0.0, 0.0, 0.0), size=1.0)
mesh, recorded = fw.read_animation("clip.glb")
fw.Simulation(fw.fit_face(mesh), motion=recorded)
try:
    names: list[str] = sorted(fw.MUSCLES)
except fw.FaceWrinkleError as error:
    print(error)
"""


def test_the_stub_is_that_of_the_table():
    assert STUB.read_text(encoding="utf-8") == stub(), "run python -m tools.write_stub"
    told = {line.split()[-1] for line in stub().splitlines() if " as " in line}
    told |= {line.partition(":")[0] for line in stub().splitlines() if line.startswith(("MUSCLES", "ACTION", "EXPR"))}
    assert told == {*fw.__all__, *fw._SUBPACKAGES}


@pytest.mark.parametrize("wrong", [None, "fw.Simulatoin", "fw.Simulation(3)", "sim.expres('fear')", "face.muscels"])
def test_mypy_strict_on_a_script_of_a_user(tmp_path, wrong):
    script = SCRIPT + "\n".join(f"every_{name}: object = fw.{name}" for name in fw.__all__)
    (tmp_path / "script.py").write_text(script + (f"\n{wrong}\n" if wrong else "\n"))
    cache = Path(fw.__file__).parents[1] / ".mypy_cache" / "scripts"
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", f"--cache-dir={cache}", "script.py"]
    environment = {**os.environ, "MYPYPATH": str(Path(fw.__file__).parents[1])}
    run = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    if wrong is None:
        assert run.returncode == 0, run.stdout
    else:
        assert run.returncode == 1
        assert run.stdout.count("error:") == 1, run.stdout
