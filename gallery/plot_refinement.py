"""
.. _refinement:

Triangles where they are needed, and only there
===============================================

A wrinkle needs a few vertices from bulge to furrow. Triangles are split where the surface bends more than at rest
(Eq. 19), and where the wavelength requires it; they are merged again when the skin is smooth. Each is split in four
(red), the gaps are closed by halving (green), and the halves are made anew each time, so that angles never degrade.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.plotting import Style, figure, picture, side_by_side

# %%
# Frowning, with triangles split at most 0, 1 and 2 times; 2 is the default on this head.

face = fw.default_face()
counts, images, depths = [], [], []
for level in (0, 1, 2):
    sim = fw.Simulation(face, fw.Refinement(max_level=level), folds="paper")
    sim.express("frowning")
    frame = sim.settle()
    counts.append(frame.n_cells)
    depths.append(np.ptp(frame["W"]))
    images.append(picture(frame, face, Style(size=(400, 380), view="glabella", wireframe=True)))
figure(side_by_side(images))
print(f"{counts} triangles; from furrow to bulge {np.round(depths, 2)} mm")

# %%
# The number of triangles as the frown comes and goes.

sim = fw.Simulation(face, folds="paper")
sim.express("frowning")
cells = [frame.n_cells for frame in sim.run(50)]
sim.relax()
cells += [frame.n_cells for frame in sim.run(130, ramp=0.2)]
_, axes = plt.subplots(figsize=(9, 2.6))
axes.plot(cells, color="#2e86ab")
axes.set_xlabel("step")
axes.set_ylabel("triangles")
plt.tight_layout()

# %%
# The algorithm by itself works on any triangles: :class:`facewrinkle.geometry.refinement.RedGreenForest`. Splitting
# about a point again and again keeps every angle, because what was halved is never halved again.

plane = pv.Plane(i_resolution=6, j_resolution=6).triangulate()
points, forest = np.asarray(plane.points), RedGreenForest(plane.regular_faces)
for _ in range(6):
    corners = (forest.weights @ points)[forest.triangles]
    forest.split(np.linalg.norm(corners.mean(axis=1) - [0.12, 0.07, 0.0], axis=1) < 0.35 / 2.0**forest.level)
fine = pv.PolyData.from_regular_faces(forest.weights @ points, forest.triangles)
plotter = pv.Plotter(off_screen=True, window_size=(640, 560))
plotter.add_mesh(fine, scalars=forest.level, cmap="YlGnBu", show_edges=True, line_width=1, show_scalar_bar=False)
plotter.view_xy()
plotter.camera.zoom(1.35)
plotter.show()

# %%
# Halving one of these right-angled triangles leaves arctan(1/3), 18.4 degrees; after six levels it is still no less.

smallest = fine.cell_quality("min_angle")["min_angle"].min()
forest.coarsen(np.ones(len(forest.triangles), bool))
while len(forest.triangles) > plane.n_cells:
    forest.coarsen(np.ones(len(forest.triangles), bool))
print(f"smallest angle {smallest:.2f} degrees with {fine.n_cells} triangles; coarsened to {len(forest.triangles)}")
assert cells[-1] == face.mesh.n_cells
assert smallest > np.degrees(np.arctan(1 / 3)) - 0.01
assert np.array_equal(forest.triangles, plane.regular_faces)
