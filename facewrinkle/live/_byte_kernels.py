"""Machine code for arrays as a page gets them."""

from __future__ import annotations

from ..geometry.compilation import njit


@njit(cache=True)
def differing(before, now, mask):
    """Mark the rows (n,) of bytes (n, w) that differ from those before, or are new; return how many."""
    count = 0
    for i in range(len(now)):
        differs = i >= len(before)
        if not differs:
            for c in range(now.shape[1]):
                if now[i, c] != before[i, c]:
                    differs = True
                    break
        mask[i] = differs
        count += differs
    return count


@njit(cache=True)
def inside(points, low, high):
    """Return True if all points (n, 3) lie between two corners."""
    for i in range(len(points)):
        for c in range(3):
            if not low[c] <= points[i, c] <= high[c]:
                return False
    return True


@njit(cache=True)
def quantise(points, low, scale, largest, out):
    """Write points (n, 3) as whole numbers from 0 to `largest`, to the nearest; halves go to the even one."""
    for i in range(len(points)):
        for c in range(3):
            out[i, c] = round(min(max((points[i, c] - low[c]) * scale, 0.0), largest))
