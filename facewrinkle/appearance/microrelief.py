"""Pores and fine furrows of the skin: how large they are at which age, and how strong where.

Skin is covered by a net of fine furrows, 20 to 200 um deep, that bounds small fields, and by pores; with age the fields
grow and furrows that cross each other deepen [1]_. The net belongs to the material: what stretches the skin draws its
furrows apart and flattens them.

References
----------
.. [1] K. Hashimoto: New methods for surface ultrastructure: comparative studies of scanning electron microscopy,
   transmission electron microscopy and replica method. International Journal of Dermatology 13, 1974, p. 357-381.
"""

from __future__ import annotations

import numpy as np

from ..anatomy.face import Face
from ..anatomy.hairline import hair_cover
from ..anatomy.landmarks import of_side
from ..array_types import Array
from ..geometry.smoothstep import smoothstep
from .skin_paint import lips

FIELD, OLD_FIELD = 0.62, (1.0, 0.66, 0.8)
"""Size of the fields between furrows, mm on a face of average size: of the young; of the old to the side, upwards and
forward, as they grow along the lines in which skin is relaxed.
"""

DEPTH, OLD_DEPTH = 0.06, 0.075
"""Depth of the furrows of the young and the old, mm."""

STRONGER = (
    # landmark, reach in mm, strength there
    ("nose_tip", 13.0, 1.5),
    ("ala", 9.0, 1.4),
    ("malar", 17.0, 1.2),
    ("eye_centre", 13.0, 0.6),
    ("eye_outer", 8.0, 0.8),
)
"""Places where pores are wider, or skin is thinner, than elsewhere."""


def relief_strength(points: Array, face: Face) -> Array:
    """Return the strength (n,) of the relief at points (n, 3) of a face at rest; 0 on lips, scalp and linings.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> nose, forehead, *lips = (
    ...     face.landmarks[name] for name in ("nose_tip", "forehead_mid", "upper_lip_mid", "lower_lip_mid")
    ... )
    >>> at = np.array([nose, forehead, np.mean(lips, axis=0)])
    >>> relief_strength(at, face).round(1).tolist()
    [1.5, 1.0, 0.0]
    """
    frame, marks = face.frame, face.landmarks
    where, strength = frame.local_mm(points), np.ones(len(points))
    for stem, reach, factor in STRONGER:
        for name in sorted({of_side(stem, side) for side in "lr"}):
            away = ((where - frame.local_mm(marks[name])) ** 2).sum(axis=1)
            strength += (factor - 1.0) * np.exp(-0.5 * away / reach**2)
    bare = 1.0 - smoothstep((hair_cover(points, marks, frame) + 3.0) / 6.0)
    skin = 1.0 - smoothstep(face.cavities.depth(points) / 2.0)
    return np.asarray(strength * bare * skin * (1.0 - lips(points, marks, frame)))
