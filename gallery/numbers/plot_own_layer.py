"""
.. _own_layer:

Writing your own layer
======================

A layer is anything that lifts the skin along its normals: it follows the vertices as they come and go, gives their
heights for each state of the surface, and says where it needs triangles. Here it is a vein on the forehead that swells
with anger and beats with the heart.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.layers.base import Displacement, Layer
from facewrinkle.plotting import Style, View, figure, picture, side_by_side

# %%
# The four methods of :class:`facewrinkle.Layer`. What depends only on the place is computed once for each
# vertex, in `follow`; `displacement` is called at every step.


class Vein(Layer):
    """A vein along a line, which swells as muscles contract."""

    def __init__(self, line, width=3.0, height=1.0, beats=1.2):
        self.line, self.width, self.height, self.beats = np.asarray(line), width, height, beats

    def attach(self, face):
        """Start anew, on this face."""
        self._tree = cKDTree(self.line)
        self._distance, self._across = np.empty(0), np.empty((0, 3))
        self._muscles = [name.startswith("corrugator") for name in face.muscles]

    def follow(self, change, created):
        """Keep the vertices that stay, and measure the new ones."""
        distance, nearest = self._tree.query(created.points)
        away = created.points - self.line[nearest]
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
        self._distance = np.concatenate([self._distance[change.kept], distance])
        self._across = np.concatenate([self._across[change.kept], away])

    def displacement(self, state):
        """Heights in mm, half the shortest wavelength, its direction, and where the layer is."""
        anger = float(state.rates[self._muscles].max())
        beat = 1.0 + 0.25 * np.sin(2.0 * np.pi * self.beats * state.time)
        profile = np.exp(-((self._distance / (0.5 * self.width)) ** 2))
        self._height = anger * beat * self.height * profile
        active = (profile > 0.02) & (anger > 0.0)
        return Displacement(self._height, np.where(active, self.width, np.inf), self._across, active)

    def fields(self):
        """Its arrays in every frame."""
        return {"vein": self._height.copy()}


# %%
# The line runs on the surface from above the brow up to the hair.

face = fw.default_face()
low, high = face.landmarks["brow_l_inner"], face.landmarks["trichion"]
steps = np.array([[1, 9, 0], [5, 20, 0], [1, 30, 0], [11, -4, 0], [10, 8, 0]], dtype=float)  # mm: left, up, forward
knots = np.stack([low, low, low, high, high]) + steps
spline = make_interp_spline(np.linspace(0.0, 1.0, 5), knots)(np.linspace(0.0, 1.0, 200))
_, line = face.mesh.find_closest_cell(spline, return_closest_point=True)

# %%
# Its heights are added to the wrinkles of the muscles.

sim = fw.Simulation(face, fw.Refinement(max_level=3), layers=[fw.MuscleWrinkles(), Vein(line)])
sim.express("anger")
frames = list(sim.run(75))
near = View((0.45, 0.1, 1.0), "glabella", (0.1, 0.3, -0.3), 1.7)
images = [picture(frame, face, Style((440, 420), near)) for frame in (face.mesh, frames[-1])]
images.append(picture(frames[-1], face, Style((440, 420), near, wireframe=True)))
figure(side_by_side(images), ["at rest", "anger", "its triangles"])

# %%
# The beat, at the highest place.

height = np.array([frame["vein"].max() for frame in frames])
seconds = 0.02 * np.arange(1, len(frames) + 1)
_, axes = plt.subplots(figsize=(9, 2.2))
axes.plot(seconds, height, color="#b5442e")
axes.set_xlabel("time (s)")
axes.set_ylabel("height (mm)")
plt.tight_layout()

# %%
# The heights of all layers add up, to the last digit. The simulation works with copies of the layers that it was given.

frame = frames[-1]
vein, wrinkles = sim.layers[1].fields()["vein"], sim.layers[0].fields()["W"]
print(f"{face.mesh.n_cells} -> {frame.n_cells} triangles, the vein is {height[-1]:.2f} mm high")
assert np.array_equal(frame["W"], wrinkles + vein)
assert 0.7 < height[-1] < 1.3
