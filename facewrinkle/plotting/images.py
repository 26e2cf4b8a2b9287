"""Pictures as arrays of pixels: combining, showing and writing them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..array_types import Image
from ..checks import picture
from ..errors import ParameterError, check_whole, type_of
from ..files import output_file, written

LEVEL = 3
"""Compression of PNG files. At level 6 they are 4 % smaller and take twice as long; palettes get the best."""


def side_by_side(images: Sequence[Image], gap: int = 4) -> Image:
    """Return pictures of one height in a row.

    Examples
    --------
    >>> dark, light = np.zeros((20, 30, 3), np.uint8), np.full((20, 30, 3), 255, np.uint8)
    >>> side_by_side([dark, light]).shape, stacked([dark, light]).shape
    ((20, 64, 3), (44, 30, 3))
    """
    return _in_a_row(_pictures(images), gap)


def stacked(images: Sequence[Image], gap: int = 4) -> Image:
    """Return pictures of one width, one below the other.

    Examples
    --------
    >>> dark, light = np.zeros((20, 30, 3), np.uint8), np.full((20, 30, 3), 255, np.uint8)
    >>> both = stacked([dark, light], gap=10)
    >>> both.shape, both[::10, 0, 0].tolist()
    ((50, 30, 3), [0, 0, 255, 255, 255])
    """
    return _in_a_row([image.swapaxes(0, 1) for image in _pictures(images)], gap).swapaxes(0, 1)


def _pictures(images: Sequence[Image]) -> list[Image]:
    if not isinstance(images, list | tuple | np.ndarray) or not len(images):
        raise ParameterError(f"one picture at least is needed, in a list, received {type_of(images)}.")
    return [picture(image) for image in images]


def _in_a_row(images: list[Image], gap: int) -> Image:
    sizes = {image.shape[::2] for image in images}
    if len(sizes) > 1:
        raise ParameterError(
            "pictures in a row must have one height, in a column one width, and as many channels; received (size, "
            f"channels) of {sorted(sizes)}."
        )
    spacer = np.full((images[0].shape[0], check_whole("gap", gap, 0, 1e4), images[0].shape[2]), 255, np.uint8)
    return np.concatenate([part for image in images for part in (spacer, image)][1:], axis=1)


def figure(image: Image) -> Any:
    """Return a picture as a figure of Matplotlib, pixel by pixel, as notebooks and galleries show it.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> figure(np.zeros((30, 40, 3), np.uint8)).get_size_inches().tolist()
    [0.4, 0.3]
    """
    import matplotlib.pyplot as plt

    height, width = picture(image).shape[:2]
    shown = plt.figure(figsize=(width / 100, height / 100), dpi=100)
    axes = shown.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(image, aspect="auto", interpolation="nearest")
    axes.set_axis_off()
    return shown


def save_picture(image: Image, path: str | Path, colours: int | None = None) -> Path:
    """Write a picture as PNG. With a palette of `colours` (at most 256) it takes a third of the space.

    Raises
    ------
    OutputError
        For a file that does not end in .png or cannot be written.

    Examples
    --------
    A picture with a palette of 16 colours:

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = save_picture(np.full((60, 80, 3), 128, np.uint8), f"{folder}/grey.png", colours=16)
    ...     path.name, path.stat().st_size < 200
    ('grey.png', True)
    """
    from PIL import Image as Pillow

    path = output_file(path, (".png",))
    pixels = Pillow.fromarray(np.ascontiguousarray(picture(image)))
    if colours is not None:
        pixels = pixels.quantize(check_whole("colours", colours, 1, 256))
    with written(path) as whole:
        pixels.save(whole, format="PNG", optimize=colours is not None, compress_level=LEVEL)
    return path


def reduced(image: Image, factor: int) -> Image:
    """Return a picture reduced by a whole factor; each pixel is the mean of those that it replaces.

    Examples
    --------
    >>> reduced(np.array([[[0], [100]], [[100], [200]]], np.uint8)[..., [0, 0, 0]], 2).tolist()
    [[[100, 100, 100]]]
    """
    from PIL import Image as Pillow

    return np.array(Pillow.fromarray(image).reduce(factor))
