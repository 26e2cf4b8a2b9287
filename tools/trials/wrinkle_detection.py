"""Wrinkles found in pictures by a small network that was trained on a data set, tried on people it has not seen.

    facewrinkle dataset --count 240 --workers 2 --out faces
    python -m tools.trials wrinkle-detection faces

The network has one hidden layer and sees a pixel and its surroundings: derivatives of the logarithm of the brightness
at a few scales, as a filter that enhances ridges does (Frangi et al., 1998). Nothing tells it where on the face it
looks. It shows that the labels can be learnt from and carry over to other people, not what the best method could reach.
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
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.stats import rankdata

from analysis.report import Plot, Report, Table, plot, publish
from facewrinkle.dataset.labels import PARTS

from .runner import OUTPUT

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Picture = tuple[int, Array, BoolArray, BoolArray]

SCALES = (1.0, 1.6, 2.5, 4.0)
"""Standard deviations of the filters, pixels."""

CONTEXT = 8.0
"""Standard deviation of the means of the filters around a pixel, pixels."""

TRIED = 4
"""One in so many people is kept for the test."""

HIDDEN, EPOCHS, BATCH, RATE = 32, 12, 2048, 3e-3
"""Hidden units, and how they are trained (Kingma and Ba, Adam, 2015)."""

PER_PICTURE = 3000
"""Pixels of each picture that are learnt from, and that are tried."""


def features(picture: Array) -> Array:
    """Return the features (h, w, f) of the pixels of a picture (h, w, 3) with values in [0, 1].

    Examples
    --------
    A dark line along the rows has the larger curvature across:

    >>> picture = np.full((40, 40, 3), 0.6)
    >>> picture[20] = 0.3
    >>> found = features(picture)
    >>> found.shape, bool(found[20, 20, 0] > 10 * abs(found[20, 20, 1]))
    ((40, 40, 25), True)
    """
    bright = np.log(0.05 + picture @ [0.299, 0.587, 0.114])
    found = []
    for scale in SCALES:
        yy, xx, xy = (
            scale**2 * gaussian_filter(bright, scale, order=order, mode="nearest") for order in ((2, 0), (0, 2), (1, 1))
        )
        mean, apart = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        slopes = [scale * gaussian_filter(bright, scale, order=order, mode="nearest") for order in ((1, 0), (0, 1))]
        across = mean + apart
        found += [across, mean - apart, np.hypot(*slopes), 0.5 * (yy - xx) / (apart + 1e-6)]
        found.append(gaussian_filter(np.maximum(across, 0.0), CONTEXT, mode="nearest"))
    wide = gaussian_filter(bright, CONTEXT, mode="nearest")
    red, green, blue = np.moveaxis(np.log(0.05 + picture), 2, 0)
    return np.stack([*found, bright - wide, wide, red - green, green - blue, gaussian_filter(bright, 2.0) - wide], 2)


def read(folder: Path) -> Iterator[Picture]:
    """Yield for each picture of a set the person, the picture, its pixels of bare skin, and those in furrows."""
    for archive in sorted(folder.glob("shard-*.tar")):
        with tarfile.open(archive) as tar:
            files: dict[str, bytes] = {}
            for member in tar:
                file = tar.extractfile(member)
                files[member.name.partition(".")[2]] = file.read() if file is not None else b""
                if {"png", "npz", "json"} <= files.keys():
                    yield _decoded(files)
                    files = {}


def _decoded(files: dict[str, bytes]) -> Picture:
    with Image.open(io.BytesIO(files["png"])) as image:
        picture = np.asarray(image, np.float64) / 255.0
    with np.load(io.BytesIO(files["npz"])) as labels:
        skin, furrow = labels["part"] == PARTS.index("skin"), labels["furrow"] > 0
    return json.loads(files["json"])["person"]["number"], picture, skin, furrow


class Network:
    """A network with one hidden layer that tells the logarithm of the odds of two classes.

    Parameters
    ----------
    samples : ndarray, shape (n, f)
    truth : ndarray of bool, shape (n,)
    seed : int

    Examples
    --------
    >>> samples = np.random.default_rng(0).normal(size=(40000, 2))
    >>> network = Network(samples, np.hypot(*samples.T) < 1.0)
    >>> bool(area_under_curve(network(samples), np.hypot(*samples.T) < 1.0) > 0.98)
    True
    """

    def __init__(self, samples: Array, truth: BoolArray, seed: int = 0) -> None:
        random = np.random.default_rng(seed)
        self._mean, self._spread = samples.mean(axis=0), samples.std(axis=0) + 1e-9
        inputs, targets = (samples - self._mean) / self._spread, truth.astype(np.float64)
        f = inputs.shape[1]
        self.weights: list[Array] = [
            random.normal(size=(f, HIDDEN)) * np.sqrt(2.0 / f), np.zeros(HIDDEN),
            random.normal(size=HIDDEN) / np.sqrt(HIDDEN), np.zeros(1),
        ]  # fmt: skip
        first, second, step = [np.zeros_like(w) for w in self.weights], [np.zeros_like(w) for w in self.weights], 0
        for epoch in range(EPOCHS):
            order = random.permutation(len(inputs))
            for start in range(0, len(order), BATCH):
                some, step = order[start : start + BATCH], step + 1
                rate = RATE * 0.5 * (1.0 + np.cos(np.pi * epoch / EPOCHS))
                for k, gradient in enumerate(self.gradients(inputs[some], targets[some])):
                    first[k] += 0.1 * (gradient - first[k])
                    second[k] += 0.001 * (gradient**2 - second[k])
                    mean, square = first[k] / (1.0 - 0.9**step), second[k] / (1.0 - 0.999**step)
                    self.weights[k] -= rate * mean / (np.sqrt(square) + 1e-8)

    def gradients(self, inputs: Array, targets: Array) -> list[Array]:
        w, b, v, c = self.weights
        hidden = np.maximum(inputs @ w + b, 0.0)
        off = (1.0 / (1.0 + np.exp(-(hidden @ v + c))) - targets) / len(inputs)
        back = off[:, None] * v * (hidden > 0.0)
        return [inputs.T @ back, back.sum(axis=0), hidden.T @ off, off.sum(keepdims=True)]

    def __call__(self, samples: Array) -> Array:
        """Return the logarithms of the odds (n,)."""
        w, b, v, c = self.weights
        return np.asarray(np.maximum((samples - self._mean) / self._spread @ w + b, 0.0) @ v + c)


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


def overlap(score: Array, truth: BoolArray, level: float) -> float:
    """Return the intersection of furrows found, which score above a level, and true ones, over their union."""
    found = score > level
    return float((found & truth).sum() / max((found | truth).sum(), 1))


def report(folder: Path) -> Report:
    """Train on some people of a set, and try it on the others."""
    random = np.random.default_rng(0)
    sets: dict[bool, list[tuple[Array, BoolArray]]] = {True: [], False: []}
    people: dict[bool, set[int]] = {True: set(), False: set()}
    shown: list[tuple[Array, BoolArray, BoolArray]] = []
    for person, picture, skin, furrow in read(folder):
        tried = person % TRIED == TRIED - 1
        pixels = np.flatnonzero(skin)
        pixels = random.choice(pixels, min(PER_PICTURE, len(pixels)), replace=False)
        all_features = features(picture).reshape(skin.size, -1)
        sets[tried].append((all_features[pixels], furrow.ravel()[pixels]))
        people[tried].add(person)
        if tried and (skin & furrow).mean() > 0.02:
            shown.append((picture, skin, furrow))
    (train, known), (test, truth) = (map(np.concatenate, zip(*sets[tried], strict=True)) for tried in (False, True))
    network = Network(train, known)
    rows: list[tuple[Any, ...]] = []
    ridges = [(f"ridge filter of {scale:g} pixels", 5 * k) for k, scale in enumerate(SCALES)]
    for name, before, after in [
        *((name, train[:, column], test[:, column]) for name, column in ridges),
        ("network", network(train), network(test)),
    ]:
        levels = np.quantile(before, np.linspace(0.5, 0.995, 60))
        level = max(levels, key=lambda each: overlap(before, known, each))  # chosen on the people of the training
        scores = area_under_curve(after, truth), average_precision(after, truth), overlap(after, truth, level)
        rows.append((name, *scores))
    columns = ("method", "area under ROC curve", "average precision", "intersection over union")
    share, best = float(truth.mean()), rows[-1]
    return Report(
        "wrinkle_detection",
        "Furrows found in pictures of people who were not in training",
        f"{len(sets[False])} pictures of {len(people[False])} people to learn from, {len(sets[True])} of "
        f"{len(people[True])} others to try it on; {share:.1%} of the pixels of bare skin are in furrows, which is the "
        "average precision of guessing.",
        f"The network reaches an average precision of {best[2]:.2f}; the best filter, "
        f"{max(row[2] for row in rows[:-1]):.2f}.",
        [Table("Scores per pixel of bare skin", columns, rows)],
        [_figure(network, shown)] if shown else [],
        {"train": len(sets[False]), "test": len(sets[True]), "share": share},
    )


def _figure(network: Network, shown: list[tuple[Array, BoolArray, BoolArray]]) -> Plot:
    chosen = shown[:: max(len(shown) // 4, 1)][:4]
    figure, axes = plot(3, len(chosen), (2.6 * len(chosen), 7.8))
    for k, (picture, skin, furrow) in enumerate(chosen):
        odds = network(features(picture).reshape(skin.size, -1)).reshape(skin.shape)
        found = np.where(skin, 1.0 / (1.0 + np.exp(-odds)), 0.0)
        for row, image in enumerate((picture, furrow & skin, found)):
            ax = axes[row * len(chosen) + k]
            ax.imshow(image, cmap="gray", vmin=0, vmax=1)
            ax.set_axis_off()
            ax.set_title(("picture", "label", "probability found")[row], fontsize=8)
    return Plot(
        "people", figure, "People who were not in training: the picture, the label, and what the network tells."
    )


def wrinkle_detection(folder: Path, /, *, out: Path = OUTPUT) -> None:
    """Train a small network to find furrows in the pictures of a data set, and try it on other people.

    Parameters
    ----------
    folder
        Of a set by facewrinkle dataset.
    out
        Folder for the table and the plot.
    """
    publish(report(folder), out)
