"""All that is seen of a face: made once for the face, worked out once for each frame, whatever draws or writes it."""

from __future__ import annotations

from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy import Face, Part, per_face
from ..array_types import Array, IntArray
from ..geometry import unit
from ..mesh import has_colors, is_frame, rest_of, split_at_seams, with_normals
from .eye import LidMargin, PaintedEye, coarser, eye_paint
from .flush import flush
from .hair import KINDS, Brows, CroppedHair, HairLines, Lashes, fitted_brows
from .mouth import TONGUE_COLOR, Mouth
from .skin_paint import SkinPainter, cavity_shading
from .smooth_skin import SmoothSkin


class Appearance:
    """Paint, eyes, mouth and hair of a face.

    Parameters
    ----------
    face : Face

    Examples
    --------
    Two scenes of one frame ask for the same, and get the same meshes:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> appearance = Appearance.of(face)
    >>> appearance.at(face.mesh).eyes["l"] is Appearance.of(face).at(face.mesh).eyes["l"]
    True
    """

    def __init__(self, face: Face) -> None:
        self.face = face
        self._last: tuple[pv.PolyData, int, Seen] | None = None

    @classmethod
    def of(cls, face: Face) -> Self:
        """Return the appearance of a face, made at the first call."""
        return per_face(face, "appearance", None, lambda: cls(face))

    def at(self, frame: pv.PolyData) -> Seen:
        """Return what is seen in a frame of :meth:`facewrinkle.Simulation.step`, or in ``face.mesh``."""
        time = frame.GetMTime()
        if self._last is None or self._last[0] is not frame or self._last[1] != time:
            self._last = frame, time, Seen(self, frame)
        return self._last[2]

    @cached_property
    def own(self) -> frozenset[str]:
        """Names of the parts that came with the face and are drawn as they are."""
        return frozenset(name for name, part in self.face.parts.items() if is_drawn(name, part, self.face))

    @cached_property
    def painter(self) -> SkinPainter | None:
        """Paints the skin, if it has landmarks but neither a texture nor colors."""
        face = self.face
        painted = face.landmarks and face.texture is None and not has_colors(face.mesh.point_data)
        return SkinPainter(face) if painted else None

    @cached_property
    def base_paint(self) -> npt.NDArray[np.uint8]:
        """Colors (n0, 3) of the vertices of the face; for faces with a painter."""
        assert self.painter is not None
        return self.painter(self.face.points)

    @cached_property
    def balls(self) -> list[PaintedEye]:
        """Painted eyes of both sides, seen or not."""
        return [PaintedEye(eye, self.face) for eye in self.face.eyes]

    @cached_property
    def lid_margins(self) -> list[LidMargin]:
        """The flesh before eyes that the lids leave open, where there is any."""
        margins = [LidMargin(ball.eye, self.face) for ball in self.balls if ball.open]
        return [margin for margin in margins if len(margin.loop)]

    @cached_property
    def mouth(self) -> Mouth:
        """Pocket, teeth and tongue."""
        return Mouth(self.face)

    @cached_property
    def lashes(self) -> list[Lashes]:
        """Painted lashes, where none came with the face."""
        growing = [ball for ball in self.balls if ball.open or self.painter is not None]
        rows = [Lashes(ball.eye, self.face) for ball in growing if f"lashes_{ball.eye.side}" not in self.own]
        return [row for row in rows if row.roots]

    @cached_property
    def bound_hair(self) -> dict[str, Brows | CroppedHair]:
        """Painted brows and hair of the head, by name."""
        hair = self.face.bound_hair
        if "brows" not in hair and self.painter is not None:
            hair = {"brows": fitted_brows(self.face), **hair}
        return {name: KINDS[name](hairs, self.face) for name, hairs in hair.items()}


class Seen:
    """The sight of a face in one frame; each thing is worked out when it is first asked for.

    Eyes, mouth and hair are on the head in its place at rest: :attr:`pose` takes them along. Nothing of it may be
    changed.

    Attributes
    ----------
    skin : PolyData
        The frame with up-to-date normals.
    pose : ndarray, shape (4, 4)
        Motion of the head as a whole.
    """

    def __init__(self, appearance: Appearance, frame: pv.PolyData) -> None:
        self._of, self._frame = appearance, frame
        self._state = appearance.face.state_of(frame)
        self.skin, self.pose = with_normals(frame), self._state.head

    @cached_property
    def smooth(self) -> SmoothSkin:
        """The smooth surface of the skin, on which all else stands."""
        return SmoothSkin(self._of.face, self.skin, self.pose)

    @cached_property
    def _surface(self) -> tuple[Array, IntArray]:
        """Points and triangles of the smooth skin on the head at rest."""
        return self.smooth.on_head[0], self.smooth.split.triangles

    @cached_property
    def _points(self) -> Array:
        """The vertices (n0, 3) of the face on the head at rest."""
        return self._state.to_rest(self._state.points)

    @cached_property
    def eyes(self) -> dict[str, pv.PolyData]:
        """Painted eyes by side, seen or not, with the iris on the ball."""
        return self.eyes_from(None)

    def eyes_from(self, camera: Array | None) -> dict[str, pv.PolyData]:
        """Return painted eyes by side as a camera at a place (3,) of the frame sees them."""
        state = self._state
        place = None if camera is None else state.to_rest(camera[None])[0]
        return {ball.eye.side: ball.at(self._points, state.gazes.get(ball.eye.side), place) for ball in self._of.balls}

    @cached_property
    def lid_margins(self) -> dict[str, pv.PolyData]:
        """Flesh between lids and eyeballs, by side."""
        return {margin.eye.side: margin.at(self._points) for margin in self._of.lid_margins}

    @cached_property
    def pocket(self) -> pv.PolyData | None:
        """The dark behind lips that are a hole of the mesh."""
        mouth, state = self._of.mouth, self._state
        return mouth.pocket(self._points, state.jaw_angle, state.mandible) if len(mouth.loop) else None

    @cached_property
    def parted(self) -> bool:
        """True if the lips are farther apart than at rest."""
        return self._of.mouth.parted(self._points)

    @cached_property
    def inside_mouth(self) -> dict[str, pv.PolyData]:
        """Teeth and tongue by name, if they can be seen and none came with the face."""
        return self.mouth_parts if self.parted else {}

    @cached_property
    def mouth_parts(self) -> dict[str, pv.PolyData]:
        """Teeth and tongue by name, if none came with the face, whether they can be seen or not."""
        if not self._of.mouth.opens:
            return {}
        state = self._state
        parts = self._of.mouth.inside(self._points, state.jaw_angle, state.mandible, state.tongue)
        return {name: part for name, part in parts.items() if name not in self._of.own}

    @cached_property
    def hairs(self) -> dict[str, pv.PolyData]:
        """Painted brows and lashes as ribbons that do not depend on a picture, with `paint` (rgba), by name."""
        # One ribbon for two lashes or six hairs of brows: there is no end of pixels that would be worth more.
        found = {
            f"lashes_{row.eye.side}": row.cards(0.0, 2).along(self.lashes[row.eye.side].every(2))
            for row in self._of.lashes
        }
        if brows := self._of.bound_hair.get("brows"):
            found["brows"] = brows.cards(0.0, 6).along(self.bound_hair["brows"].every(6))
        return found

    @cached_property
    def lashes(self) -> dict[str, HairLines]:
        """Lashes by side."""
        return {row.eye.side: row.lines(self._points, self._surface) for row in self._of.lashes}

    @cached_property
    def bound_hair(self) -> dict[str, HairLines]:
        """Brows, lifted out of the folds of the skin, and cropped hair, by name."""
        skin = self._points, self._of.face.triangles, self._normals
        return {name: hair.lines(*skin, self._surface) for name, hair in self._of.bound_hair.items()}

    @cached_property
    def _normals(self) -> Array:
        """Normals (n0, 3) of the skin's own vertices."""
        return unit(np.asarray(self.skin.point_data["Normals"])[: len(self._points)] @ self.pose[:3, :3])

    @cached_property
    def own(self) -> dict[str, pv.PolyData]:
        """Parts that came with the face, by name, where they are in the frame."""
        return own_parts(self._of.face, self._frame)

    @cached_property
    def paint(self) -> npt.NDArray[np.uint8]:
        """Colors (n, 3) of the skin; for faces with a painter."""
        painter, base = self._of.painter, self._of.base_paint
        assert painter is not None
        return np.concatenate([base, painter(rest_of(self.skin)[len(base) :])])

    @cached_property
    def flush(self) -> Array:
        """Factors (n, 3) of the color of the smooth skin, by the blood in it."""
        return self.smooth.from_base(flush(self._of.face, self._points))

    @cached_property
    def shade(self) -> npt.NDArray[np.uint8] | None:
        """Factors (n, 3) of the skin's colors in furrows, as bytes; None for a frame without heights."""
        return cavity_shading(self.skin, self._of.face.unit) if is_frame(self.skin) else None


def companion_meshes(face: Face, frame: pv.PolyData, always: bool = False) -> dict[str, pv.PolyData]:
    """Return what is seen besides the skin in a frame: meshes by name, with `paint` (rgb) or texture coordinates.

    They are the parts that came with the face, painted eyes where it has none, the flesh between lids and eyeballs,
    painted brows and lashes, and, between parted lips, the dark pocket of the mouth, teeth and tongue. If `always` is
    true, the insides of a closed mouth are there, too: every frame has the same meshes with the same triangles.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sorted(companion_meshes(face, face.mesh))
    ['brows', 'eye_l', 'eye_r', 'lashes_l', 'lashes_r']
    >>> len(companion_meshes(face, face.mesh, always=True))
    9
    """
    seen, state = Appearance.of(face).at(frame), face.state_of(frame)
    own = {name: part.copy(deep=False) for name, part in seen.own.items()}
    eyes = {side: coarser(eye, 2) if always else eye for side, eye in seen.eyes.items()}
    parts = {f"eye_{side}": eye for side, eye in eyes.items() if f"eye_{side}" not in own}
    parts |= {f"rim_{side}": rim for side, rim in seen.lid_margins.items()}
    if seen.parted or always:
        parts |= ({"mouth": seen.pocket} if seen.pocket is not None else {}) | seen.mouth_parts
    parts |= seen.hairs
    parts = {name: part.copy() for name, part in parts.items()}
    for part in parts.values():
        part.points = state.from_rest(np.asarray(part.points, dtype=np.float64))
        if "Normals" in part.point_data:
            part.point_data["Normals"] = np.asarray(part.point_data["Normals"]) @ state.head[:3, :3].T
    return parts | own


# --- parts that came with a face and are drawn with their own shape and colors ---------------------------------------


def is_drawn(name: str, part: Part, face: Face) -> bool:
    """Return True if a part is drawn with its own shape.

    An eye that has no colors, or only one, would look blind: a painted one takes its place where the lids are open.
    In the same way, painted lashes take the place of hair cards whose picture is missing.
    """
    if name.startswith("lashes"):
        return not part.lacks_picture
    return not name.startswith("eye") or part.side not in face.eyelid_openings or not is_blind(part)


def is_blind(part: Part) -> bool:
    """Return True for an eye that has no colors, or only one."""
    one = not has_colors(part.mesh.point_data) or not np.ptp(part.mesh.point_data["Colors"], axis=0).any()
    return part.texture is None and bool(one)


def own_parts(face: Face, frame: pv.PolyData) -> dict[str, pv.PolyData]:
    """Return the parts by name that are drawn as they are, where they are in a frame.

    Parts without a texture have `paint` (rgb).
    """
    parts = {name: part for name, part in face.parts_at(frame).items() if is_drawn(name, face.parts[name], face)}
    eyes = {f"eye_{eye.side}": eye for eye in face.eyes}
    by_word = {"teeth": (214, 205, 186), "tongue": TONGUE_COLOR, "glasses": (40, 40, 44), "other": (150, 140, 134)}
    for name, part in parts.items():
        if face.parts[name].texture is not None:
            parts[name] = split_at_seams(part)
        elif name in eyes and is_blind(face.parts[name]):
            part.point_data["paint"] = eye_paint(np.asarray(face.parts[name].mesh.points), eyes[name], face)
        elif has_colors(part.point_data):
            part.point_data["paint"] = np.asarray(part.point_data["Colors"])
        else:
            color = next((c for stem, c in by_word.items() if stem in name), (62, 46, 38))  # that of hair
            part.point_data["paint"] = np.tile(np.array(color, np.uint8), (part.n_points, 1))
    return parts
