"""The built-in head: a Catmull-Clark surface of a hand-typed cage, meshed with 4,517 triangles.

``python -m facewrinkle.anatomy.head`` makes the stored head anew from ``data/head_cage.json``. The half with
x >= 0 is meshed and mirrored; one triangle straddles the middle of the neck rim, which makes the count odd and
keeps the mesh symmetric.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DATA = Path(__file__).parent / "data"


@dataclass(frozen=True)
class Eye:
    """An eyeball: `name` 'l' or 'r' (the subject's), `centre` (3,) and `radius` in mm."""

    name: str
    centre: Floats
    radius: float


@dataclass(frozen=True)
class Hairs:
    """Eyebrow hairs, tied to the skin.

    Parameters
    ----------
    triangles : (k, p) int array
        The skin triangle under each of the p points of k hairs.
    weights : (k, p, 3) float array
        Barycentric coordinates in it.
    heights : (p,) float array
        Height of a hair's points above the skin, mm.
    """

    triangles: Ints
    weights: Floats
    heights: Floats

    def polylines(self, points: Floats, triangles: NDArray[np.int32], normals: Floats) -> Floats:
        """Points (k, p, 3) of the hairs on the skin as it is now: its points and vertex normals (n, 3)."""
        corners = triangles[self.triangles]
        foot = np.einsum("kpc,kpci->kpi", self.weights, points[corners])
        up = np.einsum("kpc,kpci->kpi", self.weights, normals[corners])
        return foot + self.heights[:, None] * up


@dataclass(frozen=True)
class Head:
    """The built-in head at rest: +y up, +z forward, the subject's left at +x, millimetres.

    Parameters
    ----------
    points : (n, 3) float array
    triangles : (4517, 3) int32 array
        Counter-clockwise seen from outside.
    uv : (n, 2) float array
        Texture coordinates in [0, 1], without overlaps.
    landmarks : dict of (3,) arrays
        On the surface; ``eye_l_centre`` and ``eye_r_centre`` are the eyeballs' centres.
    eyes : tuple of two Eye
    colour : (n, 3) uint8 array
        Skin colour.
    texture : (s, s, 3) uint8 array
        The same colour as an image over `uv`, first row at v = 1: the border of the lips is sharper in it.
    brows : Hairs
    """

    points: Floats
    triangles: NDArray[np.int32]
    uv: Floats
    landmarks: dict[str, Floats]
    eyes: tuple[Eye, Eye]
    colour: NDArray[np.uint8]
    texture: NDArray[np.uint8]
    brows: Hairs


@cache
def load_head() -> Head:
    """The stored head.

    Examples
    --------
    >>> head = load_head()
    >>> head.triangles.shape
    (4517, 3)
    """
    with np.load(DATA / "head.npz") as stored:
        data = {name: stored[name] for name in stored.files}
    return _unpacked(data)


def build_head() -> Head:
    """Make the head from its cage (about ten seconds)."""
    from facewrinkle.anatomy import _head_build

    return _unpacked(_stored(_head_build.head_arrays(cage_data())))


def cage_data() -> dict[str, Any]:
    """The cage and what was typed with it: names, points, quads, landmarks, eyeball, brows, colours."""
    data: dict[str, Any] = json.loads((DATA / "head_cage.json").read_text(encoding="utf-8"))
    return data


def _unpacked(data: dict[str, NDArray[Any]]) -> Head:
    data["texture"] = _decoded(data["texture"])
    for array in data.values():
        array.setflags(write=False)
    landmarks = dict(zip(data["landmark_names"].tolist(), data["landmarks"], strict=True))
    left, right = (Eye(name, landmarks[f"eye_{name}_centre"], float(data["eye_radius"])) for name in ("l", "r"))
    hairs = Hairs(data["brow_triangles"], data["brow_weights"], data["brow_heights"])
    return Head(
        points=data["points"],
        triangles=data["triangles"],
        uv=data["uv"],
        landmarks=landmarks,
        eyes=(left, right),
        colour=data["colour"],
        texture=data["texture"],
        brows=hairs,
    )


def _stored(arrays: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The arrays of the head as they are stored, with the texture as a JPEG."""
    return {**arrays, "texture": _encoded(arrays["texture"])}


def _encoded(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The bytes of a picture as JPEG: noise makes a texture of pores ten times larger without loss."""
    from PIL import Image

    file = BytesIO()
    Image.fromarray(image).save(file, format="JPEG", quality=90, subsampling=0)
    return np.frombuffer(file.getvalue(), np.uint8)


def _decoded(file: NDArray[np.uint8]) -> NDArray[np.uint8]:
    from PIL import Image

    with Image.open(BytesIO(file.tobytes())) as image:
        return np.array(image)


def _store() -> None:
    from facewrinkle.anatomy import _head_build

    arrays: dict[str, Any] = _stored(_head_build.head_arrays(cage_data()))
    np.savez_compressed(DATA / "head.npz", **arrays)


if __name__ == "__main__":
    _store()
