"""
.. _muscles:

Muscles and the fields they define
==================================

Three kinds of muscles pull the skin. A linear muscle pulls a cone of skin towards a point, a sheet pulls a rectangle
towards a line, a sphincter pulls a ring towards its center (Zhang, Sim, Tan, Section 3). Each gives every vertex two
coordinates: how far along the muscle it lies, and how far to the side.
"""

import numpy as np
import pyvista as pv

import facewrinkle as fw

face = fw.default_face()
fibers = {"linear": "#d1495b", "sheet": "#2e86ab", "sphincter": "#edae49"}

# %%
# The muscles over the skull: linear ones red, sheets blue, sphincters yellow.


def lines_of(muscle):
    """A muscle as lines to draw, and the name of its kind."""
    if isinstance(muscle, fw.LinearMuscle):
        return pv.Line(muscle.attachment, muscle.insertion), "linear"
    if isinstance(muscle, fw.SheetMuscle):
        ends = [np.linspace(*side, 6) for side in (muscle.attachment, muscle.insertion)]
        return pv.merge([pv.Line(a, b) for a, b in zip(*ends, strict=True)]), "sheet"
    if isinstance(muscle, fw.SphincterMuscle):
        turn = np.linspace(0.0, 2.0 * np.pi, 60)[:, None]
        across = muscle.semi_major * np.cos(turn) * muscle.lateral + muscle.semi_minor * np.sin(turn) * muscle.vertical
        return pv.MultipleLines(muscle.centre + across + 4.0 * muscle.normal), "sphincter"
    return None, None


plotter = pv.Plotter(off_screen=True, window_size=(800, 700))
plotter.add_mesh(face.skull, color="#e8e2d6", smooth_shading=True)
plotter.add_mesh(face.mesh, color="#d9a78f", opacity=0.18, smooth_shading=True)
for muscle in face.muscles.values():
    lines, kind = lines_of(muscle)
    if lines is not None:
        plotter.add_mesh(lines, color=fibers[kind], line_width=5)
plotter.camera_position = [(300, 60, 560), (0, -10, 20), (0, 1, 0)]
plotter.show()

# %%
# The coordinates of one muscle. The zygomaticus major draws the corner of the mouth up and back; ``lambda`` is 0 where
# it is attached and 1 at the end of its reach, ``gamma`` is 0 on its central fiber and 1 at its border.

muscle = face.muscles["zygomaticus_major_l"]
skin = face.mesh
for _ in range(2):  # finer triangles, for smoother borders in the picture
    skin = fw.refine(skin, np.arange(skin.n_cells))
lam, gamma = muscle.coordinates(skin.points)
reach = (lam > 0.0) & (lam <= 1.0) & (gamma <= 1.0)
skin["lambda"], skin["gamma"] = np.where(reach, lam, np.nan), np.where(reach, gamma, np.nan)
skin["pull"] = muscle.force(skin.points)

bar = {"n_labels": 3, "fmt": "%.1f", "title_font_size": 16, "label_font_size": 14}
plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=(1000, 520), border=False)
for column, name in enumerate(("lambda", "gamma")):
    plotter.subplot(0, column)
    colors = {"scalars": name, "cmap": "viridis", "nan_color": "#d9c8bf", "clim": (0, 1)}
    plotter.add_mesh(skin.copy(), smooth_shading=True, scalar_bar_args={"title": f"{name}\n", **bar}, **colors)
    plotter.camera_position = [(330, 10, 330), (20, -10, 20), (0, 1, 0)]
plotter.show()

# %%
# The pull points to the attachment, and is strongest near the end of the muscle's reach, where it inserts into the
# skin.

pull = np.linalg.norm(skin["pull"], axis=1)
strongest = int(np.argmax(pull))
away = float(np.linalg.norm(skin.points[strongest] - muscle.insertion))
print(
    f"{len(face.muscles)} muscles; the strongest pull is {away:.1f} mm from the insertion, lambda {lam[strongest]:.2f}"
)
assert 0.9 < lam[strongest] <= 1.0
