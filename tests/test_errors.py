"""Packages that may be missing: the extras of pyproject.toml, and what is said without them."""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from facewrinkle.errors import OPTIONAL, MissingPackageError, optional_imports

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
USED = ("gltf", "studio", "export", "dataset")
"""Extras whose packages facewrinkle itself imports."""


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", re.split(r"[\[<>=~; ]", name)[0]).lower()


def test_each_package_of_an_extra_is_known_with_its_extra():
    extras = PROJECT["optional-dependencies"]
    listed = {(canonical(package), extra) for extra in USED for package in extras[extra]}
    known = {(canonical(package), extra) for package, names in OPTIONAL.values() for extra in names.split(",")}
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
