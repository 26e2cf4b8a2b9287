"""``facewrinkle rig`` and ``--save-animation``; the extension for Blender, against what Blender asks for."""

import ast
import json
import re
import tomllib
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from glb_files import read_glb

import facewrinkle as fw
from facewrinkle.cli import main


def test_a_rig_with_its_page(tmp_path, capsys):
    options = ["--shapes", "jawOpen+browInnerUp+tongueOut", "--level", "0", "--page", "--errors"]
    assert main(["rig", *options, "--out", str(tmp_path)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir() if path.name[0] != ".") == [
        "head.glb",
        "head.html",
        "head.rig.json",
    ]
    facts = json.loads((tmp_path / "head.rig.json").read_text())
    assert [error["weights"] for error in facts["errors"]][:2] == [{"jawOpen": 0.5}, {"jawOpen": 1.0}]
    assert all(0.0 <= error["mean_mm"] <= error["largest_mm"] for error in facts["errors"])
    assert facts["left_out"] == {}
    said = capsys.readouterr().out
    for text in ("3, of 10 meshes", "mm on average", "head.glb"):
        assert text in said
    assert read_glb(tmp_path / "head.glb")[0]["meshes"][0]["extras"]["targetNames"] == [
        "jawOpen", "browInnerUp", "tongueOut",
    ]  # fmt: skip


@pytest.mark.slow
def test_a_rig_of_a_face_file(face, tmp_path):
    path = fw.write_face(face, tmp_path / "anna.face")
    options = ["--shapes", "visemes", "--wrinkles", "none", "--level", "0", "--format", "gltf", "--quiet"]
    assert main(["rig", str(path), *options, "--out", str(tmp_path / "out")]) == 0
    assert [file.name for file in (tmp_path / "out").iterdir() if file.name[0] != "."] == ["anna.gltf"]


def test_pictures_beside_a_rig_are_listed(face, tmp_path, run):
    pytest.importorskip("pxr")
    path = fw.write_face(replace(face, texture=np.full((8, 8, 3), 90, np.uint8)), tmp_path / "anna.face")
    options = ["--shapes", "browInnerUp", "--wrinkles", "none", "--level", "0", "--format", "usd"]
    said = run("rig", str(path), *options, "--out", str(tmp_path / "out")).out
    names = [file.name for file in (tmp_path / "out").iterdir() if file.name[0] != "."]
    assert "anna_face.jpg" in names
    assert all(name in said for name in names)


@pytest.mark.slow
def test_a_rig_with_layers_of_wrinkles_and_correctives(tmp_path, capsys):
    options = ["--shapes", "mouthFunnel+mouthPucker", "--wrinkles", "maps", "--map-size", "128", "--correctives", "1"]
    assert main(["rig", *options, "--out", str(tmp_path)]) == 0
    assert {path.name for path in tmp_path.iterdir() if path.name[0] != "."} >= {
        "head.glb", "head.rig.json", "head_wrinkles.json", "head_wrinkle1_normal.png", "head_wrinklemasks.png",
        "head_wrinkles.js",
    }  # fmt: skip
    facts = json.loads((tmp_path / "head.rig.json").read_text())
    assert facts["drivers"] == {"mouthFunnel_mouthPucker": ["mouthFunnel", "mouthPucker"]}
    assert read_glb(tmp_path / "head.glb")[0]["meshes"][0]["extras"]["drivers"] == facts["drivers"]
    said = capsys.readouterr().out
    assert "head_wrinklemasks.png" in said
    assert "driven by products of weights" in said


@pytest.mark.slow
def test_two_runs_in_one_folder_leave_no_mixture(face, tmp_path, run):
    mesh, marks = fw.write_mesh(face.mesh, tmp_path / "anna.obj", face), tmp_path / "marks.json"
    fw.anatomy.landmarks.write_landmarks(face.landmarks, marks)
    given = ["rig", str(mesh), "--landmarks", str(marks), "--shapes", "browInnerUp", "--out", str(tmp_path / "out")]
    maps = ["--wrinkles", "maps", "--map-size", "64"]

    def made(*options):
        said = run(*given, *options).out
        return {path.name for path in (tmp_path / "out").iterdir() if path.name[0] != "."}, said

    assert made("--page", "--level", "0")[0] == {"anna.glb", "anna.html"}
    (tmp_path / "out" / "anna.txt").write_text("a person's")
    files, said = made(*maps)
    assert "anna.html" in said.partition("removed, of an earlier run")[2]
    maps_of = {f"anna_wrinkle{each}" for each in ("1_height.png", "1_normal.png", "masks.png", "s.json", "s.js")}
    assert files == {"anna.glb", "anna.txt", *maps_of}
    files, _ = made(*maps, "--same-mesh")
    assert files == {"anna.npz", "anna.rig.json", "anna.txt", *maps_of}


def test_shapes_of_the_same_mesh_with_maps(face, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("FACEWRINKLE_PROGRESS", "lines")
    mesh, marks = fw.write_mesh(face.mesh, tmp_path / "ä b.obj", face), tmp_path / "marks.json"
    fw.anatomy.landmarks.write_landmarks(face.landmarks, marks)
    options = ["--shapes", "browInnerUp+jawOpen", "--wrinkles", "maps", "--map-size", "64", "--same-mesh"]
    assert main(["rig", str(mesh), "--landmarks", str(marks), *options, "--out", str(tmp_path / "out")]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir() if path.name[0] != ".") == [
        "ä b.npz", "ä b.rig.json", "ä b_wrinkle1_height.png", "ä b_wrinkle1_normal.png", "ä b_wrinklemasks.png",
        "ä b_wrinkles.js", "ä b_wrinkles.json",
    ]  # fmt: skip
    with np.load(tmp_path / "out" / "ä b.npz") as shapes:
        assert shapes["names"].tolist() == ["browInnerUp", "jawOpen"]
        np.testing.assert_allclose(shapes["points"], np.asarray(face.points), atol=1e-4)
    assert "Shapes 1/2" in capsys.readouterr().err.splitlines()


@pytest.mark.slow
def test_expressions_and_patterns_are_written_as_animations(tmp_path, run, monkeypatch):
    monkeypatch.chdir(tmp_path)
    quick = ["--no-movie", "--size", "60", "--max-level", "1", "--out", "out"]
    path = tmp_path / "frown.glb"
    said = run("express", "frowning", "--frames", "6", "--save-animation", "frown.glb", *quick).out
    assert re.search(r"^ animation +frown\.glb *$", said, re.MULTILINE)  # not among the files in out
    content, _ = read_glb(path)
    (animation,) = content["animations"]
    assert len(animation["channels"]) == len(content["meshes"])
    assert main(["pattern", "dimple", "--frames", "3", "--save-animation", str(tmp_path / "d.pc2"), *quick]) == 0
    assert (tmp_path / "d.obj").exists()
    assert (
        "must end in .glb"
        in run("express", "frowning", "--save-animation", str(tmp_path / "x.fbx"), *quick, code=1).err
    )


# --- the extension for Blender ---------------------------------------------------------------------


ROOT = Path(__file__).parents[2]


def test_the_extension_is_written_as_blender_installs_it(tmp_path, capsys):
    assert main(["blender", str(tmp_path / "new" / "x.zip")]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "new" / "x.zip")]
    with zipfile.ZipFile(tmp_path / "new" / "x.zip") as whole:
        names = set(whole.namelist())
        manifest = tomllib.loads(whole.read("blender_manifest.toml").decode())
        assert whole.read("LICENSE") == (ROOT / "LICENSE").read_bytes()
        imported = {
            f"{alias.name}.py"
            for node in ast.walk(ast.parse(whole.read("__init__.py")))
            if isinstance(node, ast.ImportFrom) and node.level
            for alias in node.names
        }
    assert manifest["version"] == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert {"id", "name", "tagline", "maintainer", "type", "blender_version_min", "license"} <= manifest.keys()
    assert imported <= names
    assert not [name for name in names if "/" in name or "__pycache__" in name]


def test_only_a_zip_can_be_written(tmp_path, capsys):
    assert main(["blender", str(tmp_path / "x.tar")]) != 0
    assert ".zip" in capsys.readouterr().err
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    "path", sorted((ROOT / "facewrinkle/rigging/data/blender").glob("*.py")), ids=lambda path: path.stem
)
def test_sources_compile(path):
    compile(path.read_text(encoding="utf-8"), str(path), "exec")
