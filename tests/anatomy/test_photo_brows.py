"""Brows of a photo: dark bands that are painted on the built-in head are found where they were painted."""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.anatomy.photo_brows import DARKER, STEP, rise_of_dark_bands
from facewrinkle.mesh import to_polydata


def _painted(face, shift, darkness, texture):
    """The head with brows painted `shift` above its own, in distances between the pupils, and its photo."""
    mesh = to_polydata(face.points, face.triangles)
    mesh.active_texture_coordinates = np.asarray(face.mesh.active_texture_coordinates)
    mesh = mesh.subdivide(2, "linear")
    local = face.frame.local(np.asarray(mesh.points, float))
    strength = np.zeros(len(local))
    for side in "lr":
        brow = np.array([face.frame.local(face.landmarks[f"brow_{side}_{part}"]) for part in ("inner", "mid", "outer")])
        brow = brow[np.argsort(brow[:, 0])]
        within = (local[:, 0] > brow[0, 0]) & (local[:, 0] < brow[-1, 0]) & (local[:, 2] > -0.5)
        away = local[:, 1] - np.interp(local[:, 0], brow[:, 0], brow[:, 1]) - shift
        strength = np.maximum(strength, within * np.exp(-0.5 * (away / 0.04) ** 2))
        x, y, _ = face.frame.local(face.landmarks[f"eye_{side}_centre"])
        lid = np.linalg.norm(local[:, :2] - [x, y + 0.12], axis=1)  # dark, but no brow
        strength = np.maximum(strength, np.exp(-0.5 * (lid / 0.05) ** 2))
    grey = 200.0 * (1.0 - darkness * strength)
    if not texture:
        mesh.point_data["Colors"] = np.rint(np.tile(grey[:, None], (1, 3))).astype(np.uint8)
        return mesh, None
    image, size = np.full((512, 512, 3), 200, np.uint8), 512
    uv = np.asarray(mesh.active_texture_coordinates)
    place = np.clip(np.rint(uv * size).astype(int), 2, size - 3)
    for i in range(-2, 3):
        for j in range(-2, 3):
            image[size - 1 - place[:, 1] + i, place[:, 0] + j] = grey[:, None]
    return mesh, image


@pytest.mark.parametrize("texture", [False, True])
@pytest.mark.parametrize("shift", [-0.08, 0.0, 0.12])
def test_painted_brows_are_found(face, shift, texture):
    mesh, image = _painted(face, shift, 0.6, texture)
    rise = rise_of_dark_bands(mesh, image, face.landmarks, face.frame)
    assert rise == pytest.approx(shift, abs=1.5 * STEP)


def test_without_a_photo_or_dark_bands_brows_stay(face):
    bare = to_polydata(face.points, face.triangles)
    assert rise_of_dark_bands(bare, None, face.landmarks, face.frame) == 0.0
    faint, _ = _painted(face, 0.1, 0.3 * DARKER, False)
    assert rise_of_dark_bands(faint, None, face.landmarks, face.frame) == 0.0
