"""
.. _compression:

Compression, and how deep skin folds
====================================

Skin folds where it is shortened, and only across the direction of the shortening. The amplitude is the share
``sin(pi epsilon / 2)`` of its maximum (Eq. 10), with epsilon the compression along the muscle. How epsilon is measured
matters: the paper's sum over edges depends on the mesh; the deformation gradient does not.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.equations import EdgeWeights, anisotropy, deepest
from facewrinkle.geometry.topology import vertex_rings
from facewrinkle.layers.compression import StrainField, compression_along
from facewrinkle.plotting import Style, figure, picture, side_by_side

# %%
# A sheet is shortened by a fifth along x. Both ways measure the compression in all directions, on a mesh whose
# triangles all lean the same way.

plane = pv.Plane(i_size=40.0, j_size=40.0, i_resolution=40, j_resolution=40).triangulate()
points, triangles = np.asarray(plane.points, dtype=float), np.asarray(plane.regular_faces, dtype=np.int32)
squeezed = points * [0.8, 1.0, 1.0]
turns = np.linspace(0.0, np.pi, 73)
normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
field, rings = StrainField(points, triangles), vertex_rings(triangles, len(points))
middle = int(np.argmin(np.linalg.norm(points, axis=1)))
by_edges, by_gradient = [], []
for turn in turns:
    along = np.tile([np.cos(turn), np.sin(turn), 0.0], (len(points), 1))
    by_edges.append(EdgeWeights(points, rings, np.array([middle])).epsilon(squeezed, along[:1])[0])
    by_gradient.append(compression_along(field.strain(squeezed), field.metric, normals, along)[middle])
exact = 1.0 - np.hypot(0.8 * np.cos(turns), np.sin(turns))

_, (left, right) = plt.subplots(1, 2, figsize=(10, 3.2))
left.plot(np.degrees(turns), exact, color="0.8", lw=6, label="exact")
left.plot(np.degrees(turns), by_gradient, color="#2e86ab", label="deformation gradient (default)")
left.plot(np.degrees(turns), by_edges, color="#d1495b", label="edges (Eqs. 8-9)")
left.set_xlabel("direction (degrees)")
left.set_ylabel("epsilon")
left.legend(frameon=False, fontsize=8)
epsilon = np.linspace(-0.2, 1.0, 241)
right.plot(epsilon, anisotropy(epsilon), color="#b5442e", label="share of the amplitude (Eq. 10)")
right.plot(epsilon, deepest(1.0, epsilon), color="0.5", label="what skin of fixed length can fold, per wavelength")
right.set_xlabel("epsilon")
right.legend(frameon=False, fontsize=8)
plt.tight_layout()

# %%
# On a face: a smile compresses the cheek, which folds beside the mouth, and stretches the lips, which do not.

face = fw.default_face()
sim = fw.Simulation(face, folds="paper")
sim.express("stretching_mouth")
frame = sim.settle()
styles = [Style(size=(460, 420), view="right_mouth", scalars=name) for name in (None, "epsilon", "W")]
figure(side_by_side([picture(frame, face, style) for style in styles]), ["the skin", "epsilon", "W (mm)"])

# %%
# The deformation gradient is exact on any mesh. The edges miss a fifth of the compression here, and see some across it,
# where there is none. No wrinkle reaches beyond the skin that its own muscle compresses.

error = np.abs(np.array(by_gradient) - exact).max()
print(f"gradient: error {error:.1e}; edges: {by_edges[0]:.3f} in place of {exact[0]:.3f}")
assert error < 1e-12
own = sim.fields("zygomaticus_major_r")
assert not own["W"][own["epsilon"] <= 0.0].any()
