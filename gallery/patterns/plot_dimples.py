"""
Dimples that a smile brings out
===============================

Round dimples on both cheeks (Lin, Cheng, Fig. 6). They appear only with a smile: the more it compresses the skin, the
deeper they are.
"""

import matplotlib.pyplot as plt
import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side

face = fw.default_face()
sim = fw.Simulation(face, layers=fw.PatternLayer.presets("dimple", face, strength="skin"))

# %%
# Neutral, halfway and smiling.
sim.express("AU12", 0.9)
frames = list(sim.run(24))
images = [
    picture(frame, face, Style(size=(420, 420), view="left_mouth")) for frame in (frames[0], frames[9], frames[-1])
]
figure(side_by_side(images), ["neutral", "halfway", "smiling"])
figure(side_by_side([picture(frame, face, Style(size=(632, 560))) for frame in (frames[0], frames[-1])]))

# %%
# The depth over time.
depth = [float(np.abs(frame["W"]).max()) for frame in frames]
_, axes = plt.subplots(figsize=(9, 2.4))
axes.plot(depth)
axes.set_xlabel("frame")
axes.set_ylabel("depth (mm)")
plt.tight_layout()
print(f"{depth[0]:.2f} mm at rest, {depth[-1]:.2f} mm in the smile")
assert depth[0] == 0.0
assert depth[-1] > 1.0
assert (np.diff(depth) > -0.05).all()
