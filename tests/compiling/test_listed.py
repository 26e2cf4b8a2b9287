"""The list of what is compiled: each entry is one that numba can compile, and it has all that a first command needs."""

from __future__ import annotations

import subprocess
import sys

import pytest
from numba import float32, int64, types

from facewrinkle.compiling import listed
from facewrinkle.compiling.listed import Listed
from facewrinkle.geometry import _mesh_kernels
from facewrinkle.tears._subdivision_kernels import Polylines

RENEW = "what is compiled has changed: run python -m tools.list_compiled"

FIRST = """
from tools.list_compiled import recorded
with recorded() as found:
    import facewrinkle as fw
    from facewrinkle.plotting import Style, picture
    face = fw.default_face()
    sim = fw.Simulation(face)
    sim.express("surprise")
    *_, frame = sim.run(2)
    picture(frame, face, Style((64, 64), "forehead"))
    picture(frame, face, Style((64, 64), quick=True))
print("\\n".join(map(str, found)))
"""


def test_every_entry_names_a_function_with_types_and_is_read_as_it_is_written():
    sections = listed.sections()
    assert set(sections) >= {"express", "pattern", "tear", "play", "others"}
    for entries in sections.values():
        assert len(set(entries)) == len(entries) > 10
        for entry in entries:
            found = entry.found()
            assert found is not None, f"{entry}: {RENEW}"
            assert Listed.of(*found) == entry == Listed.read(str(entry))


def test_the_list_has_what_a_first_frame_and_pictures_need():
    run = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, text=True, check=True)
    needed = run.stdout.splitlines()
    assert len(needed) > 40
    assert set(needed) <= set(map(str, listed.listed(""))), RENEW


@pytest.mark.parametrize(
    "kind",
    [
        types.Array(float32, 3, "C", readonly=True),
        types.Array(int64, 2, "A"),
        types.Array(int64, 2, "F"),
        types.Array(int64, 1, "C", aligned=False),
        types.Tuple((float32, types.boolean)),
        types.UniTuple(int64, 2),
        types.Tuple((types.Array(float32, 1, "C"),)),
        types.NamedTuple((float32[:, ::1], int64[::1], int64[:]), Polylines),
        types.boolean,
    ],
)
def test_types_are_written_and_read(kind):
    entry = Listed.of(_mesh_kernels.normalise, (kind, kind))
    compiled, types_ = entry.found()
    assert compiled is _mesh_kernels.normalise
    assert types_ == (kind, kind)


@pytest.mark.parametrize(
    "line",
    [
        "geometry.absent.normalise(float64[:, ::1])",
        "geometry._mesh_kernels.absent(float64[:, ::1])",
        "geometry._mesh_kernels.normalise(absent[:, ::1])",
        "geometry._mesh_kernels.normalise(float64[:, ::1",
        "geometry._mesh_kernels.normalise",
        "nonsense",
    ],
)
def test_what_is_no_longer_there_is_passed_over(line):
    assert Listed.read(line).found() is None or line.endswith("normalise")


def test_without_the_list_nothing_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(listed, "FILE", tmp_path / "absent.txt")
    assert listed.sections() == {}
    assert listed.listed("express") == listed.listed("") == listed.missing("") == []
