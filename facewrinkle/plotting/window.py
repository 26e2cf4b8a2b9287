"""The contents of a window as a picture: read with its opacity, laid over the background, and reduced.

A background with a gradient that OpenGL draws costs more than the face before it: it covers every pixel. So nothing is
drawn behind the face, and both are combined as the pixels are read.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

from ..array_types import Image, IntArray
from ..geometry.compilation import compiled


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
    """Write pixels over a background (h, 3) of one colour a row, 65536 for 255, to `out` (h, w, 3), top row first."""
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
