"""
.. _shedding_tear:

Tears that run down a face
==========================

Four frames of Lin and Cheng's Fig. 12. The tears find their own way, down the steepest descent from the lid. They lie
on the skin and move with it while the face becomes sad and its wrinkles refine the mesh.
"""

import facewrinkle as fw
from facewrinkle.plotting import Style, TearScene, View, figure, side_by_side, stacked

VIEW = View((0.25, 0.02, 1.0), "nose_tip", (0.0, -0.1, -0.4), 1.8)

# %%
# Two tears, and a face that moves.

face = fw.default_face()
sim = fw.Simulation(face)
sim.express("sadness")
tears = [fw.SheddingTear(face, start="l"), fw.SheddingTear(face, start="r", begin=0.5, seed=1)]
frames = list(sim.run(32))

# %%
# The length of a tear grows with time, ``h = s + c t``: here at 0.1, 1, 2 and 3.2 s.

moments = [0.1, 1.0, 2.0, 3.2]
images = []
with TearScene(face, Style((460, 460), VIEW)) as scene:
    for t in moments:
        frame = frames[min(int(10 * t), 31)]
        images.append(scene.picture(frame, fw.tears.surfaces(tears, t, frame)))
figure(stacked([side_by_side(images[:2]), side_by_side(images[2:])]))

# %%
# The tear is never deeper in the skin than a third of its film, however the skin moves: its facets cut across creases.

distance = tears[0].surface(3.2, frames[-1]).compute_implicit_distance(frames[-1])["implicit_distance"]
print(f"distance from the skin: {distance.min():.1e} to {distance.max():.2f} mm")
assert distance.min() >= -0.02
