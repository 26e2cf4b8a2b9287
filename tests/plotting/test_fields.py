"""Fields in colour: each is seen, and none on skin that lacks it."""

from __future__ import annotations

import numpy as np
import pytest
from drawing import SMALL, difference, held

from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.mesh import ARRAYS
from facewrinkle.plotting import Scene, Style, picture


def test_fields_have_colour(face):
    """Skin is lit the same; what differs from one field to the next is its colours. One scene can show them all."""
    wrinkled = held("surprise")
    images = {
        name: picture(wrinkled, face, Style(SMALL, scalars=name)) for name in ARRAYS if name not in ("rest", "slide")
    }
    for name, image in images.items():
        for other, another in images.items():
            assert name == other or (difference(image, another) > 10).mean() > 0.001
    with Scene(face, Style(SMALL, scalars="level")) as scene:
        for name, image in images.items():
            scene.colour_by(name)
            np.testing.assert_array_equal(scene.picture(wrinkled), image)
    colourful = np.ptp(images["W"].astype(int), axis=2)
    furrows = np.asarray(wrinkled["W"]) < -0.3
    assert furrows.any()
    assert colourful.max() > 60
    rest = picture(face.mesh, face, Style(SMALL, brows=False))
    assert difference(images["W"], rest).max() > 60


def test_fields_that_cannot_be_drawn(face):
    wrinkled = held("surprise")
    with pytest.raises(UnknownNameError, match="unknown field 'epsilom'. Did you mean 'epsilon'"):
        picture(wrinkled, face, Style((40, 40), scalars="epsilom"))
    with pytest.raises(ParameterError, match="one number per vertex; 'rest' has 3"):
        picture(wrinkled, face, Style((40, 40), scalars="rest"))
    with Scene(face, Style((40, 40))) as scene, pytest.raises(ParameterError, match="make it of a Style with scalars"):
        scene.colour_by("W")
