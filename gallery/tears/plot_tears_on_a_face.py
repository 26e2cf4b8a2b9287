"""
.. _dripping_tear:

Tears on a face
===============

Lin and Cheng let tears drip (their Fig. 11) or run down the skin (Fig. 12). Drops grow at the lid, pinch off, and fall
past the chin while their shape changes.
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, TearScene, View, figure, side_by_side, stacked

# %%
# Fig. 11: the sad face of a child, as in the paper, and a tear from each eye; the right one comes a quarter of a second
# later.

face = fw.default_face(fw.Identity(child=1.0, age=-1.0))
sim = fw.Simulation(face)
sim.express("sadness")
*_, frame = sim.run(25)
tears = [fw.DrippingTear(face, "l", size=4.2), fw.DrippingTear(face, "r", size=4.0, begin=0.25)]

# %%
# A tear hangs for 0.8 s, and falls within 0.2 s. At 0.75 s both hang; at 0.88 and 0.94 s the left one falls, at 1.13 s
# the right one.

moments = [0.75, 0.875, 0.935, 1.13]
with TearScene(face, Style((460, 460), View((0.25, 0.02, 1.0), "nose_tip", (0.0, -0.25, -0.4), 2.0))) as scene:
    images = [scene.picture(frame, fw.tears.surfaces(tears, t, frame)) for t in moments]
figure(stacked([side_by_side(images[:2]), side_by_side(images[2:])]))

# %%
# Tears fall freely, by half g t².

first, second = (tears[0].fallen(t) for t in moments[1:3])
print(f"fallen {first:.1f} and {second:.1f} mm")
assert np.isclose(second / first, ((moments[2] - 0.8) / (moments[1] - 0.8)) ** 2)

# %%
# .. _shedding_tear:
#
# Tears that run down
# -------------------
#
# Fig. 12: these find their own way, down the steepest descent from the lid. They lie on the skin and move with it while
# the face becomes sad and its wrinkles refine the mesh.

face = fw.default_face()
sim = fw.Simulation(face)
sim.express("sadness")
tears = [fw.SheddingTear(face, start="l"), fw.SheddingTear(face, start="r", begin=0.5, seed=1)]
frames = list(sim.run(32))

# %%
# The length of a tear grows with time, ``h = s + c t``: here at 0.1, 1, 2 and 3.2 s.

images = []
with TearScene(face, Style((460, 460), View((0.25, 0.02, 1.0), "nose_tip", (0.0, -0.1, -0.4), 1.8))) as scene:
    for t in (0.1, 1.0, 2.0, 3.2):
        frame = frames[min(int(10 * t), 31)]
        images.append(scene.picture(frame, fw.tears.surfaces(tears, t, frame)))
figure(stacked([side_by_side(images[:2]), side_by_side(images[2:])]))

# %%
# The tear is never deeper in the skin than a third of its film, however the skin moves: its facets cut across creases.

distance = tears[0].surface(3.2, frames[-1]).compute_implicit_distance(frames[-1])["implicit_distance"]
print(f"distance from the skin: {distance.min():.1e} to {distance.max():.2f} mm")
assert distance.min() >= -0.02
