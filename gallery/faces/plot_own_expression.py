"""
.. _own_expression:

Action units, and an expression of your own
===========================================

The action units of the Facial Action Coding System (Ekman, Friesen) say what a face does; here each one contracts some
muscles. Units, muscles and expressions mix freely, each with its own strength, also on one side only.
"""

import tempfile
from pathlib import Path

import facewrinkle as fw
from facewrinkle.plotting import Style, View, figure, picture, side_by_side

NEAR = View((0.0, 0.02, 1.0), "nose_tip", (0.0, 0.2, -1.6), 3.3)

# %%
# Happiness is 6 + 12, sadness 1 + 4 + 15, anger 4 + 7 + 17 + 24, disgust 9 + 17 (FACS, see :ref:`papers`): use
# the names or the units. "paper_surprise" and "paper_fear" are the paper's, which move the brows alone.
# "AU12L" is the left half of a unit, on the subject's own left.

face = fw.default_face()
asked = {
    "happiness": {"AU6": 0.9, "AU12": 0.9},
    "sadness": "sadness",
    "anger": "anger",
    "disgust": "disgust",
    "a half smile": {"AU12L": 0.7, "AU6L": 0.5},
    "jaw drop": {"AU26": 1.0, "AU1": 0.4},
    "a wink": "wink",
    "disbelief": {"AU2L": 1.0, "AU4R": 0.7, "corrugator_r": 0.6, "AU17": 0.5},
}


def held(what, face, **options):
    """The face that holds an expression."""
    sim = fw.Simulation(face, **options)
    sim.express(what)
    frame = sim.settle()
    return frame


images = [picture(held(what, face), face, Style((300, 340), NEAR)) for what in asked.values()]
for four in (slice(4), slice(4, 8)):
    figure(side_by_side(images[four]), list(asked)[four])

# %%
# The muscles that an action unit contracts. All names are in :data:`facewrinkle.EXPRESSIONS`,
# :data:`facewrinkle.ACTION_UNITS` and :data:`facewrinkle.MUSCLES`.

for muscle, rate in fw.ACTION_UNITS["AU2"].items():
    print(f"AU2: {muscle} {rate:g}")

# %%
# How the skin folds over a muscle is a property of the muscle. Here are seven fine furrows across the forehead, instead
# of three or four, by the formula of the paper: waves take their lines from the whole skin.

frontalis = [name for name in face.muscles if name.startswith("frontalis")]
fine = face.with_muscles({name: face.muscles[name].replaced(count=7, depth=1.0) for name in frontalis})
frames = [held("surprise", each, folds="paper") for each in (face, fine)]
style = Style(size=(450, 400), view="forehead")
figure(side_by_side([picture(frame, face, style) for frame in frames]), ["as in the atlas", "seven furrows"])

# %%
# An expression of your own has a name, and is used as any other. To keep it, write the atlas, the file that says where
# muscles lie and what they do together; commands take it with ``--atlas``.

sceptic = face.with_expressions({"scepticism": {"AU2L": 1.0, "AU14R": 0.5}, "disdain": "scepticism=0.6+AU17"})
atlas = fw.write_atlas(sceptic.atlas, Path(tempfile.mkdtemp()) / "atlas.toml")
print(", ".join(fw.read_atlas(atlas).expressions["disdain"]))

# %%
# Mixtures are exact: half an expression contracts each of its muscles half as much.

sim = fw.Simulation(face)
sim.express("sadness", intensity=0.5)
sim.step()
rates = dict(zip(sim.muscles, sim.skin.rates, strict=True))
print(", ".join(f"{name} {rate:g}" for name, rate in rates.items() if rate > 0.0))
assert all(rates[name] == 0.5 * rate for name, rate in fw.EXPRESSIONS["sadness"].items())
