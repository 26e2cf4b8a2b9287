"""
.. _dataset_labels:

Labels of a data set
====================

``facewrinkle dataset`` makes such samples by the hundred thousand (:ref:`howto_dataset`). Each is made from the
specification and its number alone: the same bytes on any computer of a cluster, in any order.
"""

import numpy as np

from facewrinkle.dataset import SampleMaker, Spec
from facewrinkle.plotting import figure, side_by_side, stacked

# %%
# What a specification leaves out is as in the default one. Here people who are not young smile or raise their brows.

spec = Spec.of(
    {
        "seed": 9,
        "size": [260, 300],
        "per_person": 1,
        "identity": {"age": {"uniform": [0.5, 1.0]}},
        "camera": {"yaw": {"uniform": [-30.0, 30.0]}, "pitch": 0.0, "height": 3.6},
        "lights": {"fill": 1.6},
        "expression": {"neutral": 0.0, "named": 1.0, "names": ["happiness", "surprise"], "intensity": 1.0},
    }
)
with SampleMaker(spec) as maker:
    samples = [maker.sample(index) for index in (0, 1)]

# %%
# The labels of a pixel are worked out where its line of sight meets the skin: nothing is drawn by hand, and nothing is
# smoothed. From the left: the picture, parts, regions of the skin, furrows one by one, heights of the wrinkles (dark
# below the smooth skin), and normals.

colors = np.random.default_rng(8).integers(60, 256, (256, 3)).astype(np.uint8)
colors[0] = 0


def shown(sample):
    """The labels of a sample as pictures."""
    labels = sample.labels
    height = np.clip(128.0 + 0.15 * labels["height"], 0, 255).astype(np.uint8)
    skin = labels["depth"] > 0
    return [
        sample.image,
        *(colors[labels[name]] for name in ("part", "region", "furrow")),
        np.repeat(np.where(skin, height, 0)[..., None], 3, axis=2),
        np.where(skin[..., None], 128 + labels["normal"].astype(np.int16), 0).astype(np.uint8),
    ]


titles = ["picture", "parts", "regions", "furrows", "heights", "normals"]
figure(stacked([side_by_side(shown(sample)) for sample in samples]), titles)

# %%
# Furrows have the muscle or the family of lines that makes them.

for sample in samples:
    deepest = sample.facts["furrows"][:3]
    told = ", ".join(f"{one['depth']:.1f} mm deep and {one['length']:.0f} mm long ({one['source']})" for one in deepest)
    print(f"{sample.facts['plan']['expression']}: {told}")

# %%
# All labels are about the same points: furrows are low, and they lie on skin.

for sample in samples:
    furrow = sample.labels["furrow"] > 0
    assert (sample.labels["height"][furrow] < 0).all()
    assert (sample.labels["depth"][furrow] > 0).all()
    assert (sample.labels["region"][furrow] > 0).all()
