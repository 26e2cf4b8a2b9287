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

from facewrinkle.geometry.topology import euler_characteristic
from facewrinkle.tears.shape import Shape, rough_film, solid, thickness

LENGTH, HALF = 12.0, 1.5
shape = Shape(half=HALF, height=0.9, trail=1.0, film=0.12)

# %%
# (a) The base surface: the skin under the tear, subdivided. The path runs along x.

plane = pv.Plane(
    center=(LENGTH / 2, 0.0, 0.0), i_size=LENGTH, j_size=2 * HALF, i_resolution=240, j_resolution=60
).triangulate()
points, triangles = np.asarray(plane.points, dtype=float), np.asarray(plane.regular_faces, dtype=np.int32)
level, smooth_head = thickness(points[:, 0], points[:, 1], LENGTH - 0.1, shape)
inside = (level > 0.0)[triangles].all(axis=1)
kept, faces = np.unique(triangles[inside], return_inverse=True)
base, faces = points[kept], faces.reshape(-1, 3).astype(np.int32)
smooth_head = smooth_head[kept]


def raised(height):
    """The base moved up."""
    return base + np.stack([0 * height, 0 * height, height], axis=1)


def closed(height):
    """The closed tear whose top is at a height above the base."""
    corners, tear = solid(base, raised(height), faces)
    return pv.PolyData.from_regular_faces(corners, tear)


# %%
# (b) The copy; (c) both joined; (d) the head, extruded; (e) smoothed; (f) with noise from moving least squares.

flat = np.full(len(base), 0.25)
block = np.where(base[:, 0] > LENGTH - 3.0, 0.9, 0.25)
noise, spacing = rough_film(LENGTH, HALF, 0.3, 1, np.random.default_rng(2))
grid = spacing * np.arange(noise.shape[0]), spacing * np.arange(-4, 5)
bumps = RegularGridInterpolator(grid, noise, bounds_error=False, fill_value=0.0)(base[:, :2])
noisy = smooth_head + 3.0 * shape.film * bumps * level[kept]
steps = {
    "(a) base surface": pv.PolyData.from_regular_faces(base, faces),
    "(b) copy": pv.PolyData.from_regular_faces(raised(flat + 1.0), faces),
    "(c) connected": closed(flat),
    "(d) head": closed(block),
    "(e) smoothed": closed(np.maximum(smooth_head, 0.002)),
    "(f) noise": closed(np.maximum(noisy, 0.002)),
}

plotter = pv.Plotter(off_screen=True, shape=(2, 3), window_size=(1300, 560), border=False)
for i, (title, mesh) in enumerate(steps.items()):
    plotter.subplot(*divmod(i, 3))
    plotter.set_background("white")
    plotter.add_text(title, position=(12, 250), font_size=11, color="black")
    if i < 2:
        plotter.add_mesh(steps["(a) base surface"], color="#b5442e")
    if i:
        options = {"smooth_shading": True} if i > 3 else {}
        plotter.add_mesh(mesh, color="#5a6470" if i < 3 else "#8fb6d6", specular=1.0, specular_power=40.0, **options)
    plotter.camera_position = [(22.0, -20.0, 15.0), (6.2, 0.0, 0.2), (0.0, 0.0, 1.0)]
    plotter.camera.zoom(1.9)
plotter.show()

# %%
# The tear is one closed piece, and the noise never lowers its top: it cannot enter the skin.

tear = steps["(f) noise"]
print(f"Euler characteristic {euler_characteristic(tear.regular_faces)}, volume {tear.volume:.1f} mm³")
assert euler_characteristic(tear.regular_faces) == 2
assert (noisy >= smooth_head).all()
