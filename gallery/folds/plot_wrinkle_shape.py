"""
.. _wrinkle_shape:

The shape of a wrinkle, and why it keeps its volume
===================================================

Skin that folds does not shrink: what sinks into the furrow rises in the bulge. Zhang, Sim and Tan choose the
cross-section ``H(w) = d - k0 |s| (1 + s²)^alpha`` with ``s = (w - u) / u`` (Eq. 4), and the height d of the bulge such
that H integrates to zero over a wrinkle (Eq. 7).
"""

import matplotlib.pyplot as plt
import numpy as np

from facewrinkle.geometry.equations import attenuation, bulge_height, phase, shape, zero_crossing

# %%
# Fig. 3 of the paper: the three parameters, one at a time, in mm over two wrinkles with ``u = 1``. The furrow depth
# factor k0 scales all heights; the exponent alpha makes furrows sharp and bulges round (at 0 both are straight); the
# height d of the bulge lifts the whole profile. Only one d keeps the volume, so it is no free parameter here: red in
# the last plot.

w = np.linspace(0.0, 4.0, 801)
flat = bulge_height(1.0, 1.0)
profiles = [
    {f"k0 = {k0:g}": shape(np.mod(w, 2.0), 1.0, k0, alpha=1.0) for k0 in (0.5, 1.0, 1.5)},
    {f"alpha = {alpha:g}": shape(np.mod(w, 2.0), 1.0, 1.0, alpha) for alpha in (0.0, 0.5, 1.0, 1.5)},
    {f"d = {d:g}": shape(np.mod(w, 2.0), 1.0, 1.0, 1.0) + d - flat for d in (0.25, flat, 1.25)},
]
_, axes = plt.subplots(1, 3, figsize=(10, 3), sharey=True)
for axis, lines, title in zip(axes, profiles, ("alpha = 1", "k0 = 1", "k0 = alpha = 1"), strict=True):
    for name, height in lines.items():
        axis.plot(w, height, label=name, color="#b5442e" if name == f"d = {flat:g}" else None)
    axis.axhline(0.0, color="0.7", lw=0.8)
    axis.set_xlabel("w / u")
    axis.set_title(title, fontsize=10)
    axis.legend(frameon=False, fontsize=8, loc="lower center")
axes[0].set_ylabel("H (mm)")
axes[0].set_ylim(-4.6, 1.6)
plt.tight_layout()

# %%
# As printed, the first wrinkle begins and the last one ends at the bottom of a furrow, and the surface jumps there. The
# default begins where H is zero: both ends are continuous, and the number of furrows is the same.

length, start, count = 40.0, 10.0, 3
u = (length - start) / (2 * count)
l = np.linspace(5.0, 45.0, 1601)
inside = (l >= start) & (l <= length)
_, axes = plt.subplots(2, 1, figsize=(9, 3.4), sharex=True)
for axis, ends in zip(axes, ("paper", "continuous"), strict=True):
    axis.plot(l, np.where(inside, shape(phase(l, start, u, 2.0, ends), u, 0.25), 0.0), color="#b5442e")
    axis.set_ylabel(ends)
axes[1].set_xlabel("distance from the attachment (mm)")
plt.tight_layout()

# %%
# Towards the sides the wrinkles fade: as printed, with a kink at both ends of the band, or smoothly.

s = np.linspace(-0.3, 1.3, 321)
_, axis = plt.subplots(figsize=(9, 2.2))
for falloff in ("paper", "smoothstep"):
    axis.plot(s, attenuation(s, falloff), label=falloff)
axis.set_xlabel("s")
axis.set_ylabel("At")
axis.legend(frameon=False)
plt.tight_layout()

# %%
# The volume, by Gauss-Legendre quadrature of each half (there is a kink at the bulge).

nodes, weights = np.polynomial.legendre.leggauss(40)
for alpha in (0.0, 0.5, 1.0, 2.0, 4.0):
    net = sum(0.5 * weights @ shape(0.5 * (nodes + 1.0) + half, 1.0, 1.0, alpha) for half in (0.0, 1.0))
    print(f"alpha {alpha:3g}: d = {bulge_height(1.0, alpha):.6f}, zero at {zero_crossing(alpha):.6f}, net {net:+.1e}")
    assert abs(net) < 1e-13
