"""
.. _five_expressions:

The five expressions of the paper
=================================

Surprise, frowning, closing an eye, stretching the mouth, and fear: the expressions that Zhang, Sim and Tan show in
their Fig. 13, with the wrinkles that their paper prints, by their formula where it is mended, and as waves. The
numbers of triangles in their Table 1 stand beside ours.
"""

import matplotlib.pyplot as plt
import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side, stacked
from facewrinkle.simulation import PRINTED
from facewrinkle.simulation.fold_layers import with_printed_muscles

PAPER = {"paper_surprise": 8245, "frowning": 5847, "closing_eye": 5395, "stretching_mouth": 6328, "paper_fear": 7453}
"""Triangles of each expression in Table 1; the mesh at rest has 4517."""

NAMES = [expression.removeprefix("paper_").replace("_", " ") for expression in PAPER]
FRONT = ("front",) * 5
NEAR = ("forehead", "glabella", "left_eye", "right_mouth", "forehead")
face = fw.default_face()
paper_face = with_printed_muscles(face)


def held(simulation):
    """Play the five expressions in a simulation each, and return the last frames."""
    frames = []
    for expression in PAPER:
        sim = simulation()
        sim.express(expression)
        frames.append(sim.settle())
    return frames


def drawn(frames, views):
    """Draw the five in a row."""
    styles = [Style(size=(240, 264), view=view) for view in views]
    return side_by_side([picture(frame, face, style) for frame, style in zip(frames, styles, strict=True)])


# %%
# Fig. 13, without and with wrinkles, as printed (``folds="printed"``): the 23 muscles of the paper with their own
# wrinkling regions, and Eqs. 1 to 18. Furrows begin and end in a step, and are as deep as their parameters say.

bare = held(lambda: fw.Simulation(paper_face, fw.Refinement(max_level=0), layers=[]))
printed = held(lambda: fw.Simulation(paper_face, folds="printed"))
figure(stacked([drawn(frames, views) for views in (FRONT, NEAR) for frames in (bare, printed)]), NAMES)

# %%
# Mended (``folds="paper"``): nothing jumps, depths are bounded, and anatomical creases, which all people have at the
# same places, take the place of the lines beside the mouth and between the brows.

mended = held(lambda: fw.Simulation(face, folds="paper"))
figure(stacked([drawn(mended, views) for views in (FRONT, NEAR)]), NAMES)

# %%
# Beyond the paper, as waves (``folds="wave"``), the default: lines differ from person to person, end, and run into each
# other. The creases are the same.

waves = held(lambda: fw.Simulation(face, folds="wave"))
figure(stacked([drawn(waves, views) for views in (FRONT, NEAR)]), NAMES)

# %%
# Triangles of the printed folds, beside Table 1. The paper's model and ours start from 4,517; how many are added
# depends on the expression. (``python -m analysis.performance`` measures the table itself, over 250 time steps.)

ours = [frame.n_cells for frame in printed]
theirs = list(PAPER.values())
place = np.arange(len(PAPER))
_, axes = plt.subplots(figsize=(9, 3))
axes.bar(place - 0.2, theirs, 0.38, color="0.75", label="paper")
axes.bar(place + 0.2, ours, 0.38, color="#b5442e", label="facewrinkle, as printed")
axes.axhline(4517, color="0.3", lw=0.8, ls=":")
axes.set_xticks(place, NAMES)
axes.set_ylabel("triangles")
axes.legend(frameon=False)
plt.tight_layout()

# %%
# Both need the most for surprise, then fear, stretching the mouth, frowning, and closing an eye. Depths and regions are
# ours to choose, as the paper does not give them; the threshold is the same for all five.

print(f"Eq. 19 alone, gamma_c = {PRINTED.gamma_c:g}")
for name, after, count in zip(NAMES, theirs, ours, strict=True):
    print(f"{name:17s} paper 4517 -> {after}, here {face.mesh.n_cells} -> {count}")
assert np.array_equal(np.argsort(ours), np.argsort(theirs))
assert face.mesh.n_cells == 4517
