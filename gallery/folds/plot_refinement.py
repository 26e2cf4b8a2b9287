"""
.. _refinement:

Triangles where they are needed, and only there
===============================================

A wrinkle needs a few vertices from bulge to furrow. Triangles are split where the wavelength requires it and, with the
paper's folds, where the surface bends more than at rest (Eq. 19); they are merged again when the skin is smooth. Each
is split in four (red), the gaps are closed by halving (green), and the halves are made anew each time, so that angles
never degrade.
These are the paper's Figs. 9 and 10.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.plotting import Style, figure, picture, side_by_side

# %%
# From level n to n + 1, as in Fig. 10: an edge (orange) has bent too much, so the two triangles beside it are split in
# four (blue). What hangs between a split and an unsplit triangle is closed by halving the second (red).

rows, columns = np.mgrid[0:5, 0:6]
lattice = np.column_stack([(columns - 0.5 * rows).ravel(), np.sqrt(0.75) * rows.ravel()])
place = np.arange(30).reshape(5, 6)
corner, right, up, beyond = (x.ravel() for x in (place[:-1, :-1], place[:-1, 1:], place[1:, :-1], place[1:, 1:]))
coarse = np.concatenate([np.column_stack([corner, right, beyond]), np.column_stack([corner, beyond, up])])
edge = place[2, 2], place[2, 3]
one_edge = RedGreenForest(coarse)
one_edge.split(np.isin(coarse, edge).sum(axis=1) == 2)
finer = one_edge.weights @ lattice
sides = np.diff(finer[one_edge.triangles], axis=1)
share = abs(np.linalg.det(sides)) / np.sqrt(0.75)  # of the area of a triangle before
_, axes = plt.subplots(1, 2, figsize=(9, 3.2))
axes[1].triplot(*finer.T, one_edge.triangles[share < 0.3], color="#2e86ab")
for half in one_edge.triangles[(share > 0.3) & (share < 0.7)]:
    hanging, opposite = half.max(), half[np.argmax(np.linalg.norm(finer[half] - finer[half.max()], axis=1))]
    axes[1].plot(*finer[[hanging, opposite]].T, color="#d1495b", zorder=2)
for axis, level in zip(axes, ("n", "n + 1"), strict=True):
    axis.triplot(*lattice.T, coarse, color="0.35", lw=0.9, zorder=3)
    axis.plot(*lattice[list(edge)].T, color="#f18f01", lw=3, zorder=4)
    axis.set_title(f"level {level}: {len(coarse if axis is axes[0] else one_edge.triangles)} triangles", fontsize=10)
    axis.set_aspect("equal")
    axis.set_axis_off()
plt.tight_layout()

# %%
# Frowning with the paper's folds, mended (``folds="paper"``), and triangles split at most 0, 1 and 2 times; 2 is the
# default on this head.

face = fw.default_face()
counts, images, depths = [], [], []
for level in (0, 1, 2):
    sim = fw.Simulation(face, fw.Refinement(max_level=level), folds="paper")
    sim.express("frowning")
    frame = sim.settle()
    counts.append(frame.n_cells)
    depths.append(np.ptp(frame["W"]))
    images.append(picture(frame, face, Style(size=(400, 380), view="glabella", wireframe=True)))
figure(side_by_side(images), [f"{count:,} triangles" for count in counts])
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
assert len(one_edge.triangles) == len(coarse) + 2 * 3 + 4  # two split in four, and four halved
assert smallest > np.degrees(np.arctan(1 / 3)) - 0.01
assert np.array_equal(forest.triangles, plane.regular_faces)
