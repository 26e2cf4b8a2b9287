"""
.. _own_pattern:

A pattern of your own, on a painted region
==========================================

Any function of two local coordinates and a time is a pattern, and any painted weights are a region. Here they are
ornamental scars, rows of raised beads over brow and cheek, on a face that still frowns and smiles under them.
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, View, figure, picture, side_by_side

# %%
# Rows of beads, as a function in the plane. The coordinates of a region run from -1 to 1 between its borders.


def beads(x, y, t, across=9.0, rows=2.0):
    """Round bumps on a grid whose rows are shifted against each other."""
    shift = 0.5 * (np.floor(0.5 * rows * (y + 1.0)) % 2.0)
    u = (0.5 * across * (x + 1.0) + shift) % 1.0 - 0.5
    v = (0.5 * rows * (y + 1.0)) % 1.0 - 0.5
    return np.clip(1.0 - (u**2 + v**2) / 0.16, 0.0, None) ** 2


# %%
# One layer in a box above the brows, one on painted vertices of the cheek: weights from 0 to 1, one for each vertex.

face = fw.default_face()
cheek = face.landmarks["malar_l"] + [-12.0, -6.0, 0.0]
weights = np.clip(1.6 - np.linalg.norm(face.points - cheek, axis=1) / 12.0, 0.0, 1.0)
band = fw.Region(face.landmarks["glabella"] + [0, 18, 0], size=(84, 12), outline="box", border=0.2)
layers = [
    fw.PatternLayer(lambda x, y, t: beads(x, y, t, 15.0), region=band, depth=1.2, name="brow"),
    fw.PatternLayer(lambda x, y, t: beads(x, y, t, 5.0, 5.0), select=weights, depth=1.2, name="cheek"),
]

# %%
# Their heights are added to the wrinkles of the muscles, and they move with the skin.

sim = fw.Simulation(face, fw.Refinement(max_level=4), layers=[fw.MuscleWrinkles(), *layers])
sim.express({"AU4": 0.6, "AU12L": 0.7})
frames = list(sim.run(40))
near = View((0.45, 0.08, 1.0), "nose_tip", (0.1, 0.45, -0.6), 2.6)
images = [picture(frame, face, Style((520, 520), near)) for frame in (frames[4], frames[-1])]
figure(side_by_side(images), ["nearly at rest", "frowning and smiling"])

# %%
# Beads only rise: outside of them the patterns are exactly 0, whatever the skin does.

frame = frames[-1]
heights = {name: frame[f"pattern_{name}"] for name in ("brow", "cheek")}
for name, height in heights.items():
    print(f"{name}: {height.min():.2f} to {height.max():.2f} mm on {np.count_nonzero(height)} vertices")
assert all(0.8 < np.ptp(height) <= 1.2001 for height in heights.values())
assert all((height == 0.0).mean() > 0.5 for height in heights.values())
