"""Shaders: what is worked out at corners is what would be worked out at each pixel; a headlight is VTK's own."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.plotting.shaders import EYE_MATERIAL, SKIN_MATERIAL, TEETH_MATERIAL, headlight
from facewrinkle.plotting.views import LIGHTS
from facewrinkle.plotting.window import rendered

FINE = pv.Sphere(radius=1.0, theta_resolution=240, phi_resolution=240)


def drawn(shade, lights, **options):
    """A ball under some lights, shaded by a function of its actor."""
    plotter = pv.Plotter(off_screen=True, window_size=(120, 120), lighting="none")
    plotter.disable_anti_aliasing()
    for light in lights:
        plotter.add_light(light)
    actor = plotter.add_mesh(FINE, color=(0.8, 0.6, 0.5), smooth_shading=False, **options)
    actor.prop.interpolation = "phong"
    shade(actor)
    plotter.camera_position = [(0.0, 0.0, 9.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    try:
        return rendered(plotter).astype(int)
    finally:
        plotter.close()


@pytest.mark.parametrize("material", [SKIN_MATERIAL, EYE_MATERIAL, TEETH_MATERIAL], ids=["skin", "eye", "teeth"])
def test_corners_of_small_triangles_are_as_good_as_pixels(material):
    def lamps():
        return [pv.Light(position=place, color=colour, intensity=power) for place, colour, power in LIGHTS]

    def ball(edges):
        return drawn(lambda actor: material.apply(actor, len(LIGHTS), edges=edges), lamps(), ambient=1.0, diffuse=1.0)

    corners, pixels = ball(False), ball(True)
    assert np.ptp(pixels[40:80, 40:80]) > 50
    assert np.abs(corners - pixels).max() <= 2


@pytest.mark.parametrize("power", [1, 14, 90])
def test_a_headlight_is_that_of_vtk(power):
    options = {"ambient": 0.2, "diffuse": 0.6, "specular": 0.5, "specular_power": power}
    ours, theirs = (
        drawn(shade, [pv.Light(light_type="headlight")], **options)
        for shade in (lambda actor: headlight(actor, power), lambda actor: None)
    )
    assert np.ptp(theirs[40:80, 40:80]) > 20
    assert np.abs(ours - theirs).max() <= 1
