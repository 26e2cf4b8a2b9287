"""
.. _animation:

Someone else's animation
========================

Most faces are animated with blend shapes and captured weights. Here such a clip moves the skin in place of the muscles;
where it compresses the skin, wrinkles rise, and nobody has to paint weights or maps.
"""

import matplotlib.pyplot as plt
import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side

# %%
# The clip is made from arrays here; :func:`facewrinkle.read_animation` reads one from a glTF or USD file or a VTKHDF
# series. It has two shapes (brows up, smile), as displacements of all points, and a row of weights for each of 31
# frames.

face = fw.default_face()


def sculpted(expression):
    """The displacements that an expression leads to, as an artist would have sculpted them."""
    sim = fw.Simulation(face, fw.Refinement(max_level=0), layers=[])
    sim.express(expression)
    *_, frame = sim.run(60)
    return frame.points - face.points


time = np.linspace(0.0, 3.0, 31)
weights = np.stack([np.clip(np.sin(time), 0.0, 1.0), np.clip(np.sin(time - 1.0), 0.0, 1.0) ** 2], axis=1)
clip = fw.Recorded.of_shapes(
    [sculpted("surprise"), sculpted("stretching_mouth")],
    weights,
    times=time,
    names=["browInnerUp", "mouthSmileRight"],
    rest=face.points,
)

# %%
# Its shapes have ARKit's names, so the clip knows which action units it plays.

print({unit: round(weight, 2) for unit, weight in clip.action_units(1.5).items()})

# %%
# Play it. The same clip without layers is the skin as it was recorded.

sim = fw.Simulation(face, motion=clip, time_step=0.05)
frames = list(sim.run(60))
bare = fw.Simulation(face, motion=clip, layers=[], time_step=0.05)
plain = list(bare.run(60))

style = Style(size=(300, 330), view="right_three_quarter")
moments = [3, 20, 36, 50]
figure(side_by_side([picture(frames[i], face, style) for i in moments]), [f"{0.05 * (i + 1):.2f} s" for i in moments])

near = Style(size=(480, 420), view="forehead")
figure(
    side_by_side([picture(plain[30], face, near), picture(frames[30], face, near)]), ["as recorded", "with wrinkles"]
)

# %%
# Wrinkles follow the motion, and triangles follow the wrinkles.

seconds = 0.05 * np.arange(1, 61)
_, (above, below) = plt.subplots(2, 1, figsize=(9, 3.6), sharex=True)
above.plot(time, weights, label=clip.names)
above.legend(frameon=False)
above.set_ylabel("weight")
below.plot(seconds, [np.ptp(frame["W"]) for frame in frames], color="#b5442e")
below.set_ylabel("deepest fold (mm)")
below.set_xlabel("time (s)")
plt.tight_layout()

# %%
# The recording itself is kept to the last digit: wrinkles are added, and nothing else changes.

n = len(face.points)
flat = np.abs(frames[30]["W"][:n]) == 0.0
assert np.allclose(frames[30].points[:n][flat], plain[30].points[:n][flat], atol=1e-9)
print(f"{n - flat.sum()} of {n} points are in a wrinkle at 1.55 s; the others move as recorded")
assert np.ptp(frames[30]["W"]) > 0.5
