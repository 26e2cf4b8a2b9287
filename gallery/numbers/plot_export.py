"""
.. _export:

Files for other programs
========================

Frames are PyVista meshes, so a frame can be saved in any format that PyVista writes. A whole clip goes into one VTKHDF
file, with its changing triangles and all its fields, for ParaView and PyVista; pictures go into a movie; a fitted face
is kept with its landmarks. For programs that need the same vertices in every frame, refine once and for all.
"""

import tempfile
from pathlib import Path

import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, pictures, side_by_side

folder = Path(tempfile.mkdtemp())
face = fw.default_face()
sim = fw.Simulation(face)
sim.express("frowning")
frames = list(sim.run(30))

# %%
# The whole clip, and one frame of it with its fields. ParaView plays the series; ``pv.read`` opens its first frame, a
# reader any other.

series = fw.write_series(frames, 0.04 * np.arange(30), folder / "frowning.vtkhdf")
frames[-1].save(folder / "frowning.vtp")
frames[-1].save(folder / "frowning.ply")
reader = pv.get_reader(series)
reader.reader.SetStep(29)
last = reader.read()

# %%
# A movie, here a .gif; .mp4 works as well. Both need the extra `export`.

fw.write_movie(pictures(frames, face, Style((320, 300), "glabella")), folder / "frowning.gif", fps=25)

shown = (0, 10, 14, 29)
strip = side_by_side([picture(frames[i], face, Style((280, 260), "glabella")) for i in shown])
figure(strip, [f"{0.04 * i:.2f} s" for i in shown])

# %%
# A file of a fitted face: mesh, landmarks and unit. Muscles, skull and eyes are placed anew when it is read.

path = fw.write_face(face, folder / "head.face")
again = fw.read_face(path)

# %%
# The same vertices in every frame, for a point cache or shape keys in Blender and game engines: the region is refined
# once, and refinement is turned off. The positions of all frames make one array.

near = np.linalg.norm(face.mesh.cell_centers().points - face.landmarks["glabella"], axis=1) < 45.0
fine = fw.refine(face.mesh, near)
fine = fw.refine(fine, np.linalg.norm(fine.cell_centers().points - face.landmarks["glabella"], axis=1) < 40.0)
fixed = fw.Simulation(fw.fit_face(fine, face.landmarks, units="mm"), fw.Refinement(max_level=0))
fixed.express("frowning")
cache = np.stack([frame.points for frame in fixed.run(30)])
np.save(folder / "frowning.npy", cache.astype(np.float32))
print(f"positions of {cache.shape[1]} vertices in {cache.shape[0]} frames")
for file in sorted(folder.iterdir()):
    print(f"{file.name:18s} {file.stat().st_size / 1e3:8.0f} kB")

# %%
# What was read is what was written.

assert np.array_equal(last.points, frames[-1].points)
assert np.array_equal(last["W"], frames[-1]["W"])
assert np.array_equal(again.points, face.points)
