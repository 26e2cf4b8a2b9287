"""
.. _dripping_tear:

Tears that drip from a face
===========================

Four frames of Lin and Cheng's Fig. 11: drops grow at the lid, pinch off, and fall past the chin while their shape
changes.
"""

import matplotlib.pyplot as plt
import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, View
from facewrinkle.wet import TearScene

VIEW = View((0.25, 0.02, 1.0), "nose_tip", (0.0, -0.05, -0.4), 2.5)

# %%
# A sad face, and a tear from each eye; the right one is a quarter of a second late.

face = fw.default_face()
sim = fw.Simulation(face)
sim.express("sadness")
*_, frame = sim.run(25)
tears = [fw.DrippingTear(face, "l", size=4.2), fw.DrippingTear(face, "r", size=4.0, begin=0.25)]

# %%
# It hangs for 0.8 s, and falls within 0.2 s.

moments = [0.75, 0.875, 0.935, 1.13]
pictures, depths = [], []
with TearScene(face, Style((420, 420), VIEW)) as scene:
    for t in moments:
        drops = fw.tears.surfaces(tears, t, frame)
        depths.append(drops[0].center[1] if t < 1.0 else np.nan)
        pictures.append(scene.picture(frame, drops))

figure, axes = plt.subplots(1, 4, figsize=(12, 3.3))
for axis, picture, t in zip(axes, pictures, moments, strict=True):
    axis.imshow(picture)
    axis.set_title(f"t = {t:.2f} s", fontsize=9)
    axis.axis("off")
figure.tight_layout()

# %%
# It falls as things fall: half g t².

first, second = (tears[0].fallen(t) for t in moments[1:3])
print(f"fallen {first:.1f} and {second:.1f} mm")
assert np.isclose(second / first, ((moments[2] - 0.8) / (moments[1] - 0.8)) ** 2)
