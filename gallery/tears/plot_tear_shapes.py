"""
.. _tear_shapes:

Six shapes of a falling tear
============================

The dripping tear of Lin and Cheng is a surface of revolution, of radius ``alpha sin(u)/cos(t u)`` about an axis that
points down. Their Fig. 8 shows it change from left to right as t grows. Here the drop keeps its mass.
"""

import numpy as np
import pyvista as pv

import facewrinkle as fw

# %%
# With the same t at the beginning and at the end of its fall, a tear shows the shape for one t of the formula.

times = [0.17, 0.22, 0.27, 0.32, 0.37, 0.43]
drops = []
for t in times:
    shape = fw.tears.DropShape(ratio=8.0, t=(t, t), stretch=0.0)
    tear = fw.DrippingTear(size=3.0, shape=shape, resolution=80)
    drops.append(tear.surface(tear.begin + tear.hang))

# %%
# From a shallow drop to a sharp one (the sharpest at t = 0.3229), and on to a slim one with a blunt tip.

plotter = pv.Plotter(off_screen=True, window_size=(1200, 360))
plotter.set_background("white")
for i, drop in enumerate(drops):
    drop.translate(np.array([4.5 * i, 0.0, 0.0]) - drop.center, inplace=True)
    plotter.add_mesh(drop, color="#8fb6d6", specular=1.0, specular_power=60.0, smooth_shading=True)
plotter.view_xy()
plotter.camera.zoom(2.6)
plotter.show()

# %%
# The mass is kept.

volumes = [drop.volume for drop in drops]
print(f"volumes: {np.round(volumes, 4)} mm³")
assert np.ptp(volumes) < 1e-3 * np.mean(volumes)
