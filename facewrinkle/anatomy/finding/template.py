"""What faces look like: depth, relief and landmarks of the built-in head as several people, in their own frames; and
with the mouth open or drawn aside.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..atlas import load_atlas
from ..identity import Identity, head_of
from ..jaw import jaw_weights
from ..landmarks import NAMES, FaceFrame, frame_of
from ..muscles import JawMuscle
from .depth import Grid, closed, depth_map

Array = npt.NDArray[np.float64]


MEAN = Identity()


@dataclass(frozen=True)
class Look:
    """A person, how far the jaw is open (1: as far as the muscle opens it), and how far the mouth is drawn to the left,
    in distances between the pupils.
    """

    person: Identity = MEAN
    jaw: float = 0.0
    aside: float = 0.0


PEOPLE = (
    Look(),
    Look(Identity(length=1.0)),
    Look(Identity(width=1.0, cheeks=0.6, nose_width=0.8)),
    Look(Identity(width=-1.0, cheeks=-0.6, nose_width=-0.6)),
    Look(Identity(age=1.0, lips=-0.7)),
)
"""The mean face, a long, a broad, a narrow and an old one: what they agree on is less any one's own shape."""

LOOKS = (*PEOPLE, Look(jaw=0.5), Look(jaw=1.2), Look(aside=0.22), Look(aside=-0.22))
"""All templates: also those whose mouths are where a warp from a closed one would not find them."""

ASIDE = 0.5
"""How far round the middle of the mouth the skin goes with it, in distances between the pupils."""


@dataclass(frozen=True, eq=False)
class Template:
    """The face in distances between its pupils, from the middle between its eyes, +x to the subject's left, +z forward.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    landmarks : dict of str to ndarray, shape (3,)
    agape : bool
        Whether the mouth is open.
    """

    points: Array
    triangles: npt.NDArray[np.int64]
    landmarks: dict[str, Array]
    agape: bool = False

    def depth(self, grid: Grid) -> tuple[Array, Array]:
        """Depth over a grid with the openings closed, and how much every place counts, 0 outside of the face."""
        raw = depth_map(self.points, self.triangles, grid)
        depth, known = closed(raw, grid, self.agape)
        return depth, self._weight(grid) * known

    def _weight(self, grid: Grid) -> Array:
        """1 inside an oval from below the hairline to the chin, falling to 0 at its border."""
        top, bottom = self.landmarks["forehead_mid"][1] + 0.12, self.landmarks["menton"][1] - 0.22
        side = 0.93 * self.landmarks["zygion_l"][0]
        x, y = np.meshgrid(grid.x, grid.y)
        radius = np.hypot(x / side, (y - 0.5 * (top + bottom)) / (0.5 * (top - bottom)))
        return np.clip((1.0 - radius) / 0.12, 0.0, 1.0)


@cache
def template(look: int = 0) -> Template:
    """The built-in head as a template: one of :data:`LOOKS`, the mean face first."""
    chosen = LOOKS[look]
    head = head_of(chosen.person)
    marks = {name: head.landmarks[name] for name in NAMES}
    frame = frame_of(marks)
    points = np.asarray(head.points, dtype=np.float64)
    there = _posed(points, head.triangles, marks, frame, chosen)
    nearest = cKDTree(points).query(np.array(list(marks.values())))[1]
    shift = dict(zip(marks, (there - points)[nearest], strict=True))

    def local(points: Array) -> Array:
        return (points - frame.origin) @ frame.axes.T / frame.pupil_distance

    return Template(
        local(there),
        np.asarray(head.triangles, dtype=np.int64),
        {name: local(point + shift[name]) for name, point in marks.items()},
        chosen.jaw > 0.0,
    )


def _posed(
    points: Array, triangles: npt.NDArray[np.int32], marks: dict[str, Array], frame: FaceFrame, look: Look
) -> Array:
    """The points of a head with its jaw open, or its mouth drawn aside."""
    there = points.copy()
    if look.jaw:
        jaw = load_atlas().place(marks, frame)["jaw"]
        assert isinstance(jaw, JawMuscle)
        guide = jaw_weights(jaw, points, triangles, marks, frame)
        there[guide.vertices] += guide.turned(points, look.jaw)
    if look.aside:
        at = (points - 0.5 * (marks["mouth_l"] + marks["mouth_r"])) / frame.pupil_distance
        near = np.exp(-(at**2).sum(axis=1) / ASIDE**2)
        there += look.aside * frame.pupil_distance * near[:, None] * frame.axes[0]
    return there
