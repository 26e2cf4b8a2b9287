"""
Eye pouches that tremble
========================

Bags under the eyes whose skin trembles six times a second (Lin, Cheng, Fig. 7). Towards the cheek, where the skin is
held, a pouch ends in a crease.
"""

import matplotlib.pyplot as plt
import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side

face = fw.default_face()
layers = fw.PatternLayer.presets("eye_pouch", face, frequency=6.0, trembling=0.5, depth=2.5)
sim = fw.Simulation(face, layers=layers, motion=fw.Still(face))
frames = [sim.step() for _ in range(30)]

# %%
# Neutral, and two frames of the cycle.
images = [picture(frame, face, Style(size=(420, 420), view="left_eye")) for frame in (face.mesh, frames[8], frames[12])]
figure(side_by_side(images), ["neutral", "0.18 s", "0.26 s"])

# %%
# The skin of the lid at one place over time: 25 frames of 0.02 s are three periods.
highest = int(np.argmax(frames[8]["pattern_eye_pouch_l"][: face.mesh.n_points]))
height = np.array([frame["W"][highest] for frame in frames])
_, axes = plt.subplots(figsize=(9, 2.4))
axes.plot(0.02 * np.arange(1, 31), height)
axes.set_xlabel("time (s)")
axes.set_ylabel("height (mm)")
plt.tight_layout()
assert np.allclose(height[25:], height[:5])
assert np.ptp(height) > 0.3
