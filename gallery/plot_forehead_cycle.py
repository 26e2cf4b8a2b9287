"""
A running cycle of forehead wrinkles
====================================

Six frames of the pattern function for the forehead, as its time t goes on (Lin, Cheng, Fig. 1).
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource

from facewrinkle.layers import patterns

# %%
# The pattern on the part of its plane that suits a forehead. Its local x points up.
x, y = np.meshgrid(np.linspace(2.0, 4.2, 220), np.linspace(-2.5, 2.5, 400), indexing="ij")
times = [0.0, 0.8, 1.6, 2.4, 3.2, 4.0]
frames = [patterns.forehead(x, y, t, alpha=0.5, beta=4.0) for t in times]

# %%
light = LightSource(azdeg=300, altdeg=40)
figure, axes = plt.subplots(2, 3, figsize=(10, 3.6))
for ax, t, z in zip(axes.flat, times, frames, strict=True):
    shade = light.hillshade(z[::-1], vert_exag=0.35, dx=5.0 / 400, dy=2.2 / 220)
    ax.imshow(shade, cmap="pink", vmin=-0.1, vmax=1.1)
    ax.set_axis_off()
    ax.set_title(f"t = {t:.1f}")
figure.tight_layout()

# %%
# alpha sets the depth: from peak to valley it is 2 sinh(alpha), whatever the time.
depths = [np.ptp(z) for z in frames]
print([f"{d:.3f}" for d in depths], f"2 sinh(0.5) = {2 * np.sinh(0.5):.3f}")
assert np.allclose(depths, 2 * np.sinh(0.5), rtol=1e-3)
