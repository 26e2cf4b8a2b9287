"""Machine code for the paint of eyes."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import compiled


@compiled
def between_lids(paint, height, order, upper, lower, tears, out):
    """Paint (k, 3) of an eye with the shadows of the lids and the wet lower margin, as bytes.

    `height` (k,) are the elevations of the points, `upper` and `lower` (k,) those of the lids at the points in the
    given order, degrees.
    """
    for n in range(len(order)):
        i = order[n]
        below, above = max(upper[n] - height[i], 0.0), height[i] - lower[n]
        wet = 0.6 * np.exp(-((max(above, 0.0) / 2.2) ** 2)) if above < 12.0 else 0.0  # less than a trillionth
        shade = min(0.62 * np.exp(-below / 6.5) + 0.22 * np.exp(-max(above - 1.0, 0.0) / 4.0), 0.85)
        for c in range(3):
            lit = 1.0 - shade * (0.92 if c == 0 else 1.0)
            out[i, c] = np.rint(min(max((paint[i, c] + wet * (tears[c] - paint[i, c])) * lit, 0.0), 255.0))
