"""
.. _first_expression:

The first expression
====================

A face, a simulation, an expression: three lines, and the forehead folds. Contracting muscles pull the skin, and
wrinkles rise where it is compressed; the mesh gets more triangles there and nowhere else.
"""

import facewrinkle as fw
from facewrinkle.plotting import Scene, Style, figure, picture, side_by_side

# %%
# The built-in head has 4,517 triangles. :meth:`facewrinkle.Simulation.settle` returns the expression at rest as a
# :class:`pyvista.PolyData`; :meth:`facewrinkle.Simulation.run` gives all frames on the way.

face = fw.default_face()
sim = fw.Simulation(face)
sim.express("surprise")
frame = sim.settle()

# %%
# Before and after, and the triangles that carry the folds.

style = Style(size=(400, 400), view="forehead")
wires = Style(size=(400, 400), view="forehead", wireframe=True)
images = [picture(face.mesh, face, style), picture(frame, face, style), picture(frame, face, wires)]

figure(side_by_side(images), ["at rest", "surprise", "its triangles"])

# %%
# The whole face, to turn. A :class:`facewrinkle.plotting.Scene` holds an ordinary PyVista plotter.

scene = Scene(face, Style(size=(800, 700), quick=True))
scene.show(frame)
scene.plotter.show()

# %%
# When the muscles relax, the wrinkles go, and the triangles with them: the mesh at the end is the mesh at the start.

sim.relax()
rest = sim.settle()
print(f"{face.mesh.n_cells} -> {frame.n_cells} -> {rest.n_cells} triangles")
print(f"wrinkles from {frame['W'].min():.2f} to {frame['W'].max():.2f} mm, then {abs(rest['W']).max():.1f} mm")
assert rest.n_cells == face.mesh.n_cells
