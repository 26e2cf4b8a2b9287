"""
.. _fields:

Inspecting fields
=================

Every frame holds the numbers from which it was computed, for anyone to check: coordinates along and across the muscle,
compression, height, the split criterion, the level of refinement, and the dominant muscle.
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.geometry.equations import anisotropy
from facewrinkle.mesh import ARRAYS
from facewrinkle.plotting import Scene, Style, figure, picture, side_by_side

face = fw.default_face()
layer = fw.MuscleWrinkles(inextensible=False)  # W = k0 H At A, not bounded by what skin of fixed length can fold
sim = fw.Simulation(face, layers=[layer])
sim.express("fear")
frame = sim.settle()

# %%
# The arrays and what they hold. Those of waves are only there with :class:`facewrinkle.WaveFolds`.

for name, meaning in ARRAYS.items():
    if name in frame.array_names:
        print(f"{name:12s} {frame[name].dtype!s:8s} {meaning}")

# %%
# Each one in color. Fields of a muscle are gray where no muscle wrinkles the skin.

names = [None, "W", "epsilon", "lambda", "gamma", "split_gamma", "level", "muscle"]
images = [picture(frame, face, Style(size=(460, 400), view="forehead", scalars=name)) for name in names]
for k in range(0, 8, 2):
    figure(side_by_side(images[k : k + 2]), [name or "the skin" for name in names[k : k + 2]])

# %%
# A frame is a :class:`pyvista.PolyData`: every filter of PyVista works on it. Here are the deepest place, and lines of
# equal height on the forehead, furrows blue and bulges red.

deepest = int(np.argmin(frame["W"]))
muscle = str(frame.field_data["muscles"][frame["muscle"][deepest]])
print(f"deepest {frame['W'][deepest]:.2f} mm, in the region of {muscle}")
lines = frame.contour([-0.8, -0.6, -0.4, -0.2, 0.15, 0.3, 0.45], scalars="W")
scene = Scene(face, Style((800, 600), "forehead", quick=True))
scene.show(frame)
options = {"scalars": "W", "cmap": "RdBu_r", "clim": (-0.8, 0.8), "show_scalar_bar": False, "reset_camera": False}
scene.plotter.add_mesh(lines, line_width=3, **options)
scene.plotter.show()

# %%
# :meth:`facewrinkle.Simulation.fields` gives one muscle's own fields; from these its height is computed again with the
# paper's formula, W = k0 H At sin(pi epsilon / 2) (Eq. 3).

own = sim.fields(muscle)
folding = face.muscles[muscle].fold_pattern
rate = dict(zip(sim.muscles, sim.skin.rates, strict=True))[muscle]
k0 = rate * folding.wrinkles.depth
recomputed = k0 * folding.unit_amplitude(frame["rest"]) * anisotropy(own["epsilon"])
error = np.abs(recomputed - own["W"])[own["region"]].max()
print(f"{own['region'].sum()} vertices; largest difference {error:.1e} mm")
assert error < 1e-9
