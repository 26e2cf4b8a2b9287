"""
The pattern functions
=====================

Wrinkles of the forehead, the eye corner, a frown and a cheek, a dimple and an eye pouch: the height fields of Lin and
Cheng (Figs. 1, 3 and 5), and what their parameters do.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource

from facewrinkle.layers import patterns

x, y = np.meshgrid(np.linspace(-3, 3, 121), np.linspace(-3, 3, 121), indexing="ij")
right = x + 3.6


def row(surfaces, height=0.35):
    """Draw surfaces side by side."""
    figure = plt.figure(figsize=(3.4 * len(surfaces), 3))
    for i, (title, z) in enumerate(surfaces.items()):
        axes = figure.add_subplot(1, len(surfaces), i + 1, projection="3d")
        axes.plot_surface(x, y, z, color="#d9a78f", rcount=120, ccount=120, linewidth=0, antialiased=False)
        axes.set_box_aspect((1, 1, height), zoom=1.3)
        axes.view_init(45, -60)
        axes.set_axis_off()
        axes.set_title(title)
    figure.tight_layout()


def foreheads(rows, shown):
    """Draw forehead patterns as lit skin, each as (title, heights): local x points up on a face."""
    light = LightSource(azdeg=300, altdeg=40)
    _, axes = plt.subplots(rows, 3, figsize=(10, 1.8 * rows))
    for ax, (title, z) in zip(axes.flat, shown, strict=True):
        ax.imshow(
            light.hillshade(z[::-1], vert_exag=0.35, dx=5.0 / 400, dy=2.2 / 220), cmap="pink", vmin=-0.1, vmax=1.1
        )
        ax.set_axis_off()
        ax.set_title(title)
    plt.tight_layout()


# %%
# Fig. 1: a cycle of forehead wrinkles, as the time t goes on. alpha sets the depth: from peak to valley it is
# 2 sinh(alpha), whatever the time.
up, across = np.meshgrid(np.linspace(2.0, 4.2, 220), np.linspace(-2.5, 2.5, 400), indexing="ij")
cycle = {t: patterns.forehead(up, across, t, alpha=0.5, beta=4.0) for t in (0.0, 0.8, 1.6, 2.4, 3.2, 4.0)}
foreheads(2, [(f"t = {t:.1f}", z) for t, z in cycle.items()])
depths = [np.ptp(z) for z in cycle.values()]
print([f"{depth:.3f}" for depth in depths], f"2 sinh(0.5) = {2 * np.sinh(0.5):.3f}")
assert np.allclose(depths, 2 * np.sinh(0.5), rtol=1e-3)

# %%
# Fig. 3: eye corner, frown, cheek. The print of the frown can be read in two ways: lines that draw together
# upwards, or a fan, as on faces.
corner = patterns.eye_corner(right, y, 0.9, alpha=2.0, beta=-0.35, gamma=14)
row(
    {
        "eye corner": corner,
        "frown": patterns.frown(x, y, 4.0, alpha=0.5, beta=1.5),
        "frown as a fan": 0.4 * np.sin(patterns.frown_phase(x, y, 6.0, beta=0.1, variant="fan") + np.pi / 2),
        "cheek": patterns.cheek(x, y, 0.0, alpha=0.4, beta=4.0),
    }
)

# %%
# Fig. 5: dimple and eye pouch.
row(
    {
        "dimple": patterns.dimple(x, y, 0.05),
        "eye pouch": patterns.eye_pouch(x, y, 2.0, alpha=1.0, beta=0.5, gamma=2),
    },
    0.5,
)

# %%
# The style of forehead wrinkles is beta: plain arcs, M-shaped, broken.
styles = (1.0, 4.5, 9.0)
foreheads(1, [(f"beta = {beta:g}", patterns.forehead(up, across, 0.8, alpha=0.5, beta=beta)) for beta in styles])

# %%
# The number of eye-corner wrinkles on one side is gamma / 2.
angle = np.linspace(-np.pi / 2, np.pi / 2, 4001)[1:-1]
ring = patterns.eye_corner(np.cos(angle), np.sin(angle), 0.9, 2.0, -0.35, 14)
ridges = int(((ring[1:-1] > ring[:-2]) & (ring[1:-1] > ring[2:])).sum())
print(f"gamma = 14: {ridges} wrinkles")
assert ridges == 7
