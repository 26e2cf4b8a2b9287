"""
.. _growing_wrinkles:

Wrinkles that grow: with the contraction, and in time
=====================================================

The depth of a wrinkle follows the contraction rate, and its triangles come with it. Both are shown by Zhang, Sim and
Tan, in Figs. 12(b) and 14; all pictures of this page have their wrinkles as printed (``folds="printed"``).
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side, stacked
from facewrinkle.simulation.fold_layers import with_printed_muscles

STEPS = 30
face = with_printed_muscles(fw.default_face())


def played(expression, intensity=1.0):
    """All frames of an expression with wrinkles as printed."""
    sim = fw.Simulation(face, folds="printed")
    sim.express(expression, intensity)
    return [frame.copy() for frame in sim.run(STEPS)]


def drawn(frames, view, wireframe=False):
    """Pictures of frames in a row."""
    style = Style(size=(260, 260), view=view, wireframe=wireframe)
    return side_by_side([picture(frame, face, style) for frame in frames])


# %%
# Fig. 12(b): surprise at four intensities, .4 to 1. The furrow depth factor k0 is
# in proportion to the rate, and compression grows with the rate as well.

rates = (0.4, 0.6, 0.8, 1.0)
held = {rate: played("surprise", rate)[-1] for rate in rates}
figure(drawn(held.values(), "forehead"), [f"intensity {rate:g}" for rate in rates])
depths = [-float(held[rate]["W"].min()) for rate in rates]
print("deepest furrow: " + ", ".join(f"{depth:.2f} mm at {rate:g}" for rate, depth in zip(rates, depths, strict=True)))

# %%
# Fig. 14: moments of a dynamic simulation, and the triangles below them. Surprise, from the left.

moments = (6, 17, 22, STEPS - 1)
titles = [f"step {k + 1}" for k in moments]
surprise = played("surprise")
shots = [surprise[k] for k in moments]
figure(stacked([drawn(shots, "forehead"), drawn(shots, "forehead", wireframe=True)]), titles)
print([frame.n_cells for frame in shots], "triangles")

# %%
# Closing an eye.

closing = played("closing_eye")
shots = [closing[k] for k in moments]
figure(stacked([drawn(shots, "left_eye"), drawn(shots, "left_eye", wireframe=True)]), titles)
print([frame.n_cells for frame in shots], "triangles")
assert np.all(np.diff(depths) > 0.0)
assert depths[0] < 0.4 * depths[-1]  # k0 and the compression both grow: faster than in proportion
assert surprise[0].n_cells < surprise[-1].n_cells
