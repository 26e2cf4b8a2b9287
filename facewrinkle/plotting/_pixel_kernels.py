"""Pixels of a window: compiled loops, in integers without branches, so that they run in vectors of the processor.

Pixels are uint32: red, green, blue and opacity from the lowest byte, premultiplied, bottom row first. The background
(h, 3) is one colour a row, 65536 for 255. The colours `out` (h, w, 3), bytes, begin with the top row.
"""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import compiled

LANES = np.uint64(0x00FF00FF00FF00FF)
"""Red and blue of two pixels; of pixels shifted by a byte, green and opacity."""


@compiled
def unpack(pixels, out):
    """Pixels (w,) as bytes (w, 3)."""
    for x in range(len(pixels)):
        p = pixels[x]
        out[x, 0] = p & np.uint32(255)
        out[x, 1] = (p >> np.uint32(8)) & np.uint32(255)
        out[x, 2] = (p >> np.uint32(16)) & np.uint32(255)


@compiled
def over(pixels, background, out):
    """Pixels (h, w) over a background."""
    height, width = out.shape[:2]
    done = np.empty(width, np.uint32)
    for y in range(height):
        row = pixels[height - 1 - y]
        red, green, blue = background[y, 0], background[y, 1], background[y, 2]
        for x in range(width):
            p = row[x]
            clear = np.uint32(255) - (p >> np.uint32(24))
            r = (p & np.uint32(255)) + ((clear * red) >> np.uint32(16))
            g = ((p >> np.uint32(8)) & np.uint32(255)) + ((clear * green) >> np.uint32(16))
            b = ((p >> np.uint32(16)) & np.uint32(255)) + ((clear * blue) >> np.uint32(16))
            done[x] = r | (g << np.uint32(8)) | (b << np.uint32(16))
        unpack(done, out[y])


@compiled
def halved_over(pairs, background, out):
    """Pixels, of which two beside each other are a number of `pairs` (2 h, w), reduced to means of four."""
    height, width = out.shape[:2]
    done = np.empty(width, np.uint32)
    for y in range(height):
        below, above = pairs[2 * (height - 1 - y)], pairs[2 * (height - 1 - y) + 1]
        red, green, blue = background[y, 0], background[y, 1], background[y, 2]
        for x in range(width):
            p, q = below[x], above[x]
            odd = (p & LANES) + (q & LANES)
            even = ((p >> np.uint64(8)) & LANES) + ((q >> np.uint64(8)) & LANES)
            odd, even = odd + (odd >> np.uint64(32)), even + (even >> np.uint64(32))
            clear = np.uint64(1020) - ((even >> np.uint64(16)) & np.uint64(0xFFFF))
            r = (odd & np.uint64(0xFFFF)) + ((clear * red) >> np.uint64(16))
            g = (even & np.uint64(0xFFFF)) + ((clear * green) >> np.uint64(16))
            b = ((odd >> np.uint64(16)) & np.uint64(0xFFFF)) + ((clear * blue) >> np.uint64(16))
            r, g, b = (
                (r + np.uint64(2)) >> np.uint64(2),
                (g + np.uint64(2)) >> np.uint64(2),
                (b + np.uint64(2)) >> np.uint64(2),
            )
            done[x] = r | (g << np.uint64(8)) | (b << np.uint64(16))
        unpack(done, out[y])
