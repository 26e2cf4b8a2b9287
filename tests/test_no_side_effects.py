"""No public function changes what it is given: inputs are fingerprinted, and arrays cannot be written to.

Each parameter of a public function or method has an example: by its name in `examples`, or with the function in
`SPECIAL`. A new function for which one is missing fails here until it is added.
"""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import warnings
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.resources import files

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
import facewrinkle.accessor
from facewrinkle import export
from facewrinkle.geometry import interpolation
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.mesh import add_seams
from facewrinkle.plotting import Style

pytestmark = pytest.mark.filterwarnings("ignore:.*bad X server", "ignore::facewrinkle.FaceWrinkleWarning")

ROOMS = ("", "mesh", "export", "plotting", "tears", "anatomy.muscles", "anatomy.finding")
FORMULAS = {
    "geometry": ("least_squares", "normals", "refinement", "seams", "topology", "interpolation", "profile"),
    "layers": ("patterns",),
}
ON_PURPOSE = {
    "mesh.add_seams": "lays seams on the mesh it is given",
    "mesh.refine_seams": "lays seams on the finer mesh it is given",
}
"""Functions whose name says that they change what they are given; what else they get stays as it is."""

UNCALLED = {
    "compile_ahead": "takes no data: tests/commands/test_compile.py",
    "Motion": "a protocol",
    "studio": "opens a page: tests/live",
    "anatomy.muscles.Fronts": "a type",
    "plotting.Image": "a type",
    "export.movie_writer": "takes no data; what it returns is called by write_movie",
    "MuscleWrinkles.displacement": "called by every step of a simulation, with the state of that",
    "MuscleWrinkles.follow": "as displacement",
    "MuscleWrinkles.fields": "takes nothing",
    "MuscleWrinkles.fields_of": "takes a number",
    "MuscleWrinkles.explained": "takes a number",
    "MuscleWrinkles.limited_share": "takes nothing",
    "Rig": "made by rig; what it is given is kept, not worked on",
    "PatternLayer.displacement": "as above",
    "PatternLayer.follow": "as above",
    "PatternLayer.fields": "takes nothing",
    "PatternLayer.strength_at": "as displacement",
    "PatternLayer.t_at": "takes a pattern and a number",
}


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
        text = repr(thing)
    return hashlib.sha256(text.encode()).hexdigest()


def lock(thing):
    """Arrays in it can no longer be written to."""
    if isinstance(thing, np.ndarray):
        thing.flags.writeable = False
    elif isinstance(thing, Mapping):
        for value in thing.values():
            lock(value)
    elif isinstance(thing, list | tuple):
        for value in thing:
            lock(value)
    return thing


def plane(side=9):
    """A square in the plane, 40 mm wide."""
    x, y = np.meshgrid(np.linspace(-20.0, 20.0, side), np.linspace(-20.0, 20.0, side))
    first = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    triangles = np.concatenate([np.stack([first, first + 1, first + side], 1),
                                np.stack([first + 1, first + side + 1, first + side], 1)])  # fmt: skip
    return np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], 1), triangles.astype(np.int32)


@cache
def face():
    return fw.default_face()


@cache
def frame():
    simulation = fw.Simulation(face())
    simulation.express("surprise")
    *_, last = simulation.run(6)
    return last


def take():
    return fw.Take(("mouthSmileLeft",), np.array([0.0, 0.1]), np.array([[0.0], [0.5]]))


def written_take(path):
    path.write_text("time,jawOpen\n0,0\n0.1,0.5\n")
    return path


@cache
def small_maps():
    return fw.bake_maps(face(), "AU2", size=64)


@cache
def smooth_rig():
    return fw.rig(face(), "browInnerUp", "maps")


@cache
def small_layers():
    return fw.bake_layers(smooth_rig(), 64)


def seamed(corners):
    """Texture coordinates of which every other triangle has its own."""
    apart = corners.copy()
    apart[::2] += 2.0
    return apart


def waves(path):
    moments = [surface_mesh() for _ in range(2)]
    moments[1].points = moments[1].points + 1.0
    return export.write_series(moments, [0.0, 1.0], path)


def surface_mesh(textured=False):
    points, triangles = plane()
    mesh = pv.PolyData.from_regular_faces(points, triangles)
    mesh["height"] = points[:, 0].copy()
    if textured:
        mesh.point_data["uv"] = points[:, :2] / 40.0 + 0.5
        mesh.point_data.active_texture_coordinates_name = "uv"
        add_seams(mesh, seamed(points[triangles][..., :2] / 40.0 + 0.5))
    return mesh


@pytest.fixture
def examples(tmp_path):
    """An example for each name of a parameter: fresh, so that it may be locked."""
    points, triangles = plane()
    values = np.random.default_rng(0).normal(size=len(points))
    line = np.linspace(0.1, 0.9, 7)
    corners = triangles[:5].copy()
    shares = np.full((5, 3), 1.0 / 3.0)
    marked = np.zeros(len(triangles), bool)
    marked[3] = True
    image = np.full((16, 16, 3), 90, np.uint8)
    return {
        # surfaces
        "points": points, "triangles": triangles, "values": values, "n_points": len(points), "marked": marked,
        "corners": corners, "barycentric": shares, "heights": values, "height": 0.9, "sides": triangles[:, :2].copy(),
        "directions": np.tile([0.0, 0.0, 1.0], (len(points), 1)), "bare": points, "displaced": points + 0.1,
        "smooth": np.tile([0.0, 0.0, 1.0], (len(points), 1)), "mesh": surface_mesh(), "source": surface_mesh(),
        "surface": surface_mesh(), "on": None, "point_data": {"a": values}, "near": None, "forward": None,
        "template": surface_mesh(), "kept": np.arange(len(points)), "offset": points[:, :2].copy(), "report": (),
        "others": None, "source_points": np.arange(len(points)),
        # formulas
        "x": line.copy(), "y": line[::-1].copy(), "t": 1.0, "alpha": 1.0, "beta": 2.0, "gamma": 2, "s": line.copy(),
        "sharpness": 2.0, "sharpest": 0.1, "strength": 0.5, "functions": np.hypot, "w": line.copy(), "u": 1.0,
        "k0": np.full(7, 0.5), "length": 3.0, "lambda_w": 0.2, "n": 3, "l": line.copy(), "start": 0.1, "inner": 0.2,
        "outer": 0.8, "blunt": 0.25, "centre": np.array([1.0, 2.0, 0.0]), "radius": 8.0,
        "epsilon": 0.3, "wavelength": line + 1.0, "degree": 1,
        # faces
        "face": face(), "frame": frame(), "landmarks": {k: np.array(v) for k, v in face().landmarks.items()},
        "unit": 1.0, "units": "mm", "rates": {"corrugator_l": 0.4}, "muscle": "frontalis_l", "what": {"AU12": 0.7},
        "identity": {"jaw": 0.3}, "changes": {"depth": 1.0}, "atlas": None, "estimated": (), "name": "frown",
        "expression": "AU2", "displacement": np.zeros((face().mesh.n_points, 3)), "take": take(),
        "names": ("jawOpen",), "maps": small_maps(), "side": "l", "along": 0.5,
        "tears": [fw.DrippingTear(face(), "l")], "frames": 2,
        # files and pictures
        "path": tmp_path / "out.ply", "style": Style((48, 48)), "image": image, "factor": 2,
        "images": [image, image.copy()],
        "times": np.array([0.0, 0.1]), "array": line.copy(),
        # recordings
        "positions": np.stack([points, points + 1.0]), "deltas": points[None] * 0.1, "time": 0.05, "rest": points,
        "weights": np.array([[0.0], [1.0]]), "uv": points[triangles][..., :2] / 40.0,
        "flat": fw.surface(surface_mesh()),
    }  # fmt: skip


SHEET = (np.array([[-9.0, 0.0, 0.0], [9.0, 0.0, 0.0]]), np.array([[-9.0, 9.0, 0.0], [9.0, 9.0, 0.0]]))

SPECIAL = {
    "Take": lambda e: [e["names"], e["times"], e["weights"]],
    "bake_maps": lambda e: [face(), e["what"], 1.0, 64],
    "read_take": lambda e: [written_take(e["path"].with_suffix(".csv"))],
    "Found": lambda e: [e["landmarks"], {"nose_tip": 1.0}, (), 1.0, None],
    "Identity.of": lambda e: [e["identity"]],
    "SheddingTear": lambda e: [face(), None, np.array(face().landmarks["eye_l_outer"])],
    "SphincterMuscle.transformed": lambda e: [np.eye(3), 2.0, np.ones(3)],
    "Crease.transformed": lambda e: [np.eye(3), 2.0, np.ones(3)],
    "TriangularMuscle.transformed": lambda e: [np.eye(3), 2.0, np.ones(3)],
    "SheetMuscle.transformed": lambda e: [np.eye(3), 2.0, np.ones(3)],
    "Crease.points_at": lambda e: [np.linspace(0.0, 1.0, 5), np.linspace(-1.0, 1.0, 5)],
    "Simulation.take_triangles": lambda e: [fw.Simulation(face(), layers=[])],
    "bake_layers": lambda e: [smooth_rig(), 64],
    "write_layers": lambda e: [small_layers(), e["path"].with_suffix(".glb")],
    "write_rig": lambda e: [small_rig(), e["path"].with_suffix(".glb")],
    "Simulation.use_layers": lambda e: [[fw.MuscleWrinkles()]],
    "Simulation.fields": lambda e: [next(iter(face().muscles))],
    "geometry.interpolation.interpolated": lambda e: [e["points"], e["corners"], e["barycentric"]],
    "geometry.interpolation.height_above": lambda e: [
        e["points"],
        np.tile([0.0, 0.0, 1.0], (len(e["points"]), 1)),
        (e["points"], e["triangles"].astype(np.int32)),
        1.0,
        1.0,
    ],
    "mesh.refilled": lambda e: [e["template"], e["points"], {"height": e["values"]}],
    "read_animation": lambda e: [waves(e["path"].with_suffix(".vtkhdf"))],
    "read_atlas": lambda e: [files("facewrinkle.anatomy") / "data" / "atlas.toml"],
    "DrippingTear": lambda e: [face(), np.array(face().landmarks["eye_l_outer"])],
    "Face": lambda e: [getattr(face(), f.name) for f in dataclasses.fields(fw.Face)],
    "Face.with_muscles": lambda e: [dict(list(face().muscles.items())[:2])],
    "LinearMuscle": lambda e: [np.zeros(3), np.array([0.0, 9.0, 0.0]), 0.6, 12.0],
    "LinearMuscle.transformed": lambda e: [np.eye(3), 2.0, np.ones(3)],
    "PatternLayer": lambda e: ["dimple", np.zeros(3), np.array([0.0, 1.0, 0.0]), 20.0],
    "PatternLayer.preset": lambda e: ["frown", face()],
    "Region": lambda e: [np.zeros(3), np.array([0.0, 1.0, 0.0]), 20.0],
    "Region.laid": lambda e: [face()],
    "Simulation": lambda e: [face(), None, [fw.MuscleWrinkles()]],
    "Skin.set_rates": lambda e: [np.full(len(face().muscles), 0.1)],
    "Still.rates_of": lambda e: [{}],
    "Still.set_rates": lambda e: [np.zeros(0)],
    "Recorded": lambda e: [fw.Recorded.of_positions(e["positions"], fps=10.0).track],
    "Recorded.of_shapes": lambda e: [e["deltas"], e["weights"], ("times", np.array([0.0, 0.1]))],
    "Recorded.of_positions": lambda e: [e["positions"], ("times", np.array([0.0, 0.1]))],
    "Recorded.points_of": lambda e: [e["flat"]],
    "SheddingTear.meets": lambda e: [tear()],
    "SheetMuscle": lambda e: [*SHEET],
    "TriangularMuscle": lambda e: [*SHEET],
    "Crease": lambda e: [np.array([[0.0, 9, 0], [1, 5, 0], [0, 0, 0]]), np.array([1.0, 0, 0]), 3.0],
    "SphincterMuscle": lambda e: [np.zeros(3), 9.0, 6.0, *(row.copy() for row in np.eye(3)[[2, 0]])],
    "accessor.pattern": lambda e: ["dimple", np.zeros(3), ("size", 20.0)],
    "accessor.tear": lambda e: [np.array([[0.0, 9.0, 0.0], [0.0, -9.0, 0.0]])],
    "anatomy.finding.Pose": lambda e: [np.eye(3), np.zeros(3), 1.0, np.ones(3)],
    "anatomy.muscles.EyeMuscle": lambda e: ["l", next(iter(fw.anatomy.muscles.TURNS)), 0.6],
    "anatomy.muscles.JawMuscle": lambda e: [np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.3],
    "anatomy.muscles.LidMuscle": lambda e: ["l"],
    "export.output_folder": lambda e: [e["path"].parent / "folder"],
    "export.write_movie": lambda e: [e["images"], e["path"].with_suffix(".gif")],
    "export.write_series": lambda e: [[frame()], np.array([0.0]), e["path"].with_suffix(".vtkhdf")],
    "find_landmarks": lambda e: [face().mesh, ("given", face().landmarks)],
    "rig": lambda e: [face(), "browInnerUp", "separate", 1],
    "anatomy.finding.pose_from_landmarks": lambda e: [e["landmarks"]],
    "anatomy.muscles.zones": lambda e: [list(face().muscles.values()), e["points"], e["triangles"]],
    "fit_face": lambda e: [face().mesh, e["landmarks"]],
    "geometry.interpolation.barycentric": lambda e: [e["points"][:5] + 0.1, e["points"][e["triangles"][:5]]],
    "geometry.least_squares.moving_least_squares": lambda e: [
        e["points"][:3, :2] + 0.1,
        e["points"][:, :2],
        e["values"],
    ],
    "geometry.normals.details_normals": lambda e: [e["bare"], [e["displaced"]], e["triangles"], e["smooth"]],
    "geometry.seams.refined_values": lambda e: [e["uv"], e["triangles"], forest(e)],
    "geometry.seams.split_vertices": lambda e: [e["triangles"], e["uv"], e["n_points"]],
    "geometry.topology.edge_triangles": lambda e: [
        np.sort(e["triangles"][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ],
    "mesh.add_seams": lambda e: [surface_mesh(), seamed(e["uv"])],
    "mesh.refine_seams": lambda e: [surface_mesh(True), split_mesh(e), forest(e)],
    "mesh.corner_texture": lambda e: [surface_mesh(True)],
    "mesh.split_at_seams": lambda e: [surface_mesh(True)],
    "mesh.as_texture": lambda e: [e["image"]],
    "read_texture": lambda e: [e["image"]],
    "read_face": lambda e: [fw.write_face(face(), e["path"].parent / "face.vtp")],
    "write_face": lambda e: [face(), e["path"].parent / "face.vtp"],
    "write_atlas": lambda e: [face().atlas, e["path"].parent / "atlas.toml"],
    "plotting.pictures": lambda e: [[frame()], face(), e["style"]],
    "plotting.picture": lambda e: [frame(), face(), e["style"]],
    "plotting.View": lambda e: [(0.5, 0.0, 1.0)],
    "plotting.save_picture": lambda e: [e["image"], e["path"].with_suffix(".png")],
    "tears.preset": lambda e: ["one_tear", face()],
    "tears.Preset": lambda e: ["sadness", []],
    "tears.surfaces": lambda e: [[tear()], 1.0, frame()],
    "SheddingTear.surface": lambda e: [1.0, frame()],
    "DrippingTear.surface": lambda e: [0.9, frame()],
    "SheddingTear.sampled": lambda e: [np.array([0.5, 1.0]), [frame(), frame()]],
    "DrippingTear.sampled": lambda e: [np.array([0.5, 0.9]), [frame(), frame()]],
}
"""Arguments, and pairs of a name and one that is given by that name."""


@cache
def tear():
    return fw.SheddingTear(face(), start="l")


@cache
def small_rig():
    return fw.rig(face(), "jawOpen", wrinkles="none", level=0)


def forest(examples):
    forest = RedGreenForest(examples["triangles"], 1, examples["n_points"])
    forest.split(examples["marked"])
    return forest


def split_mesh(examples):
    split = forest(examples)
    points = interpolation.interpolated(examples["points"], split.corners, split.barycentric)
    return pv.PolyData.from_regular_faces(points, split.triangles)


OWNERS = {
    "Face": face,
    "Simulation": lambda: fw.Simulation(face(), folds="paper"),
    "LinearMuscle": lambda: fw.LinearMuscle(np.zeros(3), np.array([0.0, 9.0, 0.0]), 0.6, 12.0),
    "SheetMuscle": lambda: fw.SheetMuscle(*SHEET),
    "TriangularMuscle": lambda: fw.TriangularMuscle(*SHEET),
    "Crease": lambda: fw.Crease(np.array([[0.0, 9, 0], [1, 5, 0], [0, 0, 0]]), np.array([1.0, 0, 0]), 3.0),
    "SphincterMuscle": lambda: fw.SphincterMuscle(np.zeros(3), 9.0, 6.0, *np.eye(3)[[2, 0]]),
    "MuscleWrinkles": fw.MuscleWrinkles,
    "PatternLayer": lambda: fw.PatternLayer("dimple", face().landmarks["nose_tip"], size=20.0),
    "Region": lambda: fw.Region(face().landmarks["nose_tip"], size=20.0),
    "SheddingTear": tear,
    "DrippingTear": lambda: fw.DrippingTear(face(), "l"),
    "Recorded": lambda: fw.Recorded.of_shapes(plane()[0][None] * 0.1, np.array([[0.0], [1.0]]), fps=10.0),
    "Identity": fw.Identity,
    "Skin": lambda: fw.Skin(face()),
    "Still": lambda: fw.Still(face()),
    "accessor": lambda: fine().facewrinkle,
}


def fine():
    points, triangles = plane(41)
    return pv.PolyData.from_regular_faces(points, triangles)


def methods(owner):
    cls = facewrinkle.accessor.FaceWrinkleAccessor if owner == "accessor" else getattr(fw, owner)
    return [name for name, value in inspect.getmembers(cls) if not name.startswith("_") and callable(value)]


def public():
    """The name of everything that can be called, and where it is: (module or class, name)."""
    found, seen = {}, set()
    for room in ROOMS:
        module = import_module(f"facewrinkle.{room}".rstrip("."))
        for name in module.__all__:
            value = getattr(module, name)
            if not callable(value) or id(value) in seen or (inspect.isclass(value) and issubclass(value, Exception)):
                continue
            seen.add(id(value))
            found[f"{room}.{name}".lstrip(".")] = (room, name)
    for room, modules in FORMULAS.items():
        for module in modules:
            home = getattr(import_module(f"facewrinkle.{room}".rstrip(".")), module)
            for name, value in vars(home).items():
                if inspect.isfunction(value) and not name.startswith("_") and value.__module__ == home.__name__:
                    found[f"{room}.{module}.{name}".lstrip(".")] = (home.__name__.removeprefix("facewrinkle."), name)
    for owner in OWNERS:
        for name in methods(owner):
            found[f"{owner}.{name}"] = (owner, name)
    return found


PUBLIC = public()


def arguments(name, function, examples):
    if name in SPECIAL:
        values = SPECIAL[name](examples)
        return [v for v in values if not named(v)], {v[0]: v[1] for v in values if named(v)}
    positional, options = [], {}
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD or parameter.default is not parameter.empty:
            continue
        assert parameter.name in examples, f"give {name} an example for {parameter.name!r}"
        if parameter.kind is parameter.KEYWORD_ONLY:
            options[parameter.name] = examples[parameter.name]
        else:
            positional.append(examples[parameter.name])
    return positional, options


def named(value):
    return isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], str)


@pytest.mark.parametrize("name", sorted(set(PUBLIC) - set(UNCALLED)))
def test_inputs_stay_as_they_are(name, examples):
    home, attribute = PUBLIC[name]
    owner = OWNERS[home]() if home in OWNERS else import_module(f"facewrinkle.{home}".rstrip("."))
    function = getattr(owner, attribute)
    positional, options = arguments(name, function, examples)
    lock([value for value in (*positional, *options.values()) if not isinstance(value, fw.Face)])
    before = [digest(value) for value in (*positional, *options.values())]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fw.FaceWrinkleWarning)
        result = function(*positional, **options)
        if inspect.isgenerator(result):
            list(result)
    after = [digest(value) for value in (*positional, *options.values())]
    changed = [i for i, pair in enumerate(zip(before, after, strict=True)) if pair[0] != pair[1]]
    assert len(changed) == (name in ON_PURPOSE), f"{name} changed its inputs {changed}"


def test_the_tables_name_nothing_that_is_not_there():
    assert {*UNCALLED, *ON_PURPOSE, *SPECIAL} - set(PUBLIC) == set()


def test_the_fingerprint_sees_a_change():
    mesh, array, mapping = surface_mesh(), np.zeros(3), {"a": [np.zeros(2)]}
    before = [digest(thing) for thing in (mesh, array, mapping)]
    mesh["height"][0] += 1e-12
    array[1] = 1.0
    mapping["a"][0][1] = 1e-12
    assert all(old != digest(thing) for old, thing in zip(before, (mesh, array, mapping), strict=True))
