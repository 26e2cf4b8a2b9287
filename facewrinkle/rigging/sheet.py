"""A contact sheet of a rig: all of its shapes, as a program shows them that knows nothing but the written file."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from PIL import Image as Pillow
from PIL import ImageDraw

from ..array_types import Image
from ..plotting import Style, side_by_side, stacked
from ..plotting.images import rendered, texture
from ..plotting.views import aim
from ..progress import Progress, bar
from .linear_rig import Rig


def sheet(rig: Rig, *, columns: int = 8, size: int = 240, progress: Progress | None = None) -> Image:
    """Return pictures of all shapes of a rig at weight 1, with their names, after one of the face at rest.

    Parameters
    ----------
    rig : Rig
    columns : int
        Pictures in a row.
    size : int
        Width and height of a picture, pixels.
    progress : callable, optional
        As in :func:`facewrinkle.rig`.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)

    Examples
    --------
    >>> import facewrinkle as fw
    >>> made = fw.rig(fw.default_face(), shapes="jawOpen", level=0)
    >>> sheet(made, columns=2, size=80).shape
    (80, 164, 3)
    """
    plotter: Any = pv.Plotter(off_screen=True, window_size=[size, size], lighting="none")
    plotter.set_background("#4a4f57")
    aim(plotter, rig.face, Style((size, size)))
    names = ["", *rig.names]
    steps = (progress or bar)(names, "Pictures", len(names))
    try:
        shown = {part: rig.at({}, part) for part in rig.parts}
        for part, mesh in shown.items():
            _add(plotter, rig, part, mesh)
        images = [_labelled(_picture(plotter, rig, shown, name), name or "(rest)") for name in steps]
    finally:
        plotter.close()
    images += [np.full_like(images[0], 255)] * (-len(images) % columns)
    return stacked([side_by_side(images[k : k + columns]) for k in range(0, len(images), columns)])


def _add(plotter: Any, rig: Rig, part: str, mesh: pv.PolyData) -> None:
    photos = {"face": rig.face.texture} | {name: own.texture for name, own in rig.face.parts.items()}
    photo = photos.get(part)
    colours: dict[str, Any] = {"color": "#d8a78c"}
    if photo is not None and mesh.active_texture_coordinates is not None:
        colours = {"texture": texture(photo)}
    elif "Colors" in mesh.point_data:
        colours = {"scalars": "Colors", "rgb": True}
    plotter.add_mesh(
        mesh,
        name=part,
        **colours,
        show_scalar_bar=False,
        smooth_shading=True,
        split_sharp_edges=False,
        ambient=0.22,
        diffuse=0.7,
        specular=0.08,
        specular_power=14.0,
    )


def _picture(plotter: Any, rig: Rig, shown: dict[str, pv.PolyData], name: str) -> Image:
    for part, mesh in shown.items():
        now = rig.at({name: 1.0} if name else {}, part)
        mesh.points = now.points
        mesh.point_data["Normals"] = now.point_data["Normals"]
    return rendered(plotter, 1)


def _labelled(image: Image, text: str) -> Image:
    picture = Pillow.fromarray(image)
    ImageDraw.Draw(picture).text((5, 3), text, fill="white")
    return np.asarray(picture)
