"""Wrinkles of a whole rig as a few layers of maps, with a mask for each shape, as engines blend them.

Shapes whose wrinkles lie apart share a layer. Each shape has a mask that says how much of its layer it brings in; a
program adds masks times squares of weights, as skin folds with the square, and blends the layers' normals in by the
sums.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files as files_of
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..errors import ParameterError
from ..export.model import png_of
from ..files import write_whole
from ..geometry import smoothstep, unit
from ..mesh.arrays import corner_texture, in_bytes
from ..progress import Progress, bar
from .fields import Baker
from .linear_rig import Rig
from .maps import (
    FOLDED,
    FoldMaps,
    check_map_size,
    check_texture,
    conventions,
    heights_as_integers,
)
from .poses import share_of_side

COLUMNS = 4
"""Tiles in a row of the picture of masks."""


@dataclass(frozen=True, eq=False)
class WrinkleLayers:
    """Maps of the wrinkles of all shapes of a rig; the first row is the uppermost.

    Attributes
    ----------
    normals : list of ndarray of uint8, shape (h, w, 3)
        Of the layers, as in :class:`Maps`.
    heights : list of ndarray of uint16, shape (h, w)
        From -`most` to `most` mm; 32768 is none.
    most : float
        Of all heights, mm.
    masks : dict of str to ndarray of uint8, shape (h, w)
        How much of its layer a shape brings in at weight 1; shapes without wrinkles have none.
    layer : dict of str to int
        Number of the layer, from 0, that a shape uses.
    unit : float
        Millimeters per unit of the mesh.
    charted : bool
        The texture coordinates are those of a chart around the head, as the mesh has none.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> rig = fw.rig(fw.default_face(), "browInnerUp+browDownLeft+noseSneerLeft", wrinkles="maps")
    >>> layers = bake_layers(rig, size=256)
    >>> len(layers.normals) <= 4, sorted(layers.masks), layers.most > 0.1
    (True, ['browDownLeft', 'browInnerUp', 'noseSneerLeft'], True)
    """

    normals: list[npt.NDArray[np.uint8]]
    heights: list[npt.NDArray[np.uint16]]
    most: float
    masks: Mapping[str, npt.NDArray[np.uint8]]
    layer: Mapping[str, int]
    unit: float
    charted: bool


def check_layer_size(size: int) -> int:
    """Return the width of layers of maps, a power of two from 64 to 2048; raise a ParameterError for another."""
    return check_map_size(
        size, 2048, "Layers hold the maps of all shapes at once; those of one expression, of bake_maps, may be larger."
    )


def bake_layers(rig: Rig, size: int = 1024, *, progress: Progress | None = None) -> WrinkleLayers:
    """Bake the wrinkles of all shapes of a rig into at most four layers of maps, with a mask for each shape.

    Parameters
    ----------
    rig : Rig
        Made with ``wrinkles="maps"``: smooth, on the face's own triangles, with the texture coordinates of the maps.
    size : int
        Width and height, texels: a power of two from 64 to 2048; with ARKit's shapes, 2048 takes up to 4 GB.
    progress : callable, optional
        As in :func:`facewrinkle.rig`.

    Returns
    -------
    WrinkleLayers

    Raises
    ------
    ParameterError
        For a rig with other wrinkles, or none, texture coordinates outside [0, 1], or another size.

    Warns
    -----
    FaceWrinkleWarning
        If triangles overlap on the texture.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> rig = fw.rig(fw.default_face(), "browInnerUp", wrinkles="maps")
    >>> bake_layers(rig, size=64).layer
    {'browInnerUp': 0}
    """
    size, progress = check_layer_size(size), progress or bar
    if rig.wrinkles != "maps":
        raise ParameterError(
            'layers of wrinkles belong to a rig made with wrinkles="maps", which shows them once; received one with '
            f'wrinkles="{rig.wrinkles}".'
        )
    face = rig.face
    check_texture(face)
    shapes = {name: shape for name, shape in rig.shapes.items() if not shape.beyond}
    poses = {shape.movement: rig.poses[shape.movement] for shape in shapes.values()}
    poses = {movement: pose for movement, pose in poses.items() if pose.rates.any() or movement[1] or pose.age}
    neutral, fine, smooth = rig.posing.neutral(), Baker(face, None, level=3), Baker(face, [], level=0)
    fine.refine(list(poses.values()), neutral, progress)
    folds = FoldMaps(face, fine.frame(neutral), smooth.frame(neutral), size)
    sides = {side: folds.on_skin(share_of_side(face, face.points, side)[:, 0]) for side in ("l", "r", None)}
    found = []
    for movement, pose in progress(list(poses.items()), "Maps", len(poses)):
        height, normal, around = folds.of(fine.frame(pose), smooth.frame(pose))
        if around.max(initial=0.0) > FOLDED:
            users = [name for name, shape in shapes.items() if shape.movement == movement]
            found.append((users, height.astype(np.float32), normal.astype(np.float32), around.astype(np.float32)))
    if not found:
        raise ParameterError("none of the shapes of this rig folds the skin, and maps would be empty.")
    number = _colored([each[3] for each in found], 4)  # as many as a vector of a shader holds
    most = max(float(np.abs(each[1]).max()) for each in found)
    normals, heights, masks, layer = [], [], {}, {}
    for k in range(max(number) + 1):
        own = [each for each, at in zip(found, number, strict=True) if at == k]
        strength = np.stack([each[3] for each in own]).astype(np.float64)
        share = strength**4.0  # of shapes that meet in a layer, the deeper one is seen
        share /= np.maximum(share.sum(axis=0), 1e-300)
        height = sum(part * each[1] for part, each in zip(share, own, strict=True))
        normal = sum(part[..., None] * each[2] for part, each in zip(share, own, strict=True))
        normal[share.sum(axis=0) < 0.5] = [0.0, 0.0, 1.0]
        normals.append(folds.filled(in_bytes(0.5 + 0.5 * unit(normal))))
        heights.append(folds.filled(heights_as_integers(height, most)))
        shown = (share * strength).sum(axis=0)
        for i, (users, *_) in enumerate(own):
            part = np.clip(strength[i] / np.maximum(shown, 1e-9), 0.0, 1.0)
            part = folds.blurred(part * smoothstep(strength[i] / FOLDED - 0.5))
            for name in users:
                masks[name], layer[name] = folds.filled(in_bytes(part * sides[shapes[name].side])), k
    masks = {name: masks[name] for name in rig.names if name in masks}
    layer = {name: layer[name] for name in masks}
    return WrinkleLayers(normals, heights, most, masks, layer, face.unit, corner_texture(face.mesh) is None)


def _colored(depths: Sequence[npt.NDArray[np.float32]], count: int) -> list[int]:
    """Return a layer for each field of depths (h, w) so that fields of a layer hardly lie on each other.

    The deepest come first, each into the first layer on which hardly more of it lies on others than on any.

    Examples
    --------
    Two that overlap, and one that lies elsewhere:

    >>> depths = [np.array([[1.0, 1.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, 0.0, 1.0]])]
    >>> _colored(depths, 4)
    [0, 1, 0]
    """
    order = np.argsort([-float(depth.sum()) for depth in depths], kind="stable")
    number, taken = [-1] * len(depths), [np.zeros_like(depth) for depth in depths[:1] for _ in range(count)]
    for i in order:
        lies = [float(np.minimum(depths[i], there).sum()) for there in taken]
        least = min(lies) + 0.01 * float(depths[i].sum())
        number[i] = next(k for k in range(count) if lies[k] <= least)
        taken[number[i]] = np.maximum(taken[number[i]], depths[i])
    used = sorted(set(number))
    return [used.index(each) for each in number]


def write_layers(layers: WrinkleLayers, path: str | Path) -> list[Path]:
    """Write layers of wrinkles beside a rig: PNG maps, a picture of all masks, a table, and a player for browsers.

    The maps are ``NAME_wrinkle1_normal.png`` and ``NAME_wrinkle1_height.png`` and so on. ``NAME_wrinklemasks.png``
    holds the masks of the shapes in the red, green and blue of its tiles, which are smaller than the maps, as masks are
    soft. ``NAME_wrinkles.json`` names the layer of each shape, from 1, and the tile, row by row from 0, and channel of
    its mask. `unit_mm` is that of the mesh; `texture_coordinates` are "own", the first set of the mesh, or those of a
    "chart" around the head. ``NAME_wrinkles.js`` plays them in three.js.

    Parameters
    ----------
    layers : WrinkleLayers
    path : path
        Of the rig, with or without its ending.

    Returns
    -------
    list of pathlib.Path

    Raises
    ------
    OutputError
        If a file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import facewrinkle as fw
    >>> layers = bake_layers(fw.rig(fw.default_face(), "browInnerUp", wrinkles="maps"), size=64)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [file.name for file in write_layers(layers, Path(folder) / "head.glb")][1:]
    ['head_wrinkle1_height.png', 'head_wrinklemasks.png', 'head_wrinkles.json', 'head_wrinkles.js']
    """
    path = Path(path)
    stem = path.stem if path.suffix.lower() in (".glb", ".gltf", ".usd", ".usda", ".usdc", ".npz") else path.name
    contents: dict[str, str | bytes] = {}
    for k, (normal, height) in enumerate(zip(layers.normals, layers.heights, strict=True), start=1):
        contents |= {f"wrinkle{k}_normal.png": png_of(normal), f"wrinkle{k}_height.png": png_of(height)}
    contents |= {
        "wrinklemasks.png": png_of(tiled(list(layers.masks.values()))),
        "wrinkles.json": json.dumps(facts_of(layers, stem), indent=1) + "\n",
        "wrinkles.js": (files_of(__package__) / "data" / "wrinkles.js").read_text(encoding="utf-8"),
    }
    return [write_whole(path.with_name(f"{stem}_{name}"), content) for name, content in contents.items()]


def facts_of(layers: WrinkleLayers, stem: str) -> dict[str, object]:
    """Return what a program must know of layers, and of their files, whose names begin with a stem."""
    return {
        "layers": [
            {"normal": f"{stem}_wrinkle{k}_normal.png", "height": f"{stem}_wrinkle{k}_height.png"}
            for k in range(1, len(layers.normals) + 1)
        ],
        "masks": {
            "picture": f"{stem}_wrinklemasks.png",
            "columns": COLUMNS,
            "rows": -(-len(layers.masks) // (3 * COLUMNS)),
        },
        **conventions(layers.most),
        "unit_mm": layers.unit,
        "texture_coordinates": "chart" if layers.charted else "own",
        "blend": "each layer by the sum over its shapes of weight squared times mask, at most 1",
        "shapes": {
            name: {"layer": layers.layer[name] + 1, "tile": k // 3, "channel": "rgb"[k % 3]}
            for k, name in enumerate(layers.masks)
        },
    }


def tiled(masks: Sequence[npt.NDArray[np.uint8]]) -> npt.NDArray[np.uint8]:
    """Return one picture (h, w, 3) of masks (s, s): three to a tile, and tiles in rows.

    Tiles have a quarter of the width of masks, but all of up to 256 texels.

    Examples
    --------
    >>> tiled([np.full((1024, 1024), 7, np.uint8)] * 13).shape
    (512, 1024, 3)
    """
    size = len(masks[0])
    step = size // max(size // 4, min(size, 256))
    small = [mask.reshape(size // step, step, size // step, step).mean(axis=(1, 3)) for mask in masks]
    small += [np.zeros_like(small[0])] * (-len(small) % (3 * COLUMNS))
    grid = np.rint(small).astype(np.uint8).reshape(-1, COLUMNS, 3, *small[0].shape)
    return grid.transpose(0, 3, 1, 4, 2).reshape(-1, COLUMNS * small[0].shape[1], 3)
