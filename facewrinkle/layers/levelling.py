"""Heights of folds that hold no net volume: bulges are made lower, or furrows."""

from __future__ import annotations

import numpy as np

from ..array_types import Array

LEVELLED = 0.8
"""Bulges and furrows are lowered to this share of their heights at most, so that they hold the same volume."""

RAISED = 1.07
"""The other side becomes this much higher at most: a furrow is up to three times as deep as its crest is high, so that
from bulge to furrow no fold becomes deeper than it was.
"""

STEPS = 512
"""Shares are multiples of 1 / 512: the order of the triangles, in which volumes are added up, does not change them."""


def level_shares(height: Array, areas: Array) -> Array:
    """Return the shares (n,) of heights (n,) that leave bulges and furrows as much volume over areas (n,).

    The side that holds more becomes lower; where a fifth is not enough, the other side grows a little.

    Examples
    --------
    >>> level_shares(np.array([0.4, -0.1, -0.25]), np.ones(3)).tolist()
    [0.875, 1.0, 1.0]
    """
    volumes = areas * height
    above, below = float(np.maximum(volumes, 0.0).sum()), -float(np.minimum(volumes, 0.0).sum())
    more, less = max(above, below), min(above, below)
    lowered = max(round(less / more * STEPS) / STEPS, LEVELLED) if more > 0.0 else 1.0
    raised = min(round(lowered * more / less * STEPS) / STEPS, RAISED) if less > 0.0 and lowered == LEVELLED else 1.0
    bulges, furrows = (lowered, raised) if above > below else (raised, lowered)
    return np.where(height > 0.0, bulges, furrows)
