"""The data card: a README of a set with its specification, the licences of its faces, and what is in it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from .. import __version__
from ..files import write_whole
from .labels import DEPTH_STEP, HEIGHT_STEP, PARTS, PLACE_STEP, REGIONS
from .shards import read_table
from .spec import Spec, code_digest

BIASES = """\
- All people with the built-in head have its topology, and cropped or shaved hair; they differ in shape, age and
  colours. Nobody wears a beard, make-up, glasses, jewellery, a hat or clothes: heads end in bare necks.
- The ranges are those of the specification, not of any population: ages and complexions are even, not as in a country.
- Pictures are rasterised: nothing casts a shadow, and no light scatters under the skin. Nothing stands in front of a
  face, no hand and no strand of hair; cameras have no noise, blur or distortion.
- Heads do not turn on their necks; the camera moves around them. Backgrounds are plain gradients.
- What is meant for photographs should be trained with more than these draws: other backgrounds behind `part` 0, things
  in front of faces, noise and blur (domain randomisation), or with photographs beside them.
- Wrinkles follow a model of compressed skin. They are plausible, not measured on these people.
"""


def write_card(folder: Path, spec: Spec, count: int) -> None:
    """Write README.md."""
    table = read_table(folder, ("index", "attempt"))
    made = len(set(table["index"]))
    redrawn = float(np.mean(np.array(table["attempt"], bool))) if made else 0.0
    write_whole(folder / "README.md", _text(spec, count, made, redrawn))


def _text(spec: Spec, count: int, made: int, redrawn: float) -> str:
    scans = "".join(f"- {Path(scan.path).name}: {scan.licence}\n" for scan in spec.faces.scans)
    parts = ", ".join(f"{number} {name}" for number, name in enumerate(PARTS))
    faces = spec.written["faces"]
    named = [entry | {"path": Path(entry["path"]).name} for entry in faces["scans"]]
    specification = json.dumps(spec.written | {"faces": {**faces, "scans": named}}, indent=1)
    regions = ", ".join(f"{number} {name}" for number, name in enumerate(REGIONS))
    pictures = "a picture each" if spec.clip.frames == 1 else f"clips of {spec.clip.frames} pictures"
    return f"""\
---
task_categories: [image-segmentation, depth-estimation, keypoint-detection]
tags: [synthetic, faces, wrinkles, webdataset]
---

# Faces with labelled wrinkles

{made} of {count} samples, {pictures} of {spec.size[0]} x {spec.size[1]} pixels, made by
facewrinkle {__version__}, code {code_digest()}; {count - made} could not be made. {redrawn:.1%} were drawn again
because the face was not in the picture, showed the inside of its skin, or did not come to rest.

## Files

`shard-NNNNNN.tar` are WebDataset shards of {spec.shard} samples; `index/` has Parquet tables with a row for each
picture. `sha256sum -c shard-*.sha256` checks both. Pictures of a clip have keys with the number of the sample and of
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
  or `mesh.glb`: skin, eyes, mouth and tears with their colours, for other programs;
- `json`: landmarks in 3D and in pixels with their visibility, contractions of all muscles, weights of action units
  (FACS; in a clip those of this picture), identity, camera matrices (OpenCV's convention), lamps, background, furrows.

A sample depends on the specification and its number alone. `facewrinkle dataset check` compares all files with
their sums, and makes some samples again.

## Faces and licences

- The built-in head and people made from it: MIT, as the package.
{scans}
## Known biases and limits

{BIASES}
## Specification

```json
{specification}
```
"""
