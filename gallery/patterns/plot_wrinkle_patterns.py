"""
Placing wrinkles
================

The neutral face, and the face with wrinkles on forehead, eye corners and cheeks; then forehead wrinkles and a frown by
themselves (Lin, Cheng, Figs. 2 and 4).
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side

face = fw.default_face()


def shown(layers):
    """The face with layers, refined as they need it."""
    sim = fw.Simulation(face, layers=layers, motion=fw.Still(face))
    for _ in range(5):
        frame = sim.step()
    return frame


def show(frames, view="front", size=(420, 480)):
    """Pictures side by side, with their titles."""
    figure(side_by_side([picture(frame, face, Style(size, view)) for frame in frames.values()]), list(frames))


# %%
# Fig. 2: neutral, and three patterns at once.
patterns = [layer for name in ("forehead", "eye_corner", "cheek") for layer in fw.PatternLayer.presets(name, face)]
wrinkled = shown(patterns)
show({"neutral": face.mesh, "wrinkled": wrinkled})
show({"neutral": face.mesh, "wrinkled": wrinkled}, "left_three_quarter")

# %%
# Fig. 4: neutral, forehead wrinkles on some of the vertices only ("valid vertices"), and a frown.
broken = shown(fw.PatternLayer.presets("forehead", face, valid_share=0.85, seed=3, number=5))
frown = shown(fw.PatternLayer.presets("frown", face))
show({"neutral": face.mesh, "valid vertices": broken, "frown": frown}, "forehead", (420, 420))

# %%
# No two wrinkles are alike. The formula makes them even; with variation they differ in length, depth, distance and
# bend, on each side of the face. Another seed makes other ones.
even = shown(fw.PatternLayer.presets("eye_corner", face, variation=0.0))
grown = [shown(fw.PatternLayer.presets("eye_corner", face, seed=seed)) for seed in (0, 3)]
show({"even": even, "seed 0": grown[0], "seed 3": grown[1]}, "left_eye", (420, 420))
assert not np.allclose(grown[0]["W"][: face.mesh.n_points], grown[1]["W"][: face.mesh.n_points])

# %%
# Nothing moves where no pattern lies: here, everything below the nose.
below = (wrinkled["rest"] - face.landmarks["menton"]) @ face.frame.axes[1] < 5.0
print(f"{wrinkled.n_cells} triangles, {np.ptp(wrinkled['W']):.2f} mm from furrow to bulge")
assert not wrinkled["W"][below].any()
