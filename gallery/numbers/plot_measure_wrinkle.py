"""
.. _measure_wrinkle:

Measuring a wrinkle
===================

How deep are wrinkles, how far apart, how sharp? A mesh is cut along a fiber of the muscle, across its folds, and the
cut is compared with the formula.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.equations import bulge_height, phase, shape
from facewrinkle.geometry.interpolation import displaced

# %%
# A single muscle on a flat sheet, with wrinkles at full compression: the closed form is known here. The heights are
# exact at the vertices, and straight between them.

style = fw.Wrinkles(count=4, start=0.25, depth=0.5, alpha=2.0, core=0.6)
muscle = fw.LinearMuscle((0, 0, 0), (40, 0, 0), max_angle=0.6, radius=44.0, wrinkles=style)
u = muscle.half_wavelength


def wrinkled(spacing):
    """The sheet with the muscle's wrinkles at full compression; `spacing` is the length of its edges."""
    sheet = pv.Plane(
        center=(28, 0, 0),
        i_size=50,
        j_size=24,
        i_resolution=round(50 / spacing),
        j_resolution=round(24 / spacing),
    ).triangulate()
    points = np.asarray(sheet.points, dtype=float)
    height = style.depth * muscle.unit_amplitude(points)
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return pv.PolyData.from_regular_faces(displaced(points, height, up), sheet.regular_faces)


# %%
# Cut along the fiber with a plane, and put the points of the section in order.


def section(mesh, line=0.013):
    """Distance along the fiber and height of a mesh, cut beside the plane of symmetry."""
    cut = mesh.slice(normal=(0, 1, 0), origin=(0, line, 0))
    order = np.argsort(cut.points[:, 0])
    return cut.points[order, 0], cut.points[order, 2]


def exact(l):
    """The closed form on the fiber (Eqs. 4-6)."""
    w = phase(l, style.start * muscle.radius, u, style.alpha)
    inside = (l >= style.start * muscle.radius) & (l <= muscle.radius)
    return np.where(inside, style.depth * shape(w, u, 1.0, style.alpha), 0.0)


l = np.linspace(4.0, 50.0, 2000)
_, axes = plt.subplots(figsize=(10, 3))
axes.plot(l, exact(l), color="0.8", lw=5, label="closed form")
for spacing, color in ((2.0, "#edae49"), (1.0, "#2e86ab"), (0.25, "#d1495b")):
    axes.plot(*section(wrinkled(spacing)), color=color, lw=1, label=f"edges of {spacing:g} mm")
axes.set_xlabel("distance along the fiber (mm)")
axes.set_ylabel("height (mm)")
axes.legend(frameon=False, ncols=4, loc="upper right", bbox_to_anchor=(1.0, 1.2))
plt.tight_layout()

# %%
# Amplitude, wavelength and sharpness from the section alone. By the formula the furrow is ``2^alpha (1 + alpha)``, here
# 12 times as steep as the bulge.

x, z = section(wrinkled(0.05))
low = np.flatnonzero((z[1:-1] < z[:-2]) & (z[1:-1] <= z[2:]) & (z[1:-1] < -0.5)) + 1
furrows = [group[np.argmin(z[group])] for group in np.split(low, np.flatnonzero(np.diff(x[low]) > u) + 1)]
wavelength = np.diff(x[furrows]).mean()
amplitude = z.max() - z.min()
slope = np.abs(np.gradient(z, x))
between = (x > x[furrows[0]]) & (x < x[furrows[1]])
bulge = x[between][np.argmax(z[between])]
sharpness = np.interp(x[furrows[0]] + 0.1, x, slope) / np.interp(bulge - 0.15, x, slope)
print(f"{len(furrows)} furrows, {wavelength:.2f} mm apart (2u = {2 * u:.2f}), {amplitude:.3f} mm from furrow to bulge")
print(f"k0 2^alpha = {style.depth * 2**style.alpha:.3f} mm; slopes {sharpness:.1f} : 1")

# %%
# How fast the error falls as triangles get smaller. The profile has corners, so that the largest error is proportional
# to the size of the triangles, and the mean error to its square.

sizes = np.array([1.0, 0.5, 0.25, 0.125])
mean = []
for size in sizes:
    x, z = section(wrinkled(size))
    mean.append(np.abs(np.interp(l, x, z) - exact(l)).mean())
order = np.polyfit(np.log(sizes), np.log(mean), 1)[0]
print(f"mean error {', '.join(f'{e:.4f}' for e in mean)} mm: order {order:.2f}")
assert len(furrows) == style.count
assert abs(wavelength - 2.0 * u) < 0.1
assert abs(amplitude - style.depth * 2.0**style.alpha) < 0.05 * amplitude
assert bulge_height(style.depth, style.alpha) - z.max() < 0.05
assert order > 1.5
