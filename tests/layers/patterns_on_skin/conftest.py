"""Patterns of all kinds, and a surface to lay them on."""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.layers.patterns_on_skin.kinds import Cheek, Custom, Dimple, EyeCorner, EyePouch, Forehead, Frown

WRINKLES = [
    Forehead(),
    Forehead(style="broken", furrows="paper", sharpness=0.7),
    Forehead(style=2.0, sharpness=0.0),
    EyeCorner(),
    EyeCorner(furrows="paper", number=3, radius=0.4),
    EyeCorner(sharpness=0.0),
    Cheek(),
    Cheek(sharpness=0.0, furrows="paper"),
    Frown(),
    Frown(variant="paper"),
    Forehead(variation=0.7, seed=3),
    EyeCorner(variation=1.0, splay=0.4),
    Cheek(variation=0.5),
    Frown(variation=0.5, seed=1),
    Frown(variation=1.0, variant="paper", sharpness=0.0),
]
BUMPS = [
    Dimple(),
    EyePouch(),
    EyePouch(trembling=0.3, beta=2.0, gamma=4),
    EyePouch(crease=0.3, trembling=0.4),
    Custom(function=lambda x, y, t: np.sin(3 * x + t) * y),
]


@pytest.fixture(params=WRINKLES, ids=lambda kind: type(kind).__name__)
def wrinkles(request):
    """A pattern of wrinkles."""
    return request.param


@pytest.fixture(params=WRINKLES + BUMPS, ids=lambda kind: type(kind).__name__)
def kind(request):
    """A pattern."""
    return request.param


@pytest.fixture(scope="module")
def slab():
    """A flat square of 100 mm."""
    return fw.surface(pv.Plane(i_size=100, j_size=100, i_resolution=25, j_resolution=25))
