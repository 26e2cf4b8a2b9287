"""What faces look like: depth, relief and landmarks of the built-in head as several people, in their own frames."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from ..identity import Identity, head_of
from ..landmarks import NAMES, frame_of
from .depth import Grid, closed, depth_map

Array = npt.NDArray[np.float64]

PEOPLE = (
    Identity(),
    Identity(length=1.0),
    Identity(width=1.0, cheeks=0.6, nose_width=0.8),
    Identity(width=-1.0, cheeks=-0.6, nose_width=-0.6),
    Identity(age=1.0, lips=-0.7),
)
"""The mean face, a long, a broad, a narrow and an old one: what they agree on is less any one's own shape."""


@dataclass(frozen=True, eq=False)
class Template:
    """The face in distances between its pupils, from the middle between its eyes, +x to the subject's left, +z forward.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    landmarks : dict of str to ndarray, shape (3,)
    """

    points: Array
    triangles: npt.NDArray[np.int64]
    landmarks: dict[str, Array]

    def depth(self, grid: Grid) -> tuple[Array, Array]:
        """Depth over a grid with the openings closed, and how much every place counts, 0 outside of the face."""
        raw = depth_map(self.points, self.triangles, grid)
        depth, known = closed(raw, grid)
        return depth, self._weight(grid) * known

    def _weight(self, grid: Grid) -> Array:
        """1 inside an oval from below the hairline to the chin, falling to 0 at its border."""
        top, bottom = self.landmarks["forehead_mid"][1] + 0.12, self.landmarks["menton"][1] - 0.22
        side = 0.93 * self.landmarks["zygion_l"][0]
        x, y = np.meshgrid(grid.x, grid.y)
        radius = np.hypot(x / side, (y - 0.5 * (top + bottom)) / (0.5 * (top - bottom)))
        return np.clip((1.0 - radius) / 0.12, 0.0, 1.0)


@cache
def template(person: int = 0) -> Template:
    """The built-in head as a template: one of :data:`PEOPLE`, the mean face first."""
    head = head_of(PEOPLE[person])
    marks = {name: head.landmarks[name] for name in NAMES}
    frame = frame_of(marks)

    def local(points: Array) -> Array:
        return (points - frame.origin) @ frame.axes.T / frame.pupil_distance

    return Template(
        local(np.asarray(head.points, dtype=np.float64)),
        np.asarray(head.triangles, dtype=np.int64),
        {name: local(point) for name, point in marks.items()},
    )
