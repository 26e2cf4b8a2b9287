"""
.. _dripping_tear:

Tears that drip from a face
===========================

Four frames of Lin and Cheng's Fig. 11: drops grow at the lid, pinch off, and fall past the chin while their shape
changes.
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, TearScene, View, figure, side_by_side, stacked

VIEW = View((0.25, 0.02, 1.0), "nose_tip", (0.0, -0.25, -0.4), 2.0)

# %%
# The sad face of a child, as in the paper, and a tear from each eye; the right one comes a quarter of a second later.

face = fw.default_face(fw.Identity(child=1.0, age=-1.0))
sim = fw.Simulation(face)
sim.express("sadness")
*_, frame = sim.run(25)
tears = [fw.DrippingTear(face, "l", size=4.2), fw.DrippingTear(face, "r", size=4.0, begin=0.25)]

# %%
# A tear hangs for 0.8 s, and falls within 0.2 s. At 0.75 s both hang; at 0.88 and 0.94 s the left one falls, at 1.13 s
# the right one.

moments = [0.75, 0.875, 0.935, 1.13]
with TearScene(face, Style((460, 460), VIEW)) as scene:
    images = [scene.picture(frame, fw.tears.surfaces(tears, t, frame)) for t in moments]
figure(stacked([side_by_side(images[:2]), side_by_side(images[2:])]))

# %%
# Tears fall freely, by half g t².

first, second = (tears[0].fallen(t) for t in moments[1:3])
print(f"fallen {first:.1f} and {second:.1f} mm")
assert np.isclose(second / first, ((moments[2] - 0.8) / (moments[1] - 0.8)) ** 2)
