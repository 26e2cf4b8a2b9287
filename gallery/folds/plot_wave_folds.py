"""
.. _wave_folds:

Folds that grow where the skin is compressed
============================================

Lines on foreheads wander, branch and end. :class:`facewrinkle.WaveFolds` finds them once per face, as waves across the
directions in which the face's own motions compress it, and makes them as deep as the skin is compressed now. How they
are found: :ref:`theory_folds`.
"""

import numpy as np

import facewrinkle as fw
from facewrinkle.plotting import Style, figure, picture, side_by_side, stacked

face = fw.default_face()
forehead = Style((330, 300), "forehead")


def played(name, **options):
    """The last frame of an expression, held until it has settled."""
    sim = fw.Simulation(face, **options)
    sim.express(name)
    frame = sim.settle()
    return frame


# %%
# Waves beside the papers' formula, in surprise and with raised cheeks. The folds that everybody has at the same places,
# beside the nose or between the brows, stay formulas; ``folds="paper"`` draws all lines by formula.

views = {"surprise": forehead, "happiness": Style((330, 300), "left_eye")}
frames = {folds: [played(name, folds=folds) for name in views] for folds in ("paper", "wave")}
rows = [
    [picture(frame, face, style) for frame, style in zip(own, views.values(), strict=True)] for own in frames.values()
]
titles = [f"{name}, {folds}" for folds in frames for name in views]
figure(side_by_side([image for row in rows for image in row]), titles)

# %%
# The lines are the face's own, found before anything moves: phases and strengths of five families. In a frame, the
# array "theta" holds the phase of the family that is deepest, 0 on a bulge and pi in a furrow.

layer = fw.Simulation(face, layers=[fw.WaveFolds()]).layers[0]
print("\n".join(f"{name}: {np.mean(p.zone):.0%} of all triangles" for name, p in layer.lines.items()))

# %%
# Another seed is another person's lines; `density`, `depth` and `irregularity` are what an artist would change next.

settings = [{"seed": 1}, {"seed": 2}, {"density": 1.4, "seed": 1}, {"irregularity": 0.0}]
images = [picture(played("surprise", layers=[fw.WaveFolds(**each)]), face, forehead) for each in settings]
figure(side_by_side(images), [", ".join(f"{name} {value:g}" for name, value in each.items()) for each in settings])

# %%
# None here, more there: factors for landmarks, for regions, or for every vertex.

smooth = fw.WaveFolds(amount={"forehead_mid": 0.0})
left = fw.WaveFolds(amount=np.where(face.points[:, 0] > 0.0, 1.5, 0.3))
images = [picture(played("surprise", layers=[layer]), face, forehead) for layer in (smooth, left)]
figure(side_by_side(images), ["none on the forehead", "1.5 on one side, 0.3 on the other"])

# %%
# Age leaves lines at rest, where the face folds in life. They deepen as the skin is compressed, and vanish where it is
# stretched. Without age, a face at rest has none, to the last bit.

young, old = (fw.Simulation(face, layers=[fw.WaveFolds(age=age)]).step() for age in (0.0, 1.0))
assert not young["W"].any()
assert old["W"].min() < -0.1

shown = {**views, "rest": Style((330, 300), "cheeks")}
aged = [
    {name: played({"AU1": 0.0} if name == "rest" else name, layers=[fw.WaveFolds(age=age)]) for name in shown}
    for age in (0.0, 1.0)
]
rows = [[picture(frames[name], face, style) for name, style in shown.items()] for frames in aged]
figure(stacked([side_by_side(row) for row in rows]), [f"{name}, ages 0 and 1" for name in shown])

# %%
# Near enough, pictures show the micro-relief between the lines, too: pores, and a net of fine furrows that rises where
# the skin is compressed, flattens where it is stretched, and grows with age. Without, then at age 0, then at age 1.

young, old = (frames["happiness"] for frames in aged)
near = Style((440, 400), "left_eye")
plain = Style((440, 400), "left_eye", microrelief=False)
shown = [(young, plain), (young, near), (old, near)]
figure(side_by_side([picture(frame, face, style) for frame, style in shown]), ["without", "age 0", "age 1"])
