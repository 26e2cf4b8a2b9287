"""The check at the door: what annotations allow passes, everything else is refused in our words."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.arguments import checked
from facewrinkle.errors import FaceWrinkleError, ParameterError, UnknownNameError


@checked
def door(
    number: float = 1.0,
    whole: int = 1,
    flag: bool = True,
    name: str | None = None,
    path: str | Path = "x",
    mesh: pv.DataSet | None = None,
    points: npt.ArrayLike | None = None,
    table: Mapping[str, float] | None = None,
    things: Iterable[int] = (),
    names: Iterable[str] = (),
    rows: Sequence[int] = (),
    call: Callable[[], int] | None = None,
    kind: Literal["a", "b"] = "a",
    anything: Any = None,
) -> str:
    return "passed"


@pytest.mark.parametrize(
    "words",
    [
        {"number": 3},
        {"number": np.float32(3)},
        {"number": np.array(3.0)},
        {"whole": np.int64(2)},
        {"flag": np.bool_(False)},
        {"name": "x", "path": Path("y"), "mesh": pv.Plane()},
        {"points": [[0, 1, 2]], "table": {}, "things": (i for i in range(3)), "rows": np.arange(3)},
        {"call": dict, "kind": "b", "anything": object()},
    ],
)
def test_what_is_allowed_passes(words):
    assert door(**words) == "passed"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"number": "3"}, r"number must be a number, received '3'. See help\(door\)"),
        ({"whole": [1]}, "whole must be a whole number"),
        ({"flag": "no"}, "flag must be True or False, received 'no'"),
        ({"name": 3}, "name must be text or None, received 3"),
        ({"path": None}, "path must be text or a path, received None"),
        ({"mesh": "head.obj"}, "mesh must be a DataSet or None"),
        ({"table": [1]}, "table must be a dictionary or None"),
        ({"things": 3}, "things must be an Iterable"),
        ({"call": 3}, "call must be a function of 0 arguments or None"),
        ({"call": len}, "call must be a function of 0 arguments or None, received a builtin"),
        ({"kind": ["a"]}, "kind must be 'a' or 'b', received"),
        ({"kind": np.zeros(3)}, "kind must be 'a' or 'b', received a ndarray"),
        ({"names": "AU12"}, "names must be an Iterable, received 'AU12'"),
        ({"names": ["a", 3]}, "names must be an Iterable, received"),
    ],
)
def test_what_is_not_allowed_is_refused(words, message):
    with pytest.raises(ParameterError, match=message):
        door(**words)


def test_keywords_that_do_not_exist():
    with pytest.raises(UnknownNameError, match="unknown argument of door 'numbr'. Did you mean 'number'"):
        door(numbr=3)
    with pytest.raises(TypeError, match="multiple values"):
        door(3, number=3)


def test_it_looks_like_the_function():
    assert door.__name__ == "door"
    assert fw.Simulation.__init__.__doc__ == fw.Simulation.__init__.__wrapped__.__doc__


WRONG = {
    "a number as refinement": lambda face: fw.Simulation(face, refinement=3),
    "a list as a face": lambda face: fw.Simulation([1]),
    "a name of a file as atlas": lambda face: fw.default_face(atlas="mine.toml"),
    "text as a time step": lambda face: fw.Simulation(face, time_step="0.02"),
    "a dictionary as material": lambda face: fw.Simulation(face, material={"stiffness": 3}),
    "a name as style": lambda face: fw.plotting.picture(face.mesh, face, "front"),
    "a number as a mesh": lambda face: fw.fit_face(3),
    "a number as landmarks": lambda face: fw.fit_face(face.mesh, 3),
    "a number as a file": lambda face: fw.write_mesh(face.mesh, 3),
    "a list as a frame": lambda face: fw.write_mesh([1], "x.ply"),
    "no face": lambda face: fw.write_face(None, "x.face"),
    "a number as a face file": lambda face: fw.read_face(3),
    "a number as an animation": lambda face: fw.read_animation(3),
    "a number as an atlas file": lambda face: fw.read_atlas(3),
    "a word that tears lack": lambda face: pv.Sphere().facewrinkle.tear(start=(0, 0.5, 0), colour="red"),
    "a number as times": lambda face: fw.export.write_series([face.mesh], 3, "x.vtkhdf"),
    "a picture as pictures": lambda face: fw.export.write_movie(3, "x.gif"),
    "a number as a preset": lambda face: fw.tears.preset(3, face),
    "text as a depth": lambda face: fw.MuscleWrinkles(depth="deep"),
    "a mesh as marks": lambda face: fw.refine("mesh.obj", [0]),
}


@pytest.mark.parametrize("call", WRONG.values(), ids=WRONG)
def test_wrong_calls_end_in_our_errors(face, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FaceWrinkleError):
        call(face)
    assert not list(tmp_path.iterdir())


SLOW = {"fit_face", "find_landmarks", "rig", "write_rig", "studio", "generate", "preview", "bake_maps", "write_maps"}
"""These work for long where an argument passes; the check at their door is the same."""

ROOMS = (fw, fw.dataset, fw.export, fw.plotting, fw.rigging, fw.simulation, fw.tears)


def _public():
    """Yield functions and classes that users call, with their full names, each once."""
    seen = set()
    for room in ROOMS:
        for name in room.__all__:
            found = getattr(room, name)
            if (
                (not inspect.isroutine(found) and not inspect.isclass(found))
                or id(found) in seen
                or name in SLOW
                or name.endswith(("Error", "Warning"))
            ):
                continue
            seen.add(id(found))
            yield pytest.param(found, id=f"{room.__name__}.{name}")


@pytest.mark.parametrize("call", list(_public()))
def test_what_no_argument_can_be(face, call, tmp_path):
    """Whatever stands in for one argument: it passes, or it is refused in our words."""
    good = {
        "face": face, "mesh": face.mesh, "surface": face.mesh, "frame": face.mesh, "frames": [face.mesh],
        "times": [0.0], "atlas": face.atlas, "path": tmp_path / "mesh.glb", "points": face.mesh.points,
    }  # fmt: skip
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    parameters = [p for p in inspect.signature(call).parameters.values() if p.kind in kinds]
    needed = {p.name: good.get(p.name, 1) for p in parameters if p.default is p.empty}
    foreign = {}
    for parameter in parameters:
        for wrong in (object(), b"x", {}, np.zeros(3), lambda: 0):
            try:
                call(**needed | {parameter.name: wrong})
            except FaceWrinkleError:
                pass
            except Exception as problem:
                foreign[parameter.name, type(wrong).__name__] = repr(problem)
    assert not foreign
