"""
.. _water:

Water on anything
=================

A tear that runs down needs a surface and a way down, but no face. Here rain runs over a stone: each drop finds the
steepest descent, spreads a film, and keeps to the surface.
"""

import numpy as np
import pyvista as pv

import facewrinkle.accessor  # noqa: F401  # PyVista finds it by itself where the package is installed

# %%
# A stone: a sphere with bumps.

stone = pv.Icosphere(radius=40.0, nsub=5)
points = stone.points / 40.0
bumps = np.sin(3.0 * points[:, 0] + 1.0) * np.cos(4.0 * points[:, 1]) + 0.6 * np.sin(5.0 * points[:, 2])
stone.points *= (1.0 + 0.06 * bumps)[:, None]
stone.points *= [1.25, 0.9, 1.0]

# %%
# ``mesh.facewrinkle.tear`` gives the water of a stream that runs from a start; :class:`facewrinkle.SheddingTear` gives
# it at any time.

angles = np.radians([60.0, 75.0, 92.0, 106.0, 120.0])
starts = [(45.0 * np.cos(a), 45.0 * np.sin(a), depth) for a, depth in zip(angles, (16, 22, 18, 24, 15), strict=True)]
_, starts = stone.find_closest_cell(np.array(starts), return_closest_point=True)
lengths = [80.0, 35.0, 95.0, 60.0, 25.0]
streams = [
    stone.facewrinkle.tear(start=start, width=width, height=1.2, trail=0.5, length=length, seed=i)
    for i, (start, width, length) in enumerate(zip(starts, (4.0, 5.5, 4.4, 5.0, 6.0), lengths, strict=True))
]

# %%
plotter = pv.Plotter(off_screen=True, window_size=(800, 600))
plotter.set_background("#dfe5e8")
plotter.add_mesh(stone, color="#8d897f", smooth_shading=True, specular=0.05)
for stream in streams:
    plotter.add_mesh(
        stream, color="#9db9c9", opacity=0.55, specular=1.0, specular_power=60.0, diffuse=0.5, smooth_shading=True
    )
plotter.camera_position = [(60, 50, 150), (0, 2, 5), (0, 1, 0)]
plotter.show()

# %%
# Each stream is one closed piece of water, and none of it is inside the stone.

depths = [stream.compute_implicit_distance(stone)["implicit_distance"].min() for stream in streams]
print(", ".join(f"{stream.volume:.1f} mm³" for stream in streams))
assert all(stream.n_open_edges == 0 for stream in streams)
assert min(depths) > -1e-4
