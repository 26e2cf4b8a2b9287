"""``facewrinkle info`` and ``atlas`` from outside: names, and the content of files."""

import dataclasses

import numpy as np
import pytest
import pyvista as pv
from glb_files import GltfFile

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS, load_atlas, read_atlas
from facewrinkle.cli import main


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
