"""What stands around a head in a picture: lamps and gradients, or the user's own pictures and environment maps."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pyvista as pv
from scipy.ndimage import map_coordinates

from ..array_types import Array, Image
from ..errors import MeshError, ParameterError
from ..geometry import unit
from ..mesh.formats.radiance import radiance_of
from ..mesh.formats.textures import decoded
from ..plotting.scene import Scene
from ..plotting.shaders import developed
from ..plotting.views import LIGHTS, Lamp, View, add_lamps, placed
from .plan import Person, Plan
from .spec import InputFile, Spec, input_content
from .visible import Camera


def place(scene: Scene, plan: Plan, spec: Spec) -> None:
    """Give a scene the camera, the lamps and the background of a plan."""
    view, plotter = view_of(plan.camera), scene.plotter
    scene.look(view)
    plotter.camera.roll += plan.camera["roll"]
    plotter.remove_all_lights()
    focus, towards, right, up = placed(view, scene.face)
    turn = np.radians(plan.lights["turn"])
    right, towards = right * np.cos(turn) - towards * np.sin(turn), right * np.sin(turn) + towards * np.cos(turn)
    axes = np.stack([right, up, towards])
    add_lamps(plotter, focus, axes, lamps_of(plan, spec))
    behind = plan.background
    tint = np.array([1.0 + behind["warmth"], 1.0, 1.0 - behind["warmth"]])
    bottom, top = (np.clip(tint * behind[end], 0.0, 1.0).tolist() for end in ("bottom", "top"))
    plotter.renderer.set_background(bottom, top=top)
    width, height = plotter.window_size
    size, image = (width, height), None
    if spec.backgrounds:
        image = covering(spec.backgrounds[int(behind["picture"])], behind, size)
    elif spec.environments:
        image = seen_behind(Camera.of(plotter.camera, size), axes, plan, spec)
    if image is not None:
        plotter.renderer.SetBackgroundTexture(pv.Texture(image))
    plotter.renderer.SetTexturedBackground(image is not None)


def view_of(camera: dict[str, float]) -> View:
    """Return the view of a drawn camera.

    Examples
    --------
    >>> view = view_of({"yaw": 90.0, "pitch": 0.0, "roll": 0.0, "height": 4.0, "aside": 0.0, "above": 0.0})
    >>> tuple(round(x, 9) for x in view.direction)
    (1.0, 0.0, 0.0)
    """
    yaw, pitch = np.radians([camera["yaw"], camera["pitch"]])
    direction = (float(np.sin(yaw) * np.cos(pitch)), float(np.sin(pitch)), float(np.cos(yaw) * np.cos(pitch)))
    x, y, z = View((0.0, 0.0, 1.0)).offset
    aside, above = -camera["aside"], -camera["above"]
    offset = (x + aside * float(np.cos(yaw)), y + above, z - aside * float(np.sin(yaw)))
    return View(direction, offset=offset, height=camera["height"])


def files_of(plan: Plan, person: Person, spec: Spec) -> dict[str, str]:
    """Return the names of the user's files that a picture shows, by what they are."""
    found = {}
    if person.scan is not None:
        found["scan"] = Path(spec.faces.scans[person.scan].path).name
    if "environment" in plan.lights:
        found["environment"] = Path(spec.environments[int(plan.lights["environment"])].path).name
    if "picture" in plan.background:
        found["background"] = Path(spec.backgrounds[int(plan.background["picture"])].path).name
    return found


def lamps_of(plan: Plan, spec: Spec) -> list[Lamp]:
    """Return the lamps of a plan: those of the studio, or of its environment."""
    drawn, lamps = plan.lights, list(LIGHTS)
    strengths = [drawn[name] for name in ("key", "fill", "rim")]
    if spec.environments:
        lamps, strengths = lamps_in(environment(spec.environments[int(drawn["environment"])])), 3 * [drawn["key"]]
    warm = np.array([1.0 + drawn["warmth"], 1.0, 1.0 - drawn["warmth"]])
    return [
        (direction, tuple(np.clip(warm * color, 0.0, 1.0).tolist()), intensity * strength)
        for (direction, color, intensity), strength in zip(lamps, strengths, strict=True)
    ]


def covering(file: InputFile, drawn: dict[str, float], size: tuple[int, int]) -> Image:
    """Return a picture that covers a size (width, height): scaled, and cut where it is too wide or too high."""
    from PIL import Image as Pillow
    from PIL import ImageOps

    try:
        upright = Pillow.fromarray(decoded(content_of(file), Path(file.path).name, upright=True)[..., :3])
    except MeshError as problem:
        raise ParameterError(f"{file.path!r} cannot be read as a picture: {problem}") from None
    return np.array(ImageOps.fit(upright, size, centering=(drawn["across"], drawn["down"])))


def content_of(file: InputFile) -> bytes:
    """Return the content of a file of a specification, which must be what it was when that was read."""
    found, content = input_content(file.path)
    if found != file:
        raise ParameterError(f"{file.path!r} has changed since the set was begun. Put it back as it was.")
    return content


# --- environment maps: the whole sphere as a picture, its middle behind the camera ----------------------------------


@lru_cache(maxsize=2)
def environment(file: InputFile) -> Array:
    """Return the radiance (h, w, 3) of an environment map, the uppermost row first.

    It is scaled so that its three lamps have 1.8 together, and white in their light 1.
    """
    try:
        radiance = radiance_of(content_of(file), repr(file.path))
    except MeshError as problem:
        raise ParameterError(str(problem)) from None
    total = sum(intensity for _, _, intensity in lamps_in(radiance))
    return radiance * (1.8 / max(total, 1e-300))  # exposure is set by the three lamps together, as that of a camera


def lamps_in(radiance: Array) -> list[Lamp]:
    """Return three lamps that light a face as an environment does, the brightest first.

    Each has the vector sum of the light from the directions that are nearest to one of the lamps of the studio: a
    surface that all of these reach is lit by it as by them.

    Examples
    --------
    A lamp above the camera in a dim room:

    >>> room = np.full((32, 64, 3), 0.01)
    >>> room[6:10, 30:34] = 50.0
    >>> (direction, _, intensity), *others = lamps_in(room)
    >>> np.round(direction, 1) + 0.0, bool(intensity > 10.0 * sum(lamp[2] for lamp in others))
    (array([0. , 0.7, 0.7]), True)
    """
    from PIL import Image as Pillow

    step = max(len(radiance) // 32, 1)  # so many rows tell where lamps are
    channels = [Pillow.fromarray(np.float32(radiance[..., k])).reduce(step) for k in range(3)]
    light = np.stack([np.asarray(channel, np.float64) for channel in channels], axis=-1)
    rows, columns = light.shape[:2]
    elevation = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    azimuth = 2.0 * np.pi * (0.5 - (np.arange(columns) + 0.5) / columns)
    x, z = np.cos(elevation) * np.sin(azimuth), np.cos(elevation) * np.cos(azimuth)
    direction = np.stack([x, np.broadcast_to(np.sin(elevation), x.shape), z], axis=-1).reshape(-1, 3)
    angle = 2.0 * np.pi**2 / (rows * columns) * np.cos(elevation)  # solid angle of a pixel of each row
    light = (light * angle[..., None]).reshape(-1, 3)
    studio = unit(np.array([towards for towards, _, _ in LIGHTS]))
    nearest, found = (direction @ studio.T).argmax(axis=1), []
    for number, lamp in enumerate(studio):
        own = nearest == number
        vectors = light[own].T @ direction[own] / np.pi
        towards = unit(vectors.sum(axis=0) + 1e-12 * lamp)  # where all is dark
        color = np.maximum(vectors @ towards, 1e-300)
        found.append((tuple(towards.tolist()), tuple((color / color.max()).tolist()), float(color.max())))
    return sorted(found, key=lambda lamp: -lamp[2])


def seen_behind(camera: Camera, axes: Array, plan: Plan, spec: Spec) -> Image:
    """Return what a camera sees of an environment that stands along axes (3, 3) right, up and towards the camera."""
    radiance = environment(spec.environments[int(plan.lights["environment"])])
    rows, columns = np.indices(camera.size[::-1]).reshape(2, -1)
    x, y, z = axes @ camera.extrinsic[:3, :3].T @ camera.rays(rows, columns).T
    height, width = radiance.shape[:2]
    place = [
        np.arctan2(np.hypot(x, z), y) / np.pi * height - 0.5,
        (0.5 - np.arctan2(x, z) / (2.0 * np.pi)) * width - 0.5,
    ]
    seen = [map_coordinates(radiance[..., k], place, order=1, mode="grid-wrap") for k in range(3)]
    light = np.stack(seen, axis=-1).reshape(*camera.size[::-1], 3)
    return np.array(np.rint(255.0 * np.clip(developed(light), 0.0, 1.0)), np.uint8)
