"""
.. _skin:

How the skin follows the muscles
================================

Muscles pull the skin. Its material (springs, tethers to the bone, bending, damping) decides how far it follows, how
quickly, and how far away the pull is still felt. Any time step is stable.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import facewrinkle as fw

face = fw.default_face()
brow = int(np.argmin(np.linalg.norm(face.points - face.landmarks["brow_l_mid"], axis=1)))


def pulled(seconds=0.6, time_step=0.02, **material):
    """The lift of the left brow over time, as its frontalis contracts at once, and the skin at the end."""
    skin = fw.Skin(face, time_step, material=fw.SkinMaterial(**material))
    skin.contract({"frontalis_major_l": 1.0})
    lift = [0.0]
    for _ in range(round(seconds / time_step)):
        skin.step()
        lift.append(float(skin.displacement[brow, 1]))
    return np.array(lift), skin.displacement.copy()


# %%
# Over time: with the default damping of 1 the brow rises without overshooting; with little damping, it overshoots.

_, axes = plt.subplots(figsize=(9, 2.8))
for damping in (0.1, 0.3, 1.0, 2.0):
    lift, _ = pulled(damping=damping)
    axes.plot(0.02 * np.arange(len(lift)), lift, label=f"damping {damping:g}")
axes.set_xlabel("time (s)")
axes.set_ylabel("lift of the brow (mm)")
axes.legend(frameon=False)
plt.tight_layout()

# %%
# In space: `decay` is the length over which a local pull dies out. The longer it is, the wider and the weaker the
# effect of the same pull.

shown = []
_, axes = plt.subplots(figsize=(9, 2.8))
for decay in (7.0, 14.0, 28.0):
    _, moved = pulled(decay=decay)
    shown.append(np.linalg.norm(moved, axis=1))
    away = np.linalg.norm(face.points - face.points[brow], axis=1)
    ring = np.digitize(away, np.arange(0.0, 80.0, 4.0))
    front = face.points[:, 2] > 0.0
    mean = [shown[-1][front & (ring == k)].mean() for k in range(1, 20)]
    axes.plot(np.arange(2.0, 78.0, 4.0), mean, label=f"decay {decay:g} mm")
axes.set_xlabel("distance from the brow (mm)")
axes.set_ylabel("mean displacement (mm)")
axes.legend(frameon=False)
plt.tight_layout()

# %%
# The displacement of the skin at 7, 14 (the default) and 28 mm.

bar = {"title": "displacement (mm)\n", "n_labels": 4, "fmt": "%.1f", "title_font_size": 15, "label_font_size": 13}
plotter = pv.Plotter(off_screen=True, shape=(1, 3), window_size=(1200, 460), border=False)
for column, size in enumerate(shown):
    plotter.subplot(0, column)
    skin = face.mesh.copy()
    skin["displacement"] = size
    plotter.add_mesh(
        skin, scalars="displacement", cmap="OrRd", clim=(0, 4.5), smooth_shading=True, scalar_bar_args=bar.copy()
    )
    plotter.camera_position = [(120, 60, 480), (5, 20, 20), (0, 1, 0)]
plotter.show()

# %%
# Steps of 0.1 s end where steps of 0.01 s do: where the skin comes to rest does not depend on the time step.

_, fine = pulled(2.0, 0.01)
_, coarse = pulled(2.0, 0.1)
apart = np.linalg.norm(fine - coarse, axis=1).max()
print(f"largest displacement {np.linalg.norm(fine, axis=1).max():.2f} mm; time steps differ by {apart:.4f} mm")
assert apart < 0.02
