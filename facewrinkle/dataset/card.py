"""The data card: a README of a set with its specification, the licences of its faces, and what is in it."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..array_types import Array
from ..files import write_whole
from ..plotting.images import save_picture, side_by_side
from .labels import DEPTH_STEP, HEIGHT_STEP, PARTS, PLACE_STEP, REGIONS
from .shards import Sums, mean_and_deviation, read_table, sums_in
from .spec import Spec, code_digest

MEAN = "mean.png"
"""Name of the picture that shows the mean of all pictures and the deviation from it."""

IDENTITY = tuple(f"identity_{name}" for name in ("sex", "age", "child", "iris", "hair_length"))
"""Columns of the tables about people that the card counts."""


def write_card(folder: Path, spec: Spec, count: int) -> None:
    """Write README.md, and the mean picture that it shows."""
    table = read_table(folder, ("index", "attempt", "person", "scan", "monk", "expression", "tears", *IDENTITY))
    sums = sums_in(folder)
    if sums:
        means = mean_and_deviation(sums["pictures"], sums["small"], sums["small_squares"])
        save_picture(side_by_side([np.rint(values).astype(np.uint8) for values in means]), folder / MEAN)
    write_whole(folder / "README.md", _text(spec, count, table, sums))


def contents_of(table: dict[str, list[Any]], sums: Sums) -> str:
    """Return what a set contains, as Markdown: shares of its pictures, and means over their pixels."""
    drawn = table["expression"]
    kinds = Counter(map(_kind, drawn))
    groups = {
        "Expressions": {name: number / len(drawn) for name, number in kinds.most_common()},
        "Tears": {"crying": np.mean(table["tears"])},
    }
    own = [k for k, scan in enumerate(table["scan"]) if not scan]
    if own:
        monk, sex, age, child, iris, length = (np.array([table[name][k] for k in own]) for name in ("monk", *IDENTITY))
        adult = child <= 0.0
        groups |= {
            "Sex": {"feminine (`sex` below 0)": np.mean(sex < 0.0), "masculine": np.mean(sex >= 0.0)},
            "Age": {
                "children (`child` above 0)": np.mean(~adult),
                "young (`age` below 0)": np.mean(adult & (age < 0.0)),
                "middle-aged": np.mean(adult & (age >= 0.0) & (age < 0.5)),
                "old (`age` from 0.5)": np.mean(adult & (age >= 0.5)),
            },
            "Skin, by the Monk Skin Tone Scale (`monk`)": {f"{tone}:": np.mean(monk == tone) for tone in range(1, 11)},
            "Hair": {"shaved or cropped": np.mean(length <= 0.0), "longer": np.mean(length > 0.0)},
            "Irises": {
                "blue (`iris` below -0.3)": np.mean(iris < -0.3),
                "gray to hazel": np.mean((iris >= -0.3) & (iris < 0.3)),
                "brown (from 0.3)": np.mean(iris >= 0.3),
            },
        }
    pixels = sums["pixels"].astype(float)
    groups["Pixels"] = dict(zip(PARTS, pixels / pixels.sum(), strict=True))
    lines = [f"- {len(set(table['person']))} persons. Shares are those of pictures; of people, with the built-in head."]
    lines += [
        f"- {title}: {', '.join(f'{name} {share:.1%}' for name, share in shares.items())}."
        for title, shares in groups.items()
    ]
    mean, deviation = mean_and_deviation(pixels.sum(), sums["colors"], sums["squares"])
    lines.append(
        f"- Red, green and blue, from 0 to 255: mean {_numbers(mean)}, standard deviation {_numbers(deviation)} "
        "over all pixels."
    )
    return "\n".join(lines)


def _kind(expression: str) -> str:
    """What the card calls an expression: its name, action units, or neutral."""
    first = expression.split("=")[0]
    return "neutral" if not first else "action units" if first.startswith("AU") else first


def _numbers(values: Array) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


def _text(spec: Spec, count: int, table: dict[str, list[Any]], sums: Sums) -> str:
    made = len(set(table["index"]))
    redrawn = float(np.mean(np.array(table["attempt"], bool))) if made else 0.0
    contents = contents_of(table, sums) if made else "Nothing."
    scans = "".join(f"- {Path(scan.path).name}: {scan.licence}\n" for scan in spec.faces.scans)
    parts = ", ".join(f"{number} {name}" for number, name in enumerate(PARTS))
    faces = spec.written["faces"]
    named = [entry | {"path": Path(entry["path"]).name} for entry in faces["scans"]]
    shown = spec.written | {"faces": {**faces, "scans": named}}
    for name, key in (("background", "pictures"), ("lights", "environment")):
        shown[name] = shown[name] | {key: Path(shown[name][key]).name}
    specification = json.dumps(shown, indent=1)
    regions = ", ".join(f"{number} {name}" for number, name in enumerate(REGIONS))
    pictures = "a picture each" if spec.clip.frames == 1 else f"clips of {spec.clip.frames} pictures"
    return f"""\
---
configs:
- config_name: default
  data_files: shard-*.tar
task_categories: [image-segmentation, depth-estimation, keypoint-detection]
tags: [synthetic, faces, wrinkles, webdataset]
---

# Faces with labeled wrinkles

{made} of {count} samples, {pictures} of {spec.size[0]} x {spec.size[1]} pixels, made by
facewrinkle {__version__}, code {code_digest()}; {count - made} could not be made. {redrawn:.1%} were drawn again
because the face was not in the picture, showed the inside of its skin, or did not come to rest.

## Files

`shard-NNNNNN.tar` are WebDataset shards of {spec.shard} samples; `index/` has Parquet tables with a row for each
picture; `statistics/` has sums over pixels, which add up: of parts, colors and their squares.
`sha256sum -c shard-*.sha256` checks all. Pictures of a clip have keys with the number of the sample and of
the frame. The persons of a shard take turns. A picture has

- `png`: the picture, 8 bits of red, green and blue;
- `npz`: arrays of its pixels, without anti-aliasing:
  - `part` (uint8): {parts}.
    The others are about the skin, also where brows, lashes and tears cover it;
  - `depth` (uint16): distance along the camera's axis, in {DEPTH_STEP} mm; 0 for no skin;
  - `normal` (int8 x 3): 127 times the normal; x to the right, y down, z away from the camera;
  - `height` (int16): height of wrinkles above the smooth skin, in {HEIGHT_STEP} mm; furrows are negative;
  - `furrow` (uint8): number of the furrow, 0 for none; `furrows` in the JSON tells the muscle or family of each;
  - `place` (int16 x 3): where the same point of the skin is on the face at rest, in {PLACE_STEP} mm; -32768 for none;
  - `region` (uint8) of the skin, by the nearest of points that landmarks span, with plain borders between:
    {regions};
- `mesh.npz`, if asked for: `points` of the skin and where they are at `rest`, in the unit of the face, and `triangles`;
  or `mesh.glb`: skin, eyes, mouth and tears with their colors, for other programs;
- `json`: landmarks in 3D and in pixels with their visibility, contractions of all muscles, weights of action units
  (FACS; in a clip those of this picture), identity, tone of the skin (`monk`), camera matrices (OpenCV's convention),
  lamps, background, names of the scan, the picture and the environment of one's own (`files`), and `furrows`, of which
  the first stands for the label 0, none. All have the same names and types in every picture: what one does not have is
  0 or "" (the identity of a scan), or -1 (seconds of tears, pixels of landmarks).

A sample depends on the specification and its number alone. `facewrinkle dataset check` compares all files with
their sums, and makes some samples again.

## Faces and licences

- The built-in head and people made from it: MIT, as the package.
{scans}
## What it contains

{contents}

![The mean of all pictures, and the standard deviation of each pixel from it]({MEAN})

## Known biases and limits

- Drawn at random, each by itself: shape, age, colors and skin tone of a person, expression, gaze, tears, fine lines,
  camera, lamps and background. Only hair and irises are never fairer than the skin, and children look young.
- All people with the built-in head have its topology. Hair is shaved, cropped, falls from a parting to the neck at
  most, or is tied back. Missing are other haircuts, long beards, make-up, glasses, jewellery, hats and clothes: necks
  are bare.
- The ranges are those of the specification, not of any population: ages and skin tones are even, not as in a country.
- Skin tones are those of the paint; the light of a picture makes them fairer or darker, as it does in photographs.
- Pictures are rasterized: skin and long hair cast shadows of the key light alone, and no light scatters under the
  skin. No hand and no strand of hair is in front of a face; cameras have no noise, blur or distortion.
- Heads do not turn on their necks; the camera moves around them. Backgrounds are plain gradients unless the
  specification names pictures, which do not light the face, or environment maps, which light it as three lamps do.
- What is meant for photographs should be trained with more than these draws: other backgrounds behind `part` 0, things
  in front of faces, noise and blur (domain randomization), or with photographs beside them.
- Wrinkles follow a model of compressed skin. They are plausible, not measured on these people.
- A U-Net that learnt from 4,500 such pictures, much varied, was tried on five photographs: in whole pictures its
  average precision was 0.27 (0.03 for the best ridge filter), on skin outlined by hand 0.33 (0.38 for the filter).

## Specification

```json
{specification}
```
"""
