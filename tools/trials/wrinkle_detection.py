"""Wrinkles found in pictures by a network that was trained on a data set, tried on people that it has not seen.

    facewrinkle dataset --count 5000 --workers 2 --out faces
    python -m tools.trials wrinkle-detection faces --photographs folder

The people of the set that are kept for the trial, and photographs on which lines were marked by eye, are compared
with the best of the filters that enhance ridges (Frangi et al., MICCAI 1998). Needs PyTorch, and a GPU for more than a
few hundred pictures.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw
from scipy.ndimage import binary_dilation, gaussian_filter
from scipy.stats import rankdata

from analysis.report import Plot, Report, Table, plot, publish
from facewrinkle.dataset.labels import PARTS
from facewrinkle.export import output_folder
from facewrinkle.progress import bar

from .runner import OUTPUT

MARKS = Path(__file__).with_name("photographs.json")
"""Lines marked by eye on photographs by the government of the United States (public domain), which are test data of
the packages face_recognition 1.3.0 (its source) and scikit-image on PyPI."""

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]

SCALES = (1.0, 1.6, 2.5, 4.0)
"""Standard deviations of the ridge filters, pixels."""

BACKGROUND, OTHER, SKIN, FURROW = range(4)
"""What a pixel shows."""

TRIED, MOST = 10, 200
"""One in so many people is kept for the trial, and so many of their pictures at most."""

PUPILS, SIZE, EYES = 96.0, 384, 165.0
"""Distance between the pupils, side, and row of the eyes of a photograph when it is looked at, pixels."""

MARKED = 2
"""Half the width of a line that was marked by eye, pixels: so exact are the marks."""


def sample(files: dict[str, bytes]) -> tuple[int, Bytes, Bytes]:
    """Return the person, the picture (h, w, 3), and what each pixel shows (h, w), of a sample's files by ending."""
    with Image.open(io.BytesIO(files["png"])) as image:
        picture = np.asarray(image.convert("RGB"))
    with np.load(io.BytesIO(files["npz"])) as labels:
        part, furrow = labels["part"], labels["furrow"] > 0
    skin = part == PARTS.index("skin")
    kinds = np.select([skin & furrow, skin, part != PARTS.index("background")], [FURROW, SKIN, OTHER], BACKGROUND)
    return json.loads(files["json"])["person"]["number"], picture, kinds.astype(np.uint8)


def read(folder: Path) -> Iterator[tuple[int, Bytes, Bytes]]:
    """Yield the samples of a set, as `sample` returns them."""
    for archive in sorted(folder.glob("shard-*.tar")):
        with tarfile.open(archive) as tar:
            files: dict[str, bytes] = {}
            for member in tar:
                file = tar.extractfile(member)
                files[member.name.partition(".")[2]] = file.read() if file is not None else b""
                if {"png", "npz", "json"} <= files.keys():
                    yield sample(files)
                    files = {}


def photograph(folder: Path, entry: dict[str, Any]) -> tuple[Bytes, Bytes]:
    """Return a photograph (SIZE, SIZE, 3) with level eyes, PUPILS apart, and what its pixels show.

    Parameters
    ----------
    folder : Path
        Of the photographs.
    entry : dict
        Of photographs.json: places of the pupils in the file, and, in the pixels of what is returned, the outline of
        the skin, those of what is not skin within it, and the lines.
    """
    with Image.open(folder / entry["file"]) as file:
        image = file.convert("RGB")
    left, right = np.array(entry["pupils"], np.float64)
    scale = np.hypot(*(right - left)) / PUPILS
    if scale > 1.0:  # fewer pixels first, as the transform takes the nearest four only
        image = image.resize((round(image.width / scale), round(image.height / scale)), Image.Resampling.LANCZOS)
        left, right = left / scale, right / scale
    along = (right - left) / PUPILS
    across = np.array([-along[1], along[0]])
    corner = 0.5 * (left + right) - 0.5 * SIZE * along - EYES * across
    rows = (along[0], across[0], corner[0], along[1], across[1], corner[1])
    image = image.transform((SIZE, SIZE), Image.Transform.AFFINE, rows, Image.Resampling.BICUBIC)
    drawn = Image.new("L", (SIZE, SIZE), OTHER)
    draw = ImageDraw.Draw(drawn)
    draw.polygon([tuple(point) for point in entry["skin"]], fill=SKIN)
    for outline in entry["not_skin"]:
        draw.polygon([tuple(point) for point in outline], fill=OTHER)
    lines = Image.new("1", (SIZE, SIZE))
    for line in entry["lines"]:
        ImageDraw.Draw(lines).line([tuple(point) for point in line], fill=1)
    yy, xx = np.mgrid[-MARKED : MARKED + 1, -MARKED : MARKED + 1]
    wide = binary_dilation(np.asarray(lines), xx**2 + yy**2 <= MARKED**2)
    kinds = np.asarray(drawn).copy()
    kinds[wide & (kinds == SKIN)] = FURROW
    return np.asarray(image), kinds


def ridges(picture: Bytes) -> list[Array]:
    """Return for each of the scales how strongly a dark line runs through each pixel (h, w).

    Examples
    --------
    >>> picture = np.full((40, 40, 3), 150, np.uint8)
    >>> picture[20] = 80
    >>> [bool(found[20, 20] > 10 * abs(found[10, 20])) for found in ridges(picture)]
    [True, True, True, True]
    """
    bright = np.log(0.05 + picture / 255.0 @ [0.299, 0.587, 0.114])
    found = []
    for scale in SCALES:
        yy, xx, xy = (
            scale**2 * gaussian_filter(bright, scale, order=order, mode="nearest") for order in ((2, 0), (0, 2), (1, 1))
        )
        found.append(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy))
    return found


def area_under_curve(score: Array, truth: BoolArray) -> float:
    """Return how likely a pixel in a furrow has a higher score than one outside (area under the ROC curve).

    Examples
    --------
    >>> area_under_curve(np.array([0.1, 0.4, 0.35, 0.8]), np.array([False, False, True, True]))
    0.75
    """
    ranks, inside = rankdata(score), int(truth.sum())
    return float((ranks[truth].sum() - inside * (inside + 1) / 2) / (inside * (len(truth) - inside)))


def average_precision(score: Array, truth: BoolArray) -> float:
    """Return the mean, over the pixels in furrows, of the share of furrows among all that score as high.

    Examples
    --------
    >>> average_precision(np.array([0.9, 0.8, 0.7]), np.array([True, False, True])).__round__(3)
    0.833
    """
    right = truth[np.argsort(-score, kind="stable")]
    return float((np.cumsum(right) / np.arange(1, len(right) + 1))[right].mean())


Tried = list[tuple[str, Bytes, Bytes, Array]]
"""Names, pictures, what their pixels show, and what the network finds there."""


def scores(tried: Tried, least: int) -> list[tuple[str, float, float, float]]:
    """Return for the network, and for each ridge filter, its name, the share of furrows, the area under the ROC curve,
    and the average precision, over the pixels that show at least SKIN, or BACKGROUND, which is all."""
    methods: dict[str, list[Array]] = {}
    truths = []
    for _, picture, kinds, found in tried:
        looked = kinds >= least
        truths.append((kinds == FURROW)[looked])
        methods.setdefault("network", []).append(found[looked])
        for scale, ridge in zip(SCALES, ridges(picture), strict=True):
            methods.setdefault(f"ridge filter of {scale:g} pixels", []).append(ridge[looked])
    truth = np.concatenate(truths)
    joined = {name: np.concatenate(parts) for name, parts in methods.items()}
    return [
        (name, float(truth.mean()), area_under_curve(score, truth), average_precision(score, truth))
        for name, score in joined.items()
    ]


def report(folder: Path, photographs: Path | None, network: Path | None, steps: int, out: Path) -> Report:
    """Train on some people of a set, unless a network is there, and try it on the others, and on photographs."""
    from . import unet  # PyTorch takes seconds to load, and is not there for other trials

    learnt: tuple[list[Bytes], list[Bytes]] = ([], [])
    kept: list[tuple[str, Bytes, Bytes]] = []
    people: tuple[set[int], set[int]] = (set(), set())
    for person, picture, kinds in read(folder):
        tried = person % TRIED == TRIED - 1
        people[tried].add(person)
        if tried and len(kept) < MOST:
            kept.append((f"person {person}", picture, kinds))
        elif not tried and network is None:
            learnt[0].append(picture)
            learnt[1].append(kinds)
    if network is None:
        kinds = np.stack(learnt[1])
        found = unet.train(np.stack(learnt[0]), kinds == FURROW, kinds == BACKGROUND, steps)
        output_folder(out)
        unet.save(found, out / "unet.pt")
    else:
        found = unet.load(network)
    tried_on = {"people of the set": kept}
    if photographs is not None:
        entries = json.loads(MARKS.read_text())
        tried_on["photographs"] = [(entry["file"], *photograph(photographs, entry)) for entry in entries]
    tables, plots, told = [], [], []
    for name, pictures in tried_on.items():
        results = [(*shown, unet.probabilities(found, shown[1])) for shown in bar(pictures, name, len(pictures))]
        for where, least in (("bare skin", SKIN), ("the whole picture", BACKGROUND)):
            rows = scores(results, least)
            title = f"Scores per pixel of {where}, {len(results)} {name}"
            tables.append(
                Table(title, ("method", "share of furrows", "area under ROC curve", "average precision"), rows)
            )
            best = max(row[3] for row in rows[1:])
            told.append(
                f"In {where} of {len(results)} {name}, the network reaches an average precision of {rows[0][3]:.2f}, "
                f"the best filter {best:.2f}, and guessing {rows[0][1]:.2f}."
            )
        plots.append(_figure(name, results))
    return Report(
        "wrinkle_detection",
        "Furrows found in pictures of people who were not in training",
        f"Learnt from {len(people[False])} people of the set, tried on {len(people[True])} others.",
        " ".join(told),
        tables,
        plots,
        {table.title: dict(zip(table.columns[1:], table.rows[0][1:], strict=True)) for table in tables},
    )


def _figure(name: str, results: Tried) -> Plot:
    lined = [result for result in results if (result[2] == FURROW).mean() > 0.005] or results
    chosen = lined[:: max(len(lined) // 5, 1)][:5]
    figure, axes = plot(3, len(chosen), (2.6 * len(chosen), 7.8))
    for k, (_, picture, kinds, found) in enumerate(chosen):
        for row, image in enumerate((picture, kinds == FURROW, np.where(kinds >= SKIN, found, 0.0))):
            ax = axes[row * len(chosen) + k]
            ax.imshow(image, cmap="gray", vmin=0, vmax=1)
            ax.set_axis_off()
            ax.set_title(("picture", "marked", "probability found")[row], fontsize=8)
    return Plot(name.replace(" ", "_"), figure, f"Some {name}: picture, furrows as marked, and what the network tells.")


def wrinkle_detection(
    folder: Path,
    /,
    *,
    photographs: Path | None = None,
    network: Path | None = None,
    steps: int = 3400,
    out: Path = OUTPUT,
) -> None:
    """Train a network to find furrows in the pictures of a data set, and try it on other people.

    Parameters
    ----------
    folder
        Of a set by facewrinkle dataset.
    photographs
        Folder of the photographs that photographs.json names, on which lines were marked by eye.
    network
        A file unet.pt of an earlier run, to be tried only.
    steps
        Batches of 32 pictures to learn from.
    out
        Folder for the tables, the plots and the network.
    """
    publish(report(folder, photographs, network, steps, out), out)
