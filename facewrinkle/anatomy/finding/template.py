"""The built-in head as a template: faces of several people, with the mouth closed, open or drawn aside."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ...array_types import Array, IntArray
from ..atlas import load_atlas
from ..identity import Identity, head_of
from ..jaw import jaw_weights
from ..landmarks import NAMES, FaceFrame, frame_of
from ..muscles import JawMuscle
from .depth import Grid, depth_map, openings_closed

UNMEASURED = (
    "trichion",
    "forehead_mid",
    *(f"brow_{side}_{part}" for side in "lr" for part in ("inner", "mid", "outer")),
    *(f"{name}_{side}" for name in ("malar", "zygion", "gonion") for side in "lr"),
    "eye_l_centre",
    "eye_r_centre",
    "menton",
)
"""Landmarks that the shape does not show, or not from the front: estimates. But the menton is measured on a chin that
is seen to turn under.
"""

MEAN = Identity()

MOUTH_RADIUS = 0.5
"""Distance from the middle of the mouth at which the skin goes with it by 1 / e, in distances between the pupils."""


@dataclass(frozen=True)
class TemplateVariant:
    """One of the shapes that the template takes.

    Attributes
    ----------
    identity : Identity
    jaw : float
        Contraction of the muscle that opens the jaw; 1 opens it fully.
    mouth_shift : float
        Shift of the mouth to the left, in distances between the pupils.
    """

    identity: Identity = MEAN
    jaw: float = 0.0
    mouth_shift: float = 0.0


AT_REST = (
    TemplateVariant(),
    TemplateVariant(Identity(length=1.0)),
    TemplateVariant(Identity(width=1.0, cheeks=0.6, nose_width=0.8)),
    TemplateVariant(Identity(width=-1.0, cheeks=-0.6, nose_width=-0.6)),
    TemplateVariant(Identity(age=1.0, lips=-0.7)),
)
"""The mean face, a long, a broad, a narrow and an old one: their mean landmarks depend less on the shape of any one."""

VARIANTS = (
    *AT_REST,
    TemplateVariant(jaw=0.5),
    TemplateVariant(jaw=1.2),
    TemplateVariant(mouth_shift=0.22),
    TemplateVariant(mouth_shift=-0.22),
)
"""All variants, the mean face first; the last four have mouths where a warp from a closed one would not find them."""


@dataclass(frozen=True, eq=False)
class Template:
    """A face in distances between its pupils, from the middle between its eyes, +x to the subject's left, +z forward.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    landmarks : dict of str to ndarray, shape (3,)
    mouth_open : bool
    """

    points: Array
    triangles: IntArray
    landmarks: dict[str, Array]
    mouth_open: bool = False

    def depth(self, grid: Grid) -> tuple[Array, Array]:
        """Depth over a grid with the openings closed, and the weight of every place, 0 outside of the face."""
        depth, known = openings_closed(depth_map(self.points, self.triangles, grid), grid, self.mouth_open)
        return depth, self._weight(grid) * known

    def _weight(self, grid: Grid) -> Array:
        """1 inside an oval from below the hairline to the chin, falling to 0 at its border."""
        top, bottom = self.landmarks["forehead_mid"][1] + 0.12, self.landmarks["menton"][1] - 0.22
        side = 0.93 * self.landmarks["zygion_l"][0]
        x, y = np.meshgrid(grid.x, grid.y)
        radius = np.hypot(x / side, (y - 0.5 * (top + bottom)) / (0.5 * (top - bottom)))
        return np.clip((1.0 - radius) / 0.12, 0.0, 1.0)


@cache
def template(variant: int = 0) -> Template:
    """Return the built-in head as one of :data:`VARIANTS`, the mean face by default."""
    chosen = VARIANTS[variant]
    head = head_of(chosen.identity)
    marks = {name: head.landmarks[name] for name in NAMES}
    frame = frame_of(marks)
    rest = np.asarray(head.points, dtype=np.float64)
    points = _deformed(rest, head.triangles, marks, frame, chosen)
    nearest = cKDTree(rest).query(np.array(list(marks.values())))[1]
    shift = dict(zip(marks, (points - rest)[nearest], strict=True))
    return Template(
        frame.local(points),
        np.asarray(head.triangles, dtype=np.int64),
        {name: frame.local(point + shift[name]) for name, point in marks.items()},
        chosen.jaw > 0.0,
    )


def _deformed(
    points: Array, triangles: npt.NDArray[np.int32], marks: dict[str, Array], frame: FaceFrame, variant: TemplateVariant
) -> Array:
    """The points of a head with its jaw open, or its mouth drawn aside."""
    moved = points.copy()
    if variant.jaw:
        jaw = load_atlas().place(marks, frame)["jaw"]
        assert isinstance(jaw, JawMuscle)
        weights = jaw_weights(jaw, points, triangles, marks, frame)
        moved[weights.vertices] += weights.turned(points, variant.jaw)
    if variant.mouth_shift:
        offset = (points - 0.5 * (marks["mouth_l"] + marks["mouth_r"])) / frame.pupil_distance
        share = np.exp(-(offset**2).sum(axis=1) / MOUTH_RADIUS**2)
        moved += variant.mouth_shift * frame.pupil_distance * share[:, None] * frame.axes[0]
    return moved
