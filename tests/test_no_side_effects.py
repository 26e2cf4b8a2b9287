"""No public function changes what it is given.

what                                            | checked against
the examples in docstrings of the package       | digests of all arguments, before each call and after it
layers, muscles, tears and motion while they go | the same
"""

import dataclasses
import doctest
import functools
import hashlib
import inspect
import sys
from collections.abc import Mapping
from importlib import import_module

import numpy as np
import pytest
import pyvista as pv
from expressions import after

import facewrinkle as fw
import facewrinkle.accessor

ROOMS = (
    "facewrinkle",
    *(f"facewrinkle.{room}" for room in ("mesh", "export", "plotting", "tears", "rigging", "anatomy.muscles")),
    *(
        f"facewrinkle.geometry.{name}"
        for name in ("equations", "interpolation", "least_squares", "normals", "topology")
    ),
    "facewrinkle.layers.patterns",
)
UNCALLED = {"Muscle", "Motion", "Piece", "Preset", "compiled", "compile_ahead"}
"""A base, a protocol, two tables, a decorator, and what takes half a minute: their examples do not call them."""


def digest(thing, seen=()):
    """Of anything that functions are given: arrays, meshes, mappings, sequences, dataclasses."""
    if id(thing) in seen:
        return "again"
    seen = (*seen, id(thing))
    if isinstance(thing, pv.PolyData):
        parts = [digest(np.asarray(thing.points)), digest(np.asarray(thing.faces)), thing.active_scalars_name]
        for data in (thing.point_data, thing.cell_data, thing.field_data):
            parts.append([(name, digest(np.asarray(data[name]))) for name in sorted(data)])
        parts.append(thing.point_data.active_texture_coordinates_name)
        parts.append(thing.point_data.active_normals_name)
        text = repr(parts)
    elif isinstance(thing, np.ndarray):
        values = repr(thing.tolist()).encode() if thing.dtype == object else np.ascontiguousarray(thing).tobytes()
        text = f"{thing.dtype} {thing.shape} {hashlib.sha256(values).hexdigest()}"
    elif isinstance(thing, Mapping):
        text = repr([(key, digest(value, seen)) for key, value in thing.items()])
    elif isinstance(thing, list | tuple):
        text = repr([digest(value, seen) for value in thing])
    elif dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        text = repr([(f.name, digest(getattr(thing, f.name), seen)) for f in dataclasses.fields(thing)])
    else:
        return repr(type(thing))
    return hashlib.sha256(text.encode()).hexdigest()


def watched(function, calls, own=0):
    """A function that adds its name to `calls` at each call, with the numbers of the arguments that the call changed.

    The first `own` arguments, the object of a method, may change.
    """

    @functools.wraps(function)
    def call(*arguments, **words):
        given = [*arguments[own:], *words.values()]
        before = [digest(thing) for thing in given]
        try:
            result = function(*arguments, **words)
            return iter(list(result)) if inspect.isgenerator(result) else result
        finally:  # what is refused changes nothing, either
            calls.append((function.__qualname__, [k for k, thing in enumerate(given) if digest(thing) != before[k]]))

    return call


def watch(cls, calls, monkeypatch):
    """Watch the making of a class and all its public methods."""
    for name, method in inspect.getmembers(cls, inspect.isroutine):
        if (name == "__init__" or not name.startswith("_")) and getattr(method, "__module__", "").startswith(
            fw.__name__
        ):
            bound = inspect.ismethod(method) or isinstance(inspect.getattr_static(cls, name), staticmethod)
            call = staticmethod(watched(method, calls)) if bound else watched(method, calls, 1)
            monkeypatch.setattr(cls, name, call)


def public():
    """All public functions and classes, by full name."""
    found = {}
    for room in map(import_module, ROOMS):
        for name in getattr(room, "__all__", vars(room)):
            value = getattr(room, name)
            if (inspect.isfunction(value) or inspect.isclass(value)) and value.__module__.startswith(fw.__name__):
                found.setdefault(f"{value.__module__}.{name}", value)
    return {name: value for name, value in sorted(found.items()) if not name.rpartition(".")[2].startswith("_")}


PUBLIC = public() | {"facewrinkle.accessor": facewrinkle.accessor.FaceWrinkleAccessor}
CLASSES = [value for value in PUBLIC.values() if inspect.isclass(value) and not issubclass(value, Exception)]


def with_examples():
    """The public functions, classes and methods that have an example, with the classes of the methods."""
    found = {name: (value, value) for name, value in PUBLIC.items()}
    for cls in CLASSES:
        for name, method in vars(cls).items():
            if inspect.isfunction(method) and not name.startswith("_"):
                found[f"{cls.__module__}.{method.__qualname__}"] = (method, cls)
    return {name: pair for name, pair in found.items() if ">>>" in (inspect.getdoc(pair[0]) or "")}


EXAMPLES = with_examples()


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_change_nothing_that_they_give(name, monkeypatch):
    thing, owner = EXAMPLES[name]
    names, calls = {**vars(sys.modules[thing.__module__])}, []
    if inspect.isclass(owner):
        watch(owner, calls, monkeypatch)
    else:
        names[thing.__name__] = watched(thing, calls)
        for room in map(import_module, ROOMS):
            if getattr(room, thing.__name__, None) is thing:
                monkeypatch.setattr(room, thing.__name__, names[thing.__name__])
    test = doctest.DocTestParser().get_doctest(inspect.getdoc(thing), names, name, None, None)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert runner.run(test).failed == 0
    assert not [call for call in calls if call[1]]
    assert calls or thing.__name__ in UNCALLED or issubclass(owner, (Exception, Warning))


def test_what_works_while_a_face_moves_changes_nothing(face, monkeypatch):
    calls, face = [], face.with_muscles({})  # of which nothing is known yet
    for cls in CLASSES:
        watch(cls, calls, monkeypatch)
    layers = [fw.MuscleWrinkles(), *fw.PatternLayer.presets("frown", face)]
    frame = after(fw.Simulation(face, layers=layers), {"AU4": 1.0, "AU12": 0.5}, 2)
    shed = fw.SheddingTear(face, start="l")
    assert not shed.meets(fw.SheddingTear(face, start="r"))
    for tear in (shed, fw.DrippingTear(face, "r")):
        tear.surface(0.5, frame)
        tear.sampled(np.array([0.5, 1.0]), [frame, frame])
    recorded = fw.Recorded.of_positions(np.stack([face.points, face.points + 1.0]), fps=10.0)
    fw.Simulation(face, layers=[], motion=recorded).step()
    face.with_muscles(dict(list(face.muscles.items())[:2]))
    assert not [call for call in calls if call[1]]
    called = {name for name, _ in calls}
    assert {"LinearMuscle.height", "SheetMuscle.force", "PatternLayer.displacement", "MuscleWrinkles.follow"} <= called
    assert {"Recorded.of_positions", "SheddingTear.surface", "DrippingTear.sampled", "Skin.step"} <= called


def test_the_fingerprint_sees_a_change():
    sheet, array, mapping = pv.Plane(), np.zeros(3), {"a": [np.zeros(2)]}
    before = [digest(thing) for thing in (sheet, array, mapping)]
    sheet["Normals"][0] += 1e-6
    array[1] = 1.0
    mapping["a"][0][1] = 1e-12
    assert all(old != digest(thing) for old, thing in zip(before, (sheet, array, mapping), strict=True))


def test_a_changed_argument_is_seen():
    calls = []
    watched(np.ndarray.sort, calls)(np.array([2, 1]))
    watched(np.sort, calls)(np.array([2, 1]))
    assert [changed for _, changed in calls] == [[0], []]
