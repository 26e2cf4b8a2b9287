"""Pictures as arrays of pixels: reading them from a window, combining, showing and writing them, and textures.

A background with a gradient that OpenGL draws costs more than the face before it: it covers every pixel. So nothing is
drawn behind the face, and both are combined as the pixels are read.

VTK would sample a texture with mipmaps and anisotropic filters, up to eight samples of four texels for each pixel; in
software that costs more than everything else in a picture. The camera of a scene stands still, so that one level of
the mipmap serves all of its pictures: textures are reduced once to the resolution at which they are seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from PIL import Image as Pillow
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

from ..array_types import Array, Image, IntArray
from ..checks import picture
from ..errors import ParameterError, check_whole, type_of
from ..files import output_file, write_whole
from ..geometry import compiled, double_areas

ENCODED: dict[str, dict[str, Any]] = {
    ".png": {"format": "PNG", "compress_level": 3},  # at level 6, files are 4 % smaller and take twice as long
    **{ending: {"format": "JPEG", "quality": 92, "subsampling": 0} for ending in (".jpg", ".jpeg")},
}
"""How pictures are written, by the ending of the file. JPEG is a step of brightness off in the mean, hairs too."""


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


def figure(image: Image, titles: Sequence[str] = ()) -> Any:
    """Return a picture as a figure of Matplotlib, pixel by pixel, as notebooks and galleries show it.

    Parameters
    ----------
    image : ndarray, shape (height, width, 3 or 4)
    titles : sequence of str
        What is written below its columns, from left to right.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> figure(np.zeros((30, 40, 3), np.uint8)).get_size_inches().tolist()
    [0.4, 0.3]
    >>> [text.get_text() for text in figure(np.zeros((30, 400, 3), np.uint8), ["before", "after"]).texts]
    ['before', 'after']
    """
    import matplotlib.pyplot as plt

    height, width = picture(image).shape[:2]
    below = 26 if titles else 0  # pixels that titles take
    total = height + below
    shown = plt.figure(figsize=(width / 100, total / 100), dpi=100)
    axes = shown.add_axes((0.0, 1.0 - height / total, 1.0, height / total))
    axes.imshow(image, aspect="auto", interpolation="nearest")
    axes.set_axis_off()
    for column, title in enumerate(titles):
        shown.text((column + 0.5) / len(titles), 0.5 * below / total, title, ha="center", va="center", fontsize=11)
    return shown


def save_picture(image: Image, path: str | Path) -> Path:
    """Write a picture, as the ending of the file says: PNG to the pixel, or JPEG in a fifth of the space.

    Raises
    ------
    OutputError
        For a file that ends neither in .png nor in .jpg, or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_picture(np.full((60, 80, 3), 128, np.uint8), f"{folder}/gray.png").name
    'gray.png'
    """
    path = output_file(path, tuple(ENCODED))
    return write_whole(path, encoded(picture(image), path.suffix.lower()))


def encoded(image: Image, ending: str) -> bytes:
    """Return a picture as the content of a file.

    Examples
    --------
    >>> encoded(np.full((60, 80, 3), 128, np.uint8), ".png")[1:4]
    b'PNG'
    """
    stream = BytesIO()
    Pillow.fromarray(np.ascontiguousarray(image)).save(stream, **ENCODED[ending])
    return stream.getvalue()


def reduced(image: Image, factor: int) -> Image:
    """Return a picture reduced by a whole factor; each pixel is the mean of those that it replaces.

    Examples
    --------
    >>> reduced(np.array([[[0], [100]], [[100], [200]]], np.uint8)[..., [0, 0, 0]], 2).tolist()
    [[[100, 100, 100]]]
    """
    return np.array(Pillow.fromarray(image).reduce(factor))


def texture(image: Image, texels: float = 1.0) -> pv.Texture:
    """Return an image as a texture of a surface on which a pixel of the picture is `texels` texels wide.

    Examples
    --------
    >>> texture(np.zeros((512, 512, 3), np.uint8), texels=3.7).dimensions
    (128, 128)
    """
    levels = max(int(np.rint(np.log2(max(texels, 1.0)))), 0)
    factor = min(2**levels, *image.shape[:2])
    seen = pv.Texture(np.array(image) if factor == 1 else reduced(np.ascontiguousarray(image), factor))
    seen.interpolate = True
    seen.SetMaximumAnisotropicFiltering(1.0)
    return seen


def texels_per_pixel(mesh: pv.PolyData, corners: Array, image: Image, pixel: float) -> float:
    """Return how many texels lie side by side on a pixel, where the surface faces the camera: the median over its area.

    Parameters
    ----------
    mesh : PolyData
    corners : ndarray, shape (m, 3, 2)
        Texture coordinates of the corners of its triangles.
    image : ndarray, shape (height, width, 3 or 4)
    pixel : float
        Width of a pixel, in the unit of the mesh.

    Examples
    --------
    >>> sheet = pv.Plane().triangulate()
    >>> corners = np.asarray(sheet.active_texture_coordinates)[sheet.regular_faces]
    >>> round(texels_per_pixel(sheet, corners, np.zeros((200, 200, 3)), pixel=0.01), 3)
    2.0
    """
    area = double_areas(np.asarray(mesh.points), np.asarray(mesh.regular_faces))
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    covered = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * image.shape[0] * image.shape[1]
    if not area.any():
        return 1.0
    side = np.sqrt(covered / np.maximum(area, 1e-300)) * pixel
    order = np.argsort(side)
    share = np.cumsum(area[order])
    return float(side[order][np.searchsorted(share, 0.5 * share[-1])])


# --- windows --------------------------------------------------------------------------------


def rendered(plotter: pv.Plotter, factor: int = 1) -> Image:
    """Render what a plotter shows, and return the picture, reduced by a factor (1 or 2) to means of pixels.

    The window must be a whole multiple of the factor wide and high. What is left in it has no background.

    Examples
    --------
    >>> plotter = pv.Plotter(off_screen=True, window_size=(60, 40))
    >>> plotter.set_background((0, 0, 0), top=(0, 100, 200))
    >>> rendered(plotter, 2)[[0, 19], 0].tolist()
    [[0, 98, 195], [0, 3, 5]]
    >>> plotter.close()
    """
    return begun(plotter, factor)()


def begun(plotter: pv.Plotter, factor: int = 1) -> Callable[[], Image]:
    """Begin to render what a plotter shows, and return a function that waits for the picture and returns it.

    The graphics card draws meanwhile, or Mesa's own threads do. Until the picture was taken, the plotter must not
    render anything else. For the arguments see :func:`rendered`.
    """
    renderer, window = plotter.renderer, window_of(plotter)
    bottom, gradient = renderer.GetBackground(), renderer.GetGradientBackground()
    top = renderer.GetBackground2() if gradient else bottom
    alpha, swaps = renderer.GetBackgroundAlpha(), window.GetSwapBuffers()
    renderer.GradientBackgroundOff()
    renderer.SetBackground(0.0, 0.0, 0.0)
    renderer.SetBackgroundAlpha(0.0)
    window.SetSwapBuffers(False)  # nobody looks at the window: its pixels are read before they would go there
    try:
        window.SetAlphaBitPlanes(1)
        window.Render()
        window.ReleaseCurrent()  # sends what OpenGL has only noted down so far
    finally:
        renderer.SetBackground(bottom)
        renderer.SetBackgroundAlpha(alpha)
        renderer.SetGradientBackground(gradient)
        window.SetSwapBuffers(swaps)
    return lambda: composed(_pixels(plotter), bottom, top, factor)


def window_of(plotter: pv.Plotter) -> Any:
    """Return the window of a plotter, which renders at once: a plotter does not before its first screenshot.

    Examples
    --------
    >>> plotter = pv.Plotter(off_screen=True, window_size=(60, 40))
    >>> window_of(plotter).GetSize()
    (60, 40)
    >>> plotter.close()
    """
    window = plotter.render_window
    if window is None:
        raise RuntimeError("this plotter has been closed, and shows nothing.")
    return window


def _pixels(plotter: pv.Plotter) -> Image:
    """Red, green, blue and opacity (h, w, 4) of what was rendered last, bottom row first."""
    window = window_of(plotter)
    width, height = window.GetSize()
    data = vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, data, 0)
    return np.asarray(vtk_to_numpy(data)).reshape(height, width, 4)


def composed(
    pixels: Image, bottom: tuple[float, float, float], top: tuple[float, float, float], factor: int = 1
) -> Image:
    """Return premultiplied pixels (f h, f w, 4), bottom row first, reduced and over a gradient: (h, w, 3).

    Examples
    --------
    White that covers half of red:

    >>> veil = np.full((2, 2, 4), 127, np.uint8)
    >>> composed(veil, bottom=(1.0, 0.0, 0.0), top=(1.0, 0.0, 0.0), factor=2).tolist()
    [[[255, 127, 127]]]
    """
    height, width = (side // factor for side in pixels.shape[:2])
    up = 1.0 - (np.arange(height) + 0.5)[:, None] / height
    background = np.rint(65536.0 * np.clip(np.add((1.0 - up) * bottom, up * top), 0.0, 1.0)).astype(np.int64)
    out = np.empty((height, width, 3), np.uint8)
    _compose(pixels, factor, background, out)
    return out


@compiled
def _compose(pixels: Image, factor: int, background: IntArray, out: Image) -> None:
    """Write pixels over a background (h, 3) of one color a row, 65536 for 255, to `out` (h, w, 3), top row first."""
    height, width = out.shape[:2]
    count = factor * factor
    for y in range(height):
        for x in range(width):
            red, green, blue, clear = 0, 0, 0, 255 * count
            for row in range(factor * (height - 1 - y), factor * (height - y)):
                for column in range(factor * x, factor * (x + 1)):
                    red += pixels[row, column, 0]
                    green += pixels[row, column, 1]
                    blue += pixels[row, column, 2]
                    clear -= pixels[row, column, 3]
            out[y, x, 0] = (red + (clear * background[y, 0] >> 16) + count // 2) // count
            out[y, x, 1] = (green + (clear * background[y, 1] >> 16) + count // 2) // count
            out[y, x, 2] = (blue + (clear * background[y, 2] >> 16) + count // 2) // count
