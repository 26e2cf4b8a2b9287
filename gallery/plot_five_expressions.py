"""
.. _five_expressions:

The five expressions of the paper
=================================

Surprise, frowning, closing an eye, stretching the mouth, and fear: the expressions that Zhang, Sim and Tan show. The
numbers of triangles in their Table 1 stand beside ours.
"""

import matplotlib.pyplot as plt
import numpy as np

import facewrinkle as fw
from facewrinkle.commands.table1 import PAPER
from facewrinkle.plotting import Style, closeup, figure, picture, side_by_side, stacked

face = fw.default_face()
frames = {}
for row in PAPER:
    sim = fw.Simulation(face, folds="paper")
    sim.express(row.expression)
    *_, frames[row.expression] = sim.run(60)

# %%
# The faces, and the places where they wrinkle.

rows = []
for view in ("front", None):
    style = [Style(size=(300, 330), view=view or closeup(frame, face)) for frame in frames.values()]
    rows.append(side_by_side([picture(f, face, s) for f, s in zip(frames.values(), style, strict=True)]))
figure(stacked(rows))

# %%
# Triangles. The paper's model and ours start from 4,517; how many are added depends on the expression.

ours = [frames[row.expression].n_cells for row in PAPER]
theirs = [row.after for row in PAPER]
place = np.arange(len(PAPER))
_, axes = plt.subplots(figsize=(9, 3))
axes.bar(place - 0.2, theirs, 0.38, color="0.75", label="paper")
axes.bar(place + 0.2, ours, 0.38, color="#b5442e", label="facewrinkle")
axes.axhline(4517, color="0.3", lw=0.8, ls=":")
axes.set_xticks(place, [row.expression.replace("_", " ") for row in PAPER])
axes.set_ylabel("triangles")
axes.legend(frameon=False)
plt.tight_layout()

# %%
# Both need the most for the same expressions: surprise first, then fear.

for row, count in zip(PAPER, ours, strict=True):
    print(f"{row.expression:17s} paper {row.before} -> {row.after}, here {face.mesh.n_cells} -> {count}")
assert np.argmax(ours) == np.argmax(theirs) == 0
assert face.mesh.n_cells == PAPER[0].before
