"""
.. _people:

People and gaze
===============

Parameters in an artist's words turn the built-in head into other people. Muscles, skull, eyes and teeth follow, and so
do the wrinkles.
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side, stacked

# %%
# Give parameters from -1 to 1, or take a random person; all have the same triangles.

people = [
    fw.default_face({"age": 1.0, "sex": 0.5, "nose_length": 0.6}),
    fw.default_face({"sex": -0.8, "lips": 0.7, "cheeks": 0.4, "jaw": -0.4, "hair_length": 1.0}),
    fw.default_face(fw.Identity.random(4)),
    fw.default_face(fw.Identity.random(11)),
]


style, laughing = Style(size=(300, 340), view="left_three_quarter"), []
for face in people:
    sim = fw.Simulation(face)
    sim.express("laughter")
    frame = sim.settle()
    laughing.append(picture(frame, face, style))
calm = [picture(face.mesh, face, style) for face in people]
figure(stacked([side_by_side(calm), side_by_side(laughing)]), ["an old face", "a woman", "random(4)", "random(11)"])

# %%
# Eyes turn, and the lids follow them; both eyes can also look at one point.

face = people[0]
looks = [{"yaw": 30.0}, {"yaw": -30.0}, {"pitch": 20.0}, {"pitch": -25.0}]
images, frames = [], []
for look in looks:
    sim = fw.Simulation(face)
    sim.look(**look)
    frame = sim.settle()
    frames.append(frame)
    images.append(picture(frame, face, Style(size=(300, 200), view="cheeks")))
figure(side_by_side(images), [f"{turn} {angle:g}" for look in looks for turn, angle in look.items()])

# %%
# A frame says where the eyes look.

gaze = frames[0].field_data["gaze_l"][0]
yaw = np.degrees(np.arctan2(gaze @ face.frame.axes[0], gaze @ face.frame.axes[2]))
print(f"asked for 30 degrees to the left, looking {yaw:.1f} degrees")
assert abs(yaw - 30.0) < 0.5
assert len({face.mesh.n_cells for face in people}) == 1
