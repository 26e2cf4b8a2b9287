"""What others see of a rig: glTF and USD for other programs, and a page that any browser shows."""

from __future__ import annotations

import base64
import gzip
import html
import json
import zipfile
from dataclasses import replace
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image as Pillow

from ..export.gltf import gltf
from ..export.meshes import upright_rotation, write_models
from ..export.model import Model, png_of
from ..export.usd import SUFFIXES as USD
from ..files import output_file, write_whole, written
from ..plotting.images import encoded
from ..plotting.lighting import light_at_rest
from ..plotting.web import bundled, cameras_of, web_files
from .linear_rig import Rig
from .wrinkle_layers import WrinkleLayers, facts_of, tiled


def write_rig(rig: Rig, path: str | Path, *, dense: bool = False) -> Path:
    """Write a rig as glTF or USD: all meshes with their shapes as morph targets, with morph normals.

    Every mesh has all shapes, in the same order, with their names in ``mesh.extras.targetNames``, as Blender, three.js,
    Unity and Unreal read them. Points are kept as they are, and nodes scale them to meters, as in
    :func:`facewrinkle.write_mesh`.

    Parameters
    ----------
    rig : Rig
    path : path
        Ends in .glb, .gltf, .usd, .usdc or .usda. An existing file is replaced. USD (UsdSkel) has its
        pictures in files beside, ``NAME_face.jpg`` and so on, and wrinkles of their own as in-betweens.
    dense : bool
        Write every vertex of every shape. By default only those that move are written (sparse accessors), which a few
        importers do not read.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    OutputError
        If the file cannot be written.
    MissingPackageError
        For USD without usd-core (extra `export`).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> made = fw.rig(fw.default_face(), shapes="jawOpen", level=0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write_rig(made, f"{folder}/head.glb")
    ...     path.name
    'head.glb'
    """
    return write_rig_files(rig, path, dense=dense)[0]


def write_rig_files(rig: Rig, path: str | Path, *, dense: bool = False) -> list[Path]:
    """Write a rig as :func:`write_rig` does; return its file, and then the pictures beside it."""
    return write_models(output_file(path, (".glb", ".gltf", *USD)), _models(rig), rig.face, rig.morphs, dense=dense)


def _models(rig: Rig) -> dict[str, Model]:
    return {name: _with_jpeg(model) for name, model in rig.parts.items()}


def _with_jpeg(model: Model) -> Model:
    """Return a model whose opaque picture is a JPEG, which is a fifth as large."""
    if model.png is None or model.cutout:
        return model
    with Pillow.open(BytesIO(model.png)) as picture:
        return replace(model, png=encoded(np.asarray(picture.convert("RGB")), ".jpg"))


def write_page(rig: Rig, path: str | Path, layers: WrinkleLayers | None = None) -> Path:
    """Write a page with sliders for the shapes of a rig. It needs no server and loads nothing from elsewhere.

    Parameters
    ----------
    rig : Rig
    path : path
        Ends in .html. An existing file is replaced.
    layers : WrinkleLayers, optional
        Wrinkle maps that the shapes drive, of :func:`facewrinkle.bake_layers`.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> made = fw.rig(fw.default_face(), shapes="jawOpen", level=0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     text = write_page(made, f"{folder}/head.html").read_text()
    >>> "http" in text.replace("http://www.w3.org", "")
    False
    """
    path = output_file(path, (".html",))
    data = web_files(files(__package__) / "data")
    model = gltf(_models(rig), rig.face.unit, upright_rotation(rig.face), binary=True, morphs=rig.morphs)
    content: dict[str, Any] = {"model": _text(gzip.compress(model, mtime=0))}
    content |= {"camera": cameras_of(rig.face), "light": _text(light_at_rest(rig.face, rig.mesh).tobytes())}
    if layers is not None:
        images = [tiled(list(layers.masks.values())), *layers.normals]
        content["maps"] = {"facts": facts_of(layers, ""), "pictures": [_text(png_of(image)) for image in images]}
    page = data["rig.html"][1].decode().replace("{{title}}", html.escape(path.stem))
    page = page.replace("{{code}}", bundled(data, "rig.js")).replace("{{rig}}", json.dumps(content))
    return write_whole(path, page)


def write_extension(path: str | Path) -> Path:
    """Write the extension for Blender, a .zip file to install."""
    folder, path = files(__package__) / "data" / "blender", output_file(path, (".zip",))
    with written(path) as whole, zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.iterdir(), key=lambda each: each.name):
            if file.is_file():
                archive.writestr(file.name, file.read_bytes())
    return path


def _text(content: bytes) -> str:
    return base64.b64encode(content).decode()
