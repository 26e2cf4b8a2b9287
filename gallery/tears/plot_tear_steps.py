"""
.. _tear_steps:

How a tear that runs down is built
==================================

The steps of Lin and Cheng (their Figs. 9 and 10), on a strip of skin: a base surface, a copy of it just above, both
joined along the outline, the head, its smooth form, and noise that only raises the top.
"""

import numpy as np
import pyvista as pv
from scipy.interpolate import RegularGridInterpolator

from facewrinkle.geometry.topology import euler_characteristic, ring_triangles
from facewrinkle.tears.shape import Shape, extruded, outline, raised, rough_film, smoothed_head, solid, thickness

LENGTH, HALF = 12.0, 1.5
shape = Shape(half=HALF, height=0.9, trail=1.15, film=0.063)

# %%
# (a) The base surface: a grid along the path, drawn in to the outline of the tear. The path runs along x.

rows, columns = 73, 19
s = np.repeat(np.linspace(0.0, LENGTH, rows)[:, None], columns, axis=1)
w = np.linspace(1.0, -1.0, columns) * outline(s, LENGTH, shape)
base, faces = np.stack([s, -w, 0.0 * s], axis=-1).reshape(-1, 3), ring_triangles(columns, rows, closed=False)


def lifted(height):
    """The base moved up."""
    return base + np.stack([0.0 * height, 0.0 * height, height], axis=-1).reshape(-1, 3)


def closed(height):
    """The closed tear whose top is at a height above the base."""
    return pv.PolyData.from_regular_faces(*solid(base, lifted(height), faces))


# %%
# (b) The copy; (c) both joined; (d) the head, extruded; (e) that head smoothed by moving least squares; (f) with noise,
# as high as on skin of roughness 0.5.

film = Shape(HALF, shape.film, shape.trail, shape.film)
block = extruded(s, thickness(s, w, LENGTH, film), LENGTH, shape)
smooth = smoothed_head(s, w, block, LENGTH, shape)
noise, spacing = rough_film(LENGTH, HALF, 0.5, 1, np.random.default_rng(2))
grid = spacing * np.arange(noise.shape[0]), spacing * np.arange(-4, 5)
noisy = smooth + raised(s, w, LENGTH, shape, 0.0, RegularGridInterpolator(grid, noise)(np.stack([s, w], axis=-1)))
flat = np.full_like(s, 0.25)
steps = {
    "(a) base surface": pv.PolyData.from_regular_faces(base, faces),
    "(b) copy": pv.PolyData.from_regular_faces(lifted(flat + 1.0), faces),
    "(c) connected": closed(flat),
    "(d) head": closed(block),
    "(e) smoothed": closed(smooth),
    "(f) noise": closed(noisy),
}

# %%
# The bumps are a tenth of a millimeter high: a low light from the side shows them.

plotter = pv.Plotter(off_screen=True, shape=(2, 3), window_size=(1300, 640), border=False, lighting="none")
plotter.add_light(pv.Light(position=(12.0, 30.0, 8.0), focal_point=(6.0, 0.0, 0.0), intensity=1.3))
plotter.add_light(pv.Light(light_type="headlight", intensity=0.7))
for i, (title, mesh) in enumerate(steps.items()):
    plotter.subplot(*divmod(i, 3))
    plotter.set_background("white")
    plotter.add_text(title, position=(12, 285), font_size=11, color="black")
    if i < 2:
        plotter.add_mesh(steps["(a) base surface"], color="#b5442e")
    if i:
        shading = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": 50.0} if i > 2 else {}
        plotter.add_mesh(mesh, color="#5a6470" if i < 3 else "#8fb6d6", specular=0.3, specular_power=30.0, **shading)
    plotter.camera_position = [(19.0, -13.0, 13.0), (6.4, 0.0, 0.2), (0.0, 0.0, 1.0)]
    plotter.camera.zoom(1.5)
plotter.show()

# %%
# The tear is one closed piece, and the noise never lowers its top: it cannot enter the skin.

tear = steps["(f) noise"]
print(f"Euler characteristic {euler_characteristic(tear.regular_faces)}, volume {tear.volume:.1f} mm³")
print(f"the noise raises the top by up to {1000.0 * (noisy - smooth).max():.0f} µm")
assert euler_characteristic(tear.regular_faces) == 2
assert (noisy >= smooth).all()
