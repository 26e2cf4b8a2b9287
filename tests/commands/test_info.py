"""``facewrinkle info`` and ``atlas`` from outside: names, and the content of files."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv
from glb_files import GltfFile

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS, load_atlas, read_atlas
from facewrinkle.cli import main
from facewrinkle.commands import compile as command


def test_info_lists_every_name(run):
    atlas = load_atlas()
    names = {
        "muscles": {muscle.removesuffix("_l").removesuffix("_r") for muscle in atlas.muscles},
        "action-units": set(atlas.action_unit_names),
        "expressions": set(atlas.expressions),
    }
    first_words = {}
    for topic, known in names.items():
        first_words[topic] = {line.split()[0] for line in run("info", topic).out.splitlines() if line.strip()}
        assert known <= first_words[topic]
    everything = {line.split()[0] for line in run("info").out.splitlines() if line.strip()}
    assert set().union(*names.values()) <= everything


def test_names_of_files_are_printed_as_they_are(tmp_path, run):
    path = tmp_path / "scan [v2] [red] [] :eyes:.ply"
    pv.Sphere(theta_resolution=8, phi_resolution=8).save(path)
    assert run("info", str(path)).out.startswith(path.name)


@pytest.mark.slow
def test_info_tells_what_a_file_holds(tmp_path, run):
    face = fw.default_face()
    ball = pv.Sphere(center=face.landmarks["nose_tip"], radius=8.0)
    face.mesh.append_polydata(ball).save(tmp_path / "head.vtp")
    out, err = run("info", str(tmp_path / "head.vtp"))
    assert err == ""
    told = " ".join(out.split())
    assert f"triangles {face.mesh.n_cells} size" in told
    assert "Kept one of 2 separate parts" in told
    fw.write_face(dataclasses.replace(face, likeness=0.93), tmp_path / "head.face")
    told = " ".join(run("info", str(tmp_path / "head.face")).out.split())
    assert "likeness to a face 0.93 landmarks 33, estimated: none" in told
    for name, message in (
        ("bones", "muscles, action-units, expressions"),
        ("no.obj", "there is no file 'no.obj'. Check the path"),
        ("no.face", "there is no file 'no.face'. Check the path"),
    ):
        assert message in run("info", name, code=1).err


@pytest.mark.slow
def test_info_of_an_avatar_describes_its_head(tmp_path, run):
    """Where a shirt is larger than the head; its bones hold the head half a meter higher."""
    head, made = fw.default_face().mesh, GltfFile()
    shirt = pv.Cylinder(center=(0, -1, 0), direction=(0, 1, 0), radius=0.3, height=0.8, resolution=80).triangulate()
    parts = {"Head": (head.points / 1000.0, head.regular_faces), "Shirt": (shirt.points, shirt.regular_faces)}
    for name, (points, triangles) in parts.items():
        made.node(name=name, mesh=made.mesh(points, triangles, name=name))
    content, n = made.content, head.n_points
    content["meshes"][0]["primitives"][0]["attributes"] |= {
        "JOINTS_0": made.array(np.zeros((n, 4)), "u1"), "WEIGHTS_0": made.array([[1.0, 0, 0, 0]] * n)}  # fmt: skip
    content["nodes"][0]["skin"], content["skins"] = 0, [{"joints": [made.node(translation=[0, 0.5, 0])]}]
    content["scenes"][0]["nodes"] = [0, 1, 2]
    told = " ".join(run("info", str(made.glb(tmp_path / "avatar.glb"))).out.split())
    assert f"meshes (2) Head ({head.n_cells}), Shirt ({shirt.n_cells})" in told
    assert f"triangles {head.n_cells} size" in told
    assert "landmarks, with" in told
    made.content["scenes"][0]["nodes"] = [1]
    told = " ".join(run("info", str(made.glb(tmp_path / "shirt.glb"))).out.split())
    assert "meshes (" not in told
    assert f"triangles {shirt.n_cells} size" in told


def test_shapes_that_meshes_share_are_listed_once(tmp_path, run):
    made, ball = GltfFile(), pv.Sphere(theta_resolution=8, phi_resolution=8)
    for name, shapes in (("Head", ["smile", "blink"]), ("Teeth", ["smile", "blink"]), ("Eye", ["blink"])):
        moved = np.zeros((len(shapes), ball.n_points, 3))
        made.node(name=name, mesh=made.mesh(ball.points, ball.regular_faces, moved, shapes, name=name))
    made.content["scenes"][0]["nodes"] = [0, 1, 2]
    told = " ".join(run("info", str(made.glb(tmp_path / "avatar.glb"))).out.split())
    assert "shapes of Head (2) smile, blink shapes of Teeth (2) those of Head shapes of Eye (1) blink" in told


def test_the_atlas_is_printed_and_can_be_given_back(tmp_path, run):
    assert run("atlas").out == DEFAULT_ATLAS.read_text(encoding="utf-8")
    assert main(["atlas", "--out", str(tmp_path / "mine.toml")]) == 0
    assert read_atlas(tmp_path / "mine.toml").muscles == load_atlas().muscles
    assert "must end in .toml" in run("atlas", "--out", str(tmp_path / "mine.txt"), code=1).err


def test_a_file_with_the_changes_is_enough(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'base = "facewrinkle"\n[muscles.corrugator]\nstrength = 1.5\n[expressions]\nsmirk = { AU12L = 0.5 }\n'
    )
    mine, usual = read_atlas(path), load_atlas()
    assert mine.expressions["smirk"] == {"zygomaticus_major_l": 0.5}
    assert mine.expressions["frowning"] == usual.expressions["frowning"]
    assert mine.muscles["corrugator_l"] == {**usual.muscles["corrugator_l"], "strength": 1.5}
    assert mine.muscles["jaw"] == usual.muscles["jaw"]
    assert mine.tissue == usual.tissue


# --- fit: what it finds, and how other commands take it -------------------------------------------


@pytest.mark.slow
def test_fit_finds_a_face_and_express_takes_it(tmp_path, run):
    head = fw.default_face()
    head.mesh.scale(0.001).rotate_y(40).flip_faces().save(tmp_path / "head.vtp")
    (tmp_path / "some.json").write_text(json.dumps({"nose_tip": _turned(head.landmarks["nose_tip"])}))
    arguments = ["fit", str(tmp_path / "head.vtp"), "--landmarks", str(tmp_path / "some.json"), "--units", "m"]
    told = run(*arguments, "--out", str(tmp_path / "out")).out
    assert "4517" in told
    assert "repaired and separated" in told
    assert "oriented inward" in told
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "head.face",
        "head.landmarks.json",
        "head.png",
    ]
    found = json.loads((tmp_path / "out" / "head.landmarks.json").read_text())["landmarks"]
    assert found["zygion_l"]["estimated"]
    assert not found["nose_tip"]["estimated"]
    for name in ("nose_tip", "mouth_l", "eye_r_outer"):
        np.testing.assert_allclose(found[name]["xyz"], _turned(head.landmarks[name]), atol=0.002)
    few = ["--frames", "6", "--size", "96", "--no-movie", "--max-level", "1", "--view", "front"]
    source = ["--face", str(tmp_path / "out" / "head.face")]
    assert main(["express", "AU4", *source, *few, "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "AU4.png").is_file()
    assert (
        "--units is not for head.face, which has its own: leave it out."
        in run("express", "AU4", *source, "--units", "mm", code=1).err
    )


def _turned(point):
    """A place on the head after it was made a thousand times smaller and turned by 40 degrees about y."""
    cos, sin = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
    return [0.001 * (cos * point[0] + sin * point[2]), 0.001 * point[1], 0.001 * (cos * point[2] - sin * point[0])]


# --- compile: what commands call afterwards is compiled -------------------------------------------


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
