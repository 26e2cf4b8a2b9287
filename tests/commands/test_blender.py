"""The extension for Blender as a file to install, against what Blender asks for, and its sources."""

from __future__ import annotations

import ast
import tomllib
import zipfile
from pathlib import Path

import pytest

from facewrinkle.cli import main

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
