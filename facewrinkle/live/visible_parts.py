"""A face as parts for a page: much of it is worked out there, from a few numbers of each frame.

Eyes turn and are shaded in the page, by the heights of their lids; teeth and tongue go with a matrix; brows and cropped
hair are bound to triangles of the skin; lashes are lines.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from PIL import Image

from ..anatomy.face import Face
from ..anatomy.long_hair import STRAND_AT
from ..anatomy.parts import ALONG
from ..appearance.eye import TINTS, PaintedEye
from ..appearance.fibers import Fibers
from ..appearance.flush import MOST, blood
from ..appearance.hair import Brows, CroppedHair, Lashes
from ..appearance.seen import Appearance, own_parts
from ..appearance.skin_paint import cavity_shading, furrow_shade
from ..appearance.smooth_skin import lifted_points, on_base
from ..appearance.visible_skin import VisibleSkin
from ..array_types import Array, IntArray
from ..geometry import closest, interpolated, split_vertices, unit, vertex_normals
from ..mesh.arrays import COLORS, CORNERS, FrameState, corner_texture, has_colors, in_bytes, is_frame, rest_of
from ..plotting.images import encoded
from ..plotting.lighting import light_at_rest
from ..plotting.scene import PLAIN_COLOR
from .protocol import FIBERS, LARGEST, Box, Part, small_normals


class VisibleParts:
    """The parts of a face, and what of them changes from frame to frame.

    Parameters
    ----------
    face : Face

    Attributes
    ----------
    box : Box
        Around all positions.
    version : int
        The number of the triangles of the skin.
    origin : ndarray of int, shape (p,)
        The vertex of the frame that each drawn vertex comes from; at seams of a photo there are several.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> parts = VisibleParts(face)
    >>> [part.name for part in parts.at(face.mesh)][:3]
    ['skin', 'eye_l', 'eye_r']
    """

    _versions = itertools.count(1)
    """Numbers of the triangles of skins, each of another one."""

    def __init__(self, face: Face) -> None:
        self.face = face
        self._appearance = Appearance.of(face)
        self._mouth = self._appearance.mouth
        self._visible = VisibleSkin(face, self._mouth.bag)
        own = [np.asarray(part.mesh.points, np.float64) for part in face.parts.values()]
        self.box = Box.around(face.points, *own)
        self.version, self.origin = 0, np.empty(0, np.int64)
        self._triangles: IntArray = np.empty((0, 3), np.int64)
        self._of_triangles: dict[str, np.ndarray] = {}
        self._on_base: tuple[IntArray, Array]
        self._arrays: dict[tuple[str, str], np.ndarray] = {}
        self._balls = [b for b in self._appearance.balls if b.open and f"eye_{b.eye.side}" not in self._appearance.own]
        self._eyeballs = [_eye(ball) for ball in self._balls]
        inside = self._mouth.inside(face.points, 0.0) if len(self._mouth.loop) or self._mouth.bag else {}
        self._teeth = {name: _rigid(mesh) for name, mesh in inside.items() if name not in self._appearance.own}
        self._bound = [_bound(name, hair, face) for name, hair in self._appearance.bound_hair.items()]

    def at(self, frame: pv.PolyData, exact: bool = False) -> list[Part]:
        """Return the parts in a frame of a simulation, or in the mesh of the face.

        With `exact`, furrows are shaded as in pictures, where round pits are not; that takes 20 ms.
        """
        state = self.face.state_of(frame)
        points = np.asarray(state.points)
        return [
            self._skin(frame, exact),
            *self._eyes(points, state),
            *self._mouth_parts(points, state),
            *(self._lashes(f"lashes_{row.eye.side}", row, points) for row in self._appearance.lashes),
            *self._bound,
            *self._own(frame),
        ]

    def _same(self, part: str, name: str, values: np.ndarray) -> np.ndarray:
        """Return the array of the last call if it has the same values, so that a page is not sent it again."""
        before = self._arrays.get((part, name))
        if before is not None and np.array_equal(before, values):
            return before
        self._arrays[part, name] = values
        return values

    def _skin(self, frame: pv.PolyData, exact: bool) -> Part:
        triangles = np.asarray(frame.regular_faces)
        if not np.array_equal(triangles, self._triangles):
            self._triangles, self.version = triangles.copy(), next(self._versions)
            self._of_triangles, self._on_base = self._drawn(frame, triangles), on_base(self.face, frame)
        points, normals = lifted_points(self.face, frame, *self._on_base), _normals(frame)
        if not self.box.holds(points):
            self.box = Box.around(points, *([self.box.low[None], self.box.low[None] + self.box.size]))
        shade: Any = 0.0
        if is_frame(frame):
            dark = furrow_shade(np.asarray(frame.point_data["W"]))
            shade = 1.0 - cavity_shading(frame, self.face.unit)[:, 1] / 255.0 if exact and dark.any() else dark
            shade = shade[self.origin]
        moving = {
            "position": self._same("skin", "position", self.box.quantized(points[self.origin])),
            "normal": self._same("skin", "normal", small_normals(normals[self.origin], shade)),
            "blood": self._same("skin", "blood", self._blood(frame)),
        }
        info = {"base": self.face.mesh.n_points, "version": self.version}
        return Part("skin", "skin", self._of_triangles | moving, info)

    def _blood(self, frame: pv.PolyData) -> npt.NDArray[np.int8]:
        """How much more blood than at rest the skin holds, by its share of the most."""
        base = blood(self.face, np.asarray(frame.points, np.float64)[: len(self.face.points)])[:, None]
        whole = np.concatenate([base, interpolated(base, *self._on_base)])
        return np.rint(whole[self.origin, 0] * (127.0 / MOST)).astype(np.int8)

    def _drawn(self, frame: pv.PolyData, triangles: IntArray) -> dict[str, np.ndarray]:
        """The arrays of the skin that change only with its triangles."""
        self.origin, drawn, texture = np.arange(frame.n_points), triangles, None
        photographed = self.face.texture is not None
        corners = corner_texture(frame) if photographed and CORNERS in frame.cell_data else None
        if corners is not None:
            parts = split_vertices(triangles, corners, frame.n_points)
            self.origin, drawn, texture = parts.origin, parts.triangles, parts.values
        elif photographed:
            texture = frame.active_texture_coordinates
        own = _skin_colors(frame, self._appearance) if texture is None else _texture_numbers(np.asarray(texture))
        lined = self._visible.lined(frame, triangles)
        open_ones = np.vstack([self._visible.across(frame, triangles), np.asarray(drawn)[~lined]])
        kind = np.uint16 if len(self.origin) <= LARGEST else np.uint32
        return {
            "reached": light_at_rest(self.face, frame)[self.origin],
            "index": open_ones.astype(kind),
            "lined": np.asarray(drawn)[lined].astype(kind),
            "color" if texture is None else "texture": own,
        }

    def _eyes(self, points: Array, state: FrameState) -> list[Part]:
        parts = []
        for ball, eye in zip(self._balls, self._eyeballs, strict=True):
            gaze = state.gazes.get(ball.eye.side, ball.eye.gaze)
            lids = ball.lid_heights(points, np.linspace(-1.1, 1.1, 48)).astype(np.float32)  # radii from the middle
            axes = np.round(ball.axes(np.asarray(gaze)), 6).ravel().tolist()
            arrays = {**eye.arrays, "lids": self._same(eye.name, "lids", lids)}
            parts.append(Part(eye.name, "eye", arrays, {**eye.info, "axes": axes}))
        for margin in self._appearance.lid_margins:
            parts.append(self._mesh(f"rim_{margin.eye.side}", margin.at(points), "rim"))
        return parts

    def _mouth_parts(self, points: Array, state: FrameState) -> list[Part]:
        mouth, parts = self._mouth, []
        if len(mouth.loop):
            parts.append(self._mesh("mouth", mouth.pocket(points, state.jaw_angle, state.mandible), "plain"))
        shown = bool(self._teeth) and mouth.parted(points)
        turn, shift = mouth.motion(points, state.jaw_angle, state.mandible) if shown else (np.eye(3), np.zeros(3))
        for name, arrays in self._teeth.items():
            matrix = np.eye(4)
            if name == "tongue" and shown:
                soft = _rigid(mouth.tongue(points, turn, shift, state.tongue))
                arrays = {key: self._same(name, key, values) for key, values in soft.items()}
            if name != "upper_teeth":
                matrix[:3, :3], matrix[:3, 3] = turn, shift
            info: dict[str, Any] = {"visible": shown, "matrix": np.round(matrix, 6).T.ravel().tolist()}
            parts.append(Part(name, "teeth", arrays, info))
        return parts

    def _lashes(self, name: str, row: Lashes, points: Array) -> Part:
        lines = row.lines(points).points
        away = lines - lines[:, :1]
        scale = float(np.abs(away).max()) / 127.0
        arrays = {
            "half": self._same(name, "half", row.half.astype(np.float32)),
            "tint": self._same(name, "tint", np.rint(row.tint).astype(np.uint8)),
            "root": self._same(name, "root", self.box.quantized(lines[:, 0])),
            "away": self._same(name, "away", np.rint(away / scale).astype(np.int8).reshape(-1, 3)),
        }
        return Part(name, "lashes", arrays, {"knots": lines.shape[1], "scale": scale})

    def _own(self, frame: pv.PolyData) -> list[Part]:
        parts = []
        for name, mesh in own_parts(self.face, frame).items():
            textured = self.face.parts[name].texture is not None
            kind = "eye_part" if name.startswith("eye") else "skin_part"
            if name == "hair" and not textured:
                kind = "locks" if STRAND_AT in mesh.point_data else "hair_part"
            parts.append(self._mesh(f"own {name}", mesh, kind, textured))
        return parts

    def _mesh(self, name: str, mesh: pv.PolyData, kind: str, textured: bool = False) -> Part:
        """A part whose points move freely and whose triangles stay."""
        points, triangles = np.asarray(mesh.points, np.float64), mesh.regular_faces
        arrays = {"position": self._same(name, "position", self.box.quantized(points))}
        if kind != "plain":
            arrays["normal"] = self._same(name, "normal", small_normals(_normals(mesh)))
        if kind == "locks":
            arrays["strand"] = self._same(name, "strand", np.asarray(mesh.point_data[STRAND_AT], np.float32))
            arrays["along"] = self._same(name, "along", small_normals(np.asarray(mesh.point_data[ALONG])))
        places = mesh.active_texture_coordinates if textured else None
        if places is not None:
            arrays["texture"] = self._same(name, "texture", np.asarray(places, np.float32))
        else:
            arrays["color"] = self._same(name, "color", _colors(mesh))
        arrays["index"] = self._same(name, "index", _indices(triangles))
        return Part(name, kind, arrays)

    def fibers(self, frame: pv.PolyData, rates: Mapping[str, float]) -> Part:
        """Return the fibers of muscles in a frame, and their contractions from 0 to 255."""
        fibers = Fibers.of(self.face)
        arrays: dict[str, np.ndarray] = {
            "half": self._same(FIBERS, "half", fibers.half.astype(np.float32)),
            "muscle": self._same(FIBERS, "muscle", fibers.muscle.astype(np.uint8)),
            "position": self._same(FIBERS, "position", self.box.quantized(fibers.at(frame).reshape(-1, 3))),
            "rate": np.array([round(255.0 * rates.get(name, 0.0)) for name in fibers.names], np.uint8),
        }
        return Part(FIBERS, FIBERS, arrays, {"names": fibers.names, "knots": fibers.half.shape[1]})

    def pins(self, frame: pv.PolyData, places: Mapping[str, Sequence[float]]) -> Part:
        """Return the triangles of a frame that places at rest lie in, by their corners, and their shares in these."""
        rest, triangles = rest_of(frame), frame.regular_faces
        corners, shares = [], []
        for place in np.array(list(places.values())):
            near = np.zeros(len(rest), bool)
            near[np.argpartition(((rest - place) ** 2).sum(axis=1), 8)[:8]] = True
            around = triangles[near[triangles].any(axis=1)]
            triangle, share, _ = closest(rest, around, place)
            corners.append(around[triangle])
            shares.append(share)
        arrays = {
            "corners": self._same("probes", "corners", np.array(corners, np.uint32)),
            "shares": self._same("probes", "shares", np.array(shares, np.float32)),
        }
        return Part("probes", "probes", arrays, {"names": list(places)})

    def photos(self) -> dict[str, bytes]:
        """Return photos as JPEG files, or PNG where they are transparent: of the skin, and of parts by their names."""
        pictures = {"skin": self.face.texture}
        pictures |= {f"own {name}": self.face.parts[name].texture for name in self._appearance.own}
        return {name: _file(picture) for name, picture in pictures.items() if picture is not None}


def _texture_numbers(places: np.ndarray) -> np.ndarray:
    """Texture coordinates as whole numbers if they lie in the picture, and as they are where it is repeated."""
    small = places.min() >= 0.0 and places.max() <= 1.0
    return np.rint(LARGEST * places).astype(np.uint16) if small else places.astype(np.float32)


def _skin_colors(frame: pv.PolyData, appearance: Appearance) -> npt.NDArray[np.uint8]:
    if has_colors(frame.point_data):
        return in_bytes(np.asarray(frame.point_data[COLORS])[:, :3])
    if appearance.painter is not None:
        return appearance.at(frame).paint
    return np.tile(np.rint(255.0 * np.array(PLAIN_COLOR)).astype(np.uint8), (frame.n_points, 1))


def _colors(mesh: pv.PolyData) -> npt.NDArray[np.uint8]:
    for name in ("paint", COLORS):
        if name in mesh.point_data:
            return in_bytes(np.asarray(mesh.point_data[name])[:, :3])
    return np.full((mesh.n_points, 3), 180, np.uint8)


def _normals(mesh: pv.PolyData) -> Array:
    if "Normals" in mesh.point_data:
        return np.asarray(mesh.point_data["Normals"])
    return vertex_normals(np.asarray(mesh.points, np.float64), mesh.regular_faces)


def _indices(triangles: IntArray) -> npt.NDArray[Any]:
    small = not len(triangles) or triangles.max() <= LARGEST
    return np.ascontiguousarray(triangles, np.uint16 if small else np.uint32).ravel()


def _eye(ball: PaintedEye) -> Part:
    eye = ball.eye
    quads = ball.quads
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)  # side by side: software works corners out only once
    arrays: dict[str, np.ndarray] = {
        "sphere": ball.sphere.astype(np.float32),
        "cornea": ball.cornea.astype(np.float32),
        "color": np.rint(np.clip(ball.tints, 0.0, 255.0)).astype(np.uint8),
        "index": _indices(triangles),
    }
    corner = ball.corners[0] - eye.centre
    info = {
        "centre": np.round(eye.centre, 6).tolist(),
        "radius": float(eye.radius),
        "lid_axes": np.round(ball.lid_axes, 6).ravel().tolist(),
        "corner": np.round(corner / np.linalg.norm(corner), 6).tolist(),
        "caruncle": np.round(TINTS["caruncle"] / 255.0, 6).tolist(),
        "tears": np.round(TINTS["tears"] / 255.0, 6).tolist(),
    }
    return Part(f"eye_{eye.side}", "eye", arrays, info)


def _rigid(mesh: pv.PolyData) -> dict[str, np.ndarray]:
    points, triangles = mesh.points, mesh.regular_faces
    return {
        "position": np.asarray(points, np.float32),
        "normal": small_normals(np.asarray(mesh.point_data["Normals"])),
        "color": np.asarray(mesh.point_data["paint"], np.uint8),
        "index": _indices(np.asarray(triangles)),
    }


def _bound(name: str, hairs: Brows | CroppedHair, face: Face) -> Part:
    """Hairs bound to the triangles under them: coordinates along two edges, and the height above."""
    points, triangles = face.points, face.triangles
    lines = hairs.lines(points, triangles, vertex_normals(points, triangles)).points
    corners = triangles[np.repeat(hairs.hairs.triangles, len(lines) // len(hairs.hairs.triangles), axis=0)]
    a, b, c = (points[corners[..., k]] for k in range(3))
    frame = np.stack([b - a, c - a, unit(np.cross(b - a, c - a))], axis=-1)
    place = np.linalg.solve(frame, (lines - a)[..., None])[..., 0]
    arrays: dict[str, np.ndarray] = {
        "corners": corners.reshape(-1, 3).astype(np.uint16 if len(points) <= LARGEST else np.uint32),
        "place": place.reshape(-1, 3).astype(np.float32),
        "half": np.ascontiguousarray(hairs.half, np.float32),
        "tint": np.rint(np.clip(hairs.tint, 0.0, 255.0)).astype(np.uint8),
    }
    return Part(name, "bound", arrays, {"knots": int(lines.shape[1])})


def _file(picture: np.ndarray) -> bytes:
    clear = picture.shape[-1] == 4 and bool((picture[..., 3] < 255).any())
    image = Image.fromarray(np.ascontiguousarray(picture if clear else picture[..., :3]))
    image.thumbnail((4096, 4096))  # which all graphics cards take
    return encoded(np.asarray(image), ".png" if clear else ".jpg")
