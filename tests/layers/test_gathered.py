"""Compression of creases, gathered over their width: uniform strains, strains that change, between places."""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.layers.compression import StrainField
from facewrinkle.layers.creases import PLACES, Gathered


@pytest.fixture(scope="module")
def parts(face):
    muscles = [muscle.fold_pattern for muscle in face.muscles.values()]
    field = StrainField(face.points, face.triangles)
    return list(face.muscles), muscles, Gathered(face, muscles, face.zones, field.metric), field


@pytest.mark.parametrize("share", [0.1, 0.0, -0.2])
def test_a_face_that_shrinks_is_compressed_alike_everywhere(face, parts, share):
    *_, gathered, field = parts
    epsilon = gathered.epsilon(field.strain((1.0 - share) * face.points))
    assert epsilon.shape[1] == PLACES
    np.testing.assert_allclose(epsilon, share, atol=1e-12)


def test_the_compression_is_that_across_the_crease(face, parts):
    """A glabella that is pressed together from the sides: upright creases there take up nearly all of it."""
    names, muscles, gathered, field = parts
    index = names.index("corrugator_l")
    lam = np.linspace(0.2, 0.8, 5)
    entries = np.full(5, index, np.int32), lam
    epsilon = gathered.at(field.strain(face.points * [0.9, 1.0, 1.0]), *entries)
    across = muscles[index].fold_direction(muscles[index].points_at(lam, 0.0 * lam))
    assert (epsilon > 0.06).all()
    assert (epsilon < 0.1).all()
    upright = gathered.at(field.strain(face.points * [1.0, 0.9, 1.0]), *entries)
    assert (np.abs(upright) < 0.02).all()
    assert (np.abs(across[:, 0]) > 0.9).all()


def test_between_places_the_compression_is_interpolated_linearly(face, parts):
    names, _, gathered, field = parts
    strain = field.strain(face.points * [0.9, 0.8, 1.1])
    lam = np.array([0.0, 0.5 / (PLACES - 1), 1.0 / (PLACES - 1), 1.0])
    epsilon = gathered.at(strain, np.full(4, names.index("zygomaticus_major_r"), np.int32), lam)
    row = gathered.epsilon(strain)
    assert [k for k in range(len(row)) if np.isclose(row[k, 0], epsilon[0]) and np.isclose(row[k, -1], epsilon[3])]
    assert epsilon[1] == pytest.approx(0.5 * (epsilon[0] + epsilon[2]))
