"""Packages that may be missing: the extras of pyproject.toml, and what is said without them; reports of problems."""

import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from glb_files import write_glb

import facewrinkle as fw
from facewrinkle.errors import OPTIONAL, MissingPackageError, ParameterError, optional_imports

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
USED = ("gltf", "studio", "export", "dataset")
"""Extras whose packages facewrinkle itself imports."""


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", re.split(r"[\[<>=~; ]", name)[0]).lower()


def test_each_package_of_an_extra_is_known_with_its_extra():
    extras = PROJECT["optional-dependencies"]
    listed = {(canonical(package), extra) for extra in USED for package in extras[extra]}
    known = {(canonical(package), extra) for package, names in OPTIONAL.values() for extra in names.split(",")}
    listed -= {("imageio", "studio")}  # which saves movies, too
    assert known == listed | {("imageio-ffmpeg", "export")}  # which imageio[ffmpeg] brings


def test_packages_are_those_that_bring_what_is_imported():
    installed = packages_distributions()
    for module, (package, _) in OPTIONAL.items():
        if module in installed:
            assert canonical(package) in map(canonical, installed[module])


def test_other_missing_modules_are_told_as_they_are():
    with pytest.raises(ModuleNotFoundError, match="no_such_module"), optional_imports("movies need"):
        import no_such_module  # noqa: F401


def test_a_missing_part_names_its_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio.v9", None)
    with pytest.raises(MissingPackageError, match="movies need the package imageio,"), optional_imports("movies need"):
        import imageio.v9  # noqa: F401


def compressed(folder, extension):
    content = {"asset": {"version": "2.0"}, "extensionsRequired": [extension]}
    return fw.read_surface(write_glb(folder / "a.glb", content, b""))


@pytest.mark.parametrize(
    ("package", "call", "message"),
    [
        *(
            (
                name,
                lambda folder, face: fw.write_movie(np.zeros((2, 4, 4, 3), np.uint8), folder / "a.mp4"),
                rf"{name}.*",
            )
            for name in ("imageio", "imageio_ffmpeg")
        ),
        *(
            (name, lambda folder, face, what=what: compressed(folder, what), rf"{what}.*{name}.*without compression")
            for name, what in (
                ("DracoPy", "KHR_draco_mesh_compression"),
                ("meshoptimizer", "EXT_meshopt_compression"),
            )
        ),
        ("pxr", lambda folder, face: fw.read_surface(folder / "a.usda"), "a.usda: USD files need the package usd-core"),
        ("pxr", lambda folder, face: fw.read_animation(folder / "a.usda"), "USD files need the package usd-core"),
        (
            "pxr",
            lambda folder, face: fw.write_rig(fw.rig(face, "jawOpen", wrinkles="none", level=0), folder / "b.usd"),
            r"^b\.usd: USD files need the package usd-core",
        ),
    ],
)
def test_what_needs_a_missing_package_says_how_to_install_it(face, tmp_path, monkeypatch, package, call, message):
    monkeypatch.setitem(sys.modules, package, None)
    (tmp_path / "a.usda").write_text("#usda 1.0")
    extra = OPTIONAL[package][1]
    with pytest.raises(MissingPackageError, match=message) as told:
        call(tmp_path, face)
    assert f'pip install "facewrinkle[{extra}]"' in str(told.value)
    assert not (tmp_path / "b.usd").exists()
    assert fw.write_movie(np.zeros((2, 4, 4, 3), np.uint8), tmp_path / "a.gif").exists()  # which needs none of them


WRONG = {
    "atlas must be an Atlas": lambda face, frame: fw.default_face(atlas="mine.toml"),
    "atlas must be an Atlas, received 3": lambda face, frame: fw.fit_face(face.mesh, face.landmarks, atlas=3),
    "refinement must be a Refinement": lambda face, frame: fw.Simulation(face, refinement=3),
    "material must be a SkinMaterial": lambda face, frame: fw.Simulation(face, material="soft"),
    "frame must be a PolyData": lambda face, frame: fw.picture(None, face),
    "face must be a Face, received None": lambda face, frame: fw.picture(frame, None),
    "style must be a Style": lambda face, frame: fw.picture(frame, face, "front"),
    "face must be a Face, received 'face'": lambda face, frame: fw.write_mesh(frame, "a.obj", "face"),
    "face must be a Face.*fit_face": lambda face, frame: fw.write_face(None, "a.face"),
    "face must be a Face, received 5": lambda face, frame: fw.Skin(5),
    "face must be a Face, received 6": lambda face, frame: fw.rig(6),
    "take must be a Take.*read_take": lambda face, frame: fw.Performer(face, face),
    "path must be a text or a Path": lambda face, frame: fw.read_face(None),
    "path must be a text or a Path, received 1": lambda face, frame: fw.read_atlas(1),
    "path must be a text or a Path, received 2": lambda face, frame: fw.read_take(2),
    "path must be a text or a Path, received 3": lambda face, frame: fw.read_animation(3),
    "path must be a text or a Path, received 4": lambda face, frame: fw.read(4),
    "path must be a text or a Path, received 5": lambda face, frame: fw.write_mesh(frame, 5, face),
    "path must be a text or a Path, received 6": lambda face, frame: fw.write_face(face, 6),
}


@pytest.mark.parametrize("message", WRONG)
def test_values_of_another_type_are_refused_where_they_are_given(face, message):
    with pytest.raises(ParameterError, match=message):
        WRONG[message](face, face.mesh)


# --- the report of a problem -----------------------------------------------------------------------


def test_a_report_names_the_package_and_what_it_uses():
    said = str(fw.Report(gpu=False))
    assert f"facewrinkle : {fw.__version__}" in said
    assert f"numpy : {np.__version__}" in said
    assert f"pyvista : {pv.__version__}" in said
    assert "numba : " in said
