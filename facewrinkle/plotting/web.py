"""What browsers draw a face with, as pictures show it: modules of JavaScript, shaders of pictures, and cameras."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from importlib.abc import Traversable
from importlib.resources import files
from typing import Any

import numpy as np

from ..anatomy import MEAN_PUPIL_DISTANCE, Face
from ..appearance.fibers import BENEATH, CONTRACTED, OPACITY, RELAXED
from ..appearance.flush import ABSORBANCE, MOST
from ..appearance.smooth_skin import BEND
from ..geometry.depth_buffer import FADE, GRAZING, RAISED, on_disk
from ..geometry.smooth_split import LARGEST, ROUNDS
from .lighting import IN_SHADE, LEAST, RAYS, SOFT, STEP, WET
from .scene import BACKGROUND
from .shaders import EYE_MATERIAL, LOCKS, SKIN_MATERIAL, TEETH_MATERIAL, hair_code, strand_code
from .views import LIGHTS, VIEW_ANGLE, VIEWS
from .wet import FULLY_WET, tear_code

TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}
"""Kinds of files of a page, by their endings."""


def web_files(folder: Traversable) -> dict[str, tuple[str, bytes]]:
    """Return the files of a page with their types, by name: those of a folder, and those that draw a face.

    Examples
    --------
    >>> sorted(web_files(files("facewrinkle.plotting") / "page"))[:3]
    ['camera.js', 'hair.js', 'materials.js']
    """
    found = {"materials.js": (TYPES["js"], _materials().encode())}
    for entry in (*files(__package__).joinpath("page").iterdir(), *folder.iterdir()):
        ending = entry.name.rpartition(".")[2]
        if ending in TYPES:
            found[entry.name] = TYPES[ending], entry.read_bytes()
    return found


def _materials() -> str:
    """Return the module with what pictures and pages have in common: shaders, lights and colors."""
    room, tear = tear_code("aspect", "focal", FULLY_WET)
    constants = {
        "MATERIALS": {
            "tear_declarations": room,
            "tear": tear.replace("gl_FragData[0]", "vec4 color_of_tear"),
            "skin": SKIN_MATERIAL.code(len(LIGHTS), reached="reached"),
            "eye": EYE_MATERIAL.code(len(LIGHTS)),
            "teeth": TEETH_MATERIAL.code(len(LIGHTS)),
            "hair_part": hair_code(len(LIGHTS), LOCKS),
            "locks": hair_code(len(LIGHTS), LOCKS, strands=True),
            "strands": strand_code(len(LIGHTS)),
        },
        "LIGHTS": [{"direction": where, "color": [strength * c for c in color]} for where, color, strength in LIGHTS],
        "KEY": {
            "step": STEP / MEAN_PUPIL_DISTANCE,
            "soft": SOFT / MEAN_PUPIL_DISTANCE,
            "rays": on_disk(RAYS).tolist(),
            "raised": RAISED,
            "fade": FADE,
            "grazing": GRAZING,
            "least": LEAST,
            "in_shade": IN_SHADE,
            "wet": WET,
            "texels": 512,  # of the picture from the key lamp: narrower than STEP on the built-in head
        },
        "FIBERS": {"relaxed": [*RELAXED], "contracted": [*CONTRACTED], "opacity": OPACITY, "beneath": BENEATH},
        "SMOOTH": {"bend": BEND, "rounds": ROUNDS, "largest": LARGEST},
        "BLOOD": (MOST * ABSORBANCE).tolist(),
        "VIEW_ANGLE": VIEW_ANGLE,
        "BACKGROUND": BACKGROUND,
    }
    return "\n".join(f"export const {name} = {json.dumps(value)};" for name, value in constants.items())


def bundled(files: Mapping[str, tuple[str, bytes]], name: str) -> str:
    """Return the text of one module in which `made` is what another exports; it holds those that that one uses.

    Examples
    --------
    >>> text = bundled({"a.js": ("", b'import { b } from "./b.js";'), "b.js": ("", b"export const b = 1;")}, "a.js")
    >>> text.index("export const b") < text.index("import { b }")
    True
    """
    order: list[str] = []

    def visit(each: str) -> None:
        if each not in order:
            for used in re.findall(r'from "\./([\w]+\.js)"', files[each][1].decode()):
                visit(used)
            order.append(each)

    visit(name)
    sources = json.dumps({each: files[each][1].decode() for each in order}).replace("</", "<\\/")
    return f"""const sources = {sources}, places = {{}};
for (const [name, source] of Object.entries(sources)) {{ // each after those that it uses
  const text = source.replace(/from "\\.\\/([\\w]+\\.js)"/g, (_, used) => `from "${{places[used]}}"`);
  places[name] = URL.createObjectURL(new Blob([text], {{ type: "text/javascript" }}));
}}
const {{ default: made }} = await import(places[{json.dumps(name)}]);
"""


def cameras_of(face: Face) -> dict[str, Any]:
    """Return what a page places its camera by: axes, size, and views by name.

    A view is the direction towards the camera, the point that it looks at, and the height of the picture.
    """
    axes, size = face.frame.axes, face.frame.pupil_distance
    views = {}
    for name, view in VIEWS.items():
        towards = np.asarray(view.direction) @ axes
        views[name] = [*(towards / np.linalg.norm(towards)).tolist(), *view.focus(face).tolist(), view.height * size]
    return {"axes": axes.tolist(), "size": size, "views": views}
