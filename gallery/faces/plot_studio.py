"""
.. _gallery_studio:

The studio
==========

A page in the browser with a slider for everything: :ref:`howto_studio` shows it in a film. All that is done there by
hand can be done, read and taken back from Python as well, while the page is open; here, without one.
"""

import matplotlib.pyplot as plt

import facewrinkle as fw
from facewrinkle.plotting import Style, picture, side_by_side

window = fw.studio(browser=False)  # without browser=False, the page opens
rest = window.frame()

# %%
# Pull the cheek raisers and the corners of the mouth up. `frame` waits until the face has come to rest.

window.rates = {"AU6": 1.0, "AU12": 0.8}
even = window.frame()

# %%
# Deeper lines on the subject's left, and the eyes aside: parts of one document, which the page shows and changes too.

window.change(folds={"left": 2.2}, gaze=[18.0, -4.0])
deeper = window.frame()
style = Style((420, 460))
_, axes = plt.subplots(figsize=(10, 3.7))
axes.imshow(side_by_side([picture(frame, window.face, style) for frame in (rest, even, deeper)]))
axes.axis("off")
plt.tight_layout(pad=0.0)

# %%
# What would make it without a studio: a session, which is a file and a program, too (:ref:`howto_session`).

session = window.session
print(session.as_python())
frame = session.frame()
assert abs(frame["W"].min() - deeper["W"].min()) < 0.05

# %%
# One step back.

window.undo()
assert abs(window.frame()["W"].min() - even["W"].min()) < 0.05
window.close()
