"""
Patterns on any surface
=======================

A pattern needs no anatomy: here an animal made of simple shapes gets a wrinkled brow.
"""

import warnings

import numpy as np
import pyvista as pv

import facewrinkle as fw
import facewrinkle.accessor

# %%
# A body, a head and two ears. The pattern lies on the part that is nearest to its centre.
body = pv.ParametricEllipsoid(60, 38, 36).triangulate()
head = pv.Sphere(radius=30, center=(62, 30, 0), theta_resolution=60, phi_resolution=60)
ears = [pv.Sphere(radius=9, center=(60, 58, z), theta_resolution=24, phi_resolution=24) for z in (-16, 16)]
animal = pv.merge([body.extract_surface(algorithm="dataset_surface"), head, *ears])
with warnings.catch_warnings():
    warnings.simplefilter("ignore", fw.FaceWrinkleWarning)  # it says that the mesh is refined
    wrinkled = animal.facewrinkle.pattern(
        "forehead", centre=(82, 50, 0), up=(-0.6, 0.8, 0.0), size=(34, 22), depth=2.0, number=3
    )

# %%
plotter = pv.Plotter(off_screen=True, window_size=(700, 500))
plotter.add_mesh(wrinkled, color="#b98d6f", smooth_shading=True)
plotter.camera_position = [(210, 140, 90), (45, 20, 0), (0, 1, 0)]
plotter.show()

# %%
# From the deepest furrow to the highest bulge it is as far as the depth says.
print(f"{animal.n_cells} -> {wrinkled.n_cells} triangles; {np.ptp(wrinkled['W']):.2f} mm")
assert abs(np.ptp(wrinkled["W"]) - 2.0) < 0.2
