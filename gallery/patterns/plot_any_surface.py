"""
Patterns and tears on any surface
=================================

Neither patterns nor tears need anatomy: a pig frowns, smiles and weeps. All that has to be said is where.
"""

import warnings

import numpy as np
import pyvista as pv

import facewrinkle as fw
import facewrinkle.accessor
from facewrinkle.plotting import Style, TearScene, View, figure, picture, side_by_side

# %%
# A head of 16,000 triangles comes with the package. Snout and ears are painted redder than the rest.
skin = fw.examples.load_pig()
x, y, z = skin.points.T
red = np.clip(np.maximum((z - 110.0) / 40.0, (y - 110.0) / 60.0 * (skin.point_normals[:, 2] > 0.0)), 0.0, 1.0)[:, None]
skin["Colors"] = ((1.0 - red) * [226, 176, 158] + red * [208, 132, 122]).astype(np.uint8)
eyes = []
for side in (-1, 1):
    eye = pv.Sphere(radius=15.5, center=(side * 60, 34, 34), theta_resolution=120, phi_resolution=120)
    glint = eye.point_normals @ [side * 0.45, 0.45, 0.77] > 0.985
    turned = eye.point_normals @ [side * 0.55, 0.05, 0.83]  # cosine of the angle from where it looks
    eye["Colors"] = np.select(
        [
            glint[:, None],
            turned[:, None] > 0.93,
            turned[:, None] > 0.6,
        ],
        [[255, 255, 250], [14, 10, 10], [92, 56, 34]],
        [226, 214, 204],
    ).astype(np.uint8)
    eyes.append(eye)
with warnings.catch_warnings():
    warnings.simplefilter("ignore", fw.FaceWrinkleWarning)  # it says that the eyes are parts of their own
    pig = fw.surface(pv.merge([skin, *eyes]), units="mm")

# %%
# All patterns of the paper: a place, the direction that is up there, a width and a height, in mm. Those of one side are
# mirrored for the other.
places = {
    "forehead": ((0, 98, 46), (0, 1, -0.6), (130, 64), {"number": 4, "style": "arcs", "depth": 5}),
    "frown": ((0, 46, 68), (0, 1, -0.8), (60, 50), {"depth": 8}),
    "eye_corner": ((92, 30, 18), (0.3, 1, 0), (40, 52), {"number": 4, "splay": 0.3, "depth": 3.5}),
    "cheek": ((90, -52, 30), (-0.4, 1, 0), (66, 92), {"number": 3, "sharpness": 1, "radius": 0.3, "depth": 5}),
    "dimple": ((64, -26, 72), (0, 1, 0), (30, 30), {"sharpest": 0.3, "border": 1, "depth": 4}),
    "eye_pouch": ((68, 4, 46), (0, 1, 0), (48, 26), {"number": (0.7, 0.55), "crease": 0.3, "bow": 0.5, "depth": 5}),
}
layers = []
for name, (center, up, size, looks) in places.items():
    for side in (1, -1) if center[0] else (1,):
        where = {"center": np.multiply(center, [side, 1, 1]), "up": np.multiply(up, [side, 1, 1]), "mirrored": side < 0}
        looks = {"variation": 0.5, "seed": side + 1, **looks} if name not in ("dimple", "eye_pouch") else looks
        layers.append(fw.PatternLayer(name, **where, size=size, name=f"{name} {side}", **looks))
simulation = fw.Simulation(pig, fw.Refinement(max_level=3), layers=layers, motion=fw.Still(pig))
for _ in range(5):
    frame = simulation.step()

# %%
# Both kinds of tears: one runs down from each eye, and one drips.
tears = [fw.SheddingTear(pig, start=(side * 74, 16, 42), width=10.0, height=4.0, seed=3) for side in (-1, 1)]
tears.append(fw.DrippingTear(pig, (86, 12, 24), size=12.0))
water = [tear.surface(t, frame) for tear, t in zip(tears, (2.4, 3.2, 0.92), strict=True)]

# %%
front = Style((560, 560), View((0.25, 0.12, 1.0), None, (0, 0.15, 0), 3.8))
figure(side_by_side([picture(pig.mesh, pig, front), picture(frame, pig, front)]), ["before", "after"])
with TearScene(pig, Style((1124, 1000), View((0.55, 0.1, 1.0), None, (0.1, 0.15, 0.5), 3.3))) as scene:
    figure(scene.picture(frame, water))

# %%
# The same for one pattern and one stream of water is a filter of any mesh of PyVista. ``facewrinkle pattern`` and
# ``facewrinkle tear`` do it on the command line.
lined = skin.facewrinkle.pattern("forehead", center=(0, 98, 46), up=(0, 1, -0.6), size=(130, 64), depth=5.0)
stream = skin.facewrinkle.tear(start=(74, 16, 42), width=10.0)

# %%
# From the deepest furrow to the highest bulge it is as far as the depth says, and water is closed.
print(f"{skin.n_cells} -> {lined.n_cells} triangles; {np.ptp(lined['W']):.2f} mm")
assert abs(np.ptp(lined["W"]) - 5.0) < 0.3
assert all(drop.n_open_edges == 0 for drop in [*water, stream])
