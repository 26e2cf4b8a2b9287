"""
.. _character:

A character that a phone drives
===============================

Any face becomes a rig: a mesh with blend shapes that other programs mix by themselves, with wrinkles in them. A phone
sends the weights of these shapes, and either the rig follows, which is a sum, or the muscles of the face perform the
take, which is a simulation. :ref:`howto_character` takes it to three.js, Blender and Unity.
"""

import tempfile
from pathlib import Path

import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side

folder = Path(tempfile.mkdtemp())
face = fw.default_face()
names = ("browInnerUp", "mouthSmileLeft", "mouthSmileRight", "jawOpen", "eyeBlinkLeft", "noseSneerRight", "mouthPucker")
rig = fw.rig(face, "+".join(names), level=1)
fw.write_rig(rig, folder / "head.glb")
fw.rigging.write_page(rig, folder / "head.html")
plotter = pv.Plotter(shape=(1, 4), window_size=(1200, 400), border=False)
for column, name in enumerate(("browInnerUp", "mouthSmileLeft", "noseSneerRight", "mouthPucker")):
    plotter.subplot(0, column)
    plotter.add_mesh(rig.at({name: 1.0}), color="#d8a78c", smooth_shading=True)
    plotter.add_text(name, font_size=9)
    plotter.view_xy()
    plotter.camera.zoom(1.4)
plotter.show()

# %%
# A take as *Live Link Face* writes it, here made up: a smile comes and goes, the jaw opens, the brows rise.

time = np.linspace(0.0, 1.0, 31)
smile, jaw, brows = np.sin(np.pi * time) ** 2, 0.5 * np.sin(2 * np.pi * time) ** 2 * (time > 0.5), (time > 0.4) * time
rows = ["Timecode,BlendShapeCount,MouthSmileLeft,MouthSmileRight,JawOpen,BrowInnerUp"]
rows += [
    f"00:00:00:{k:02d}.000,4,{s:.4f},{s:.4f},{j:.4f},{b:.4f}"
    for k, (s, j, b) in enumerate(zip(smile, jaw, brows, strict=True))
]
(folder / "take.csv").write_text("\n".join(rows))
take = fw.read_take(folder / "take.csv", fps=30.0)

# %%
# The muscles perform it. A smile on an open jaw is more than the sum of both.

simulation = fw.Simulation(face, motion=fw.Performer(take, face, time_step=1 / 30))
frames = list(simulation.run(30))
shown = (8, 15, 22, 29)
performed = [picture(frames[k], face, Style((240, 240), "front")) for k in shown]
figure(side_by_side(performed), [f"{k / 30:.2f} s" for k in shown])

# %%
# How far is the sum from the simulation? ``facewrinkle rig --errors`` tells it of all shapes and of common mixtures.

mixture = {"jawOpen": 0.5, "mouthSmileLeft": 0.8, "mouthSmileRight": 0.8}
apart = rig.error(mixture)
print(f"{apart.mean:.2f} mm on average of {apart.motion:.1f} mm")
assert apart.mean < 0.15 * apart.motion
for file in sorted(folder.iterdir()):
    print(f"{file.name:12s} {file.stat().st_size / 1e3:8.0f} kB")
