"""Pictures as a movie."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..errors import MissingPackageError, OutputError, ParameterError, check_range
from ..mesh.files import output_file, replaced

H264: dict[str, Any] = {
    "codec": "libx264",
    "quality": 8,
    "macro_block_size": 1,
    "ffmpeg_log_level": "error",
    "output_params": ["-preset", "veryfast"],
}
"""Settings of the encoder. At this quality its slower presets take 2.6 times as long, for files of the same size."""


def write_movie(images: Iterable[np.ndarray], path: str | Path, fps: float = 25.0) -> Path:
    """Write pictures one by one as an .mp4 (H.264) or an endless .gif.

    H.264 needs even sizes: the last row or column of an odd picture is written twice, and nothing is rescaled. A GIF
    counts in hundredths of a second, and holds equal pictures in a row as one that is shown longer.

    Parameters
    ----------
    images : iterable of (height, width, 3 or 4) uint8 arrays
        All of the same size. Transparency is dropped.
    path : path
        Ends in .mp4 or .gif. An existing file is replaced.
    fps : float
        Pictures per second, 1 to 100.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    MissingPackageError
        Without imageio and its ffmpeg (extra `export`).
    ParameterError
        If there are no pictures, or one has another shape or type.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     pictures = (np.full((8, 8, 3), 20 * i, np.uint8) for i in range(5))
    ...     write_movie(pictures, f"{folder}/grey.gif", fps=10).name
    'grey.gif'
    """
    with movie_writer(path, fps) as append:
        for image in images:
            append(image)
    return Path(os.path.expanduser(path))


@contextmanager
def movie_writer(path: str | Path, fps: float = 25.0) -> Iterator[Callable[[np.ndarray], None]]:
    """Yield a function that appends one picture to a movie; for the arguments see :func:`write_movie`.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder, movie_writer(f"{folder}/grey.gif") as append:
    ...     for i in range(5):
    ...         append(np.full((8, 8, 3), 20 * i, np.uint8))
    """
    path = output_file(path, (".mp4", ".gif"))
    fps = check_range("fps", fps, 1.0, 100.0)
    movie = path.suffix.lower() == ".mp4"
    imageio = _imageio(movie)
    settings: dict[str, Any] = {"fps": fps, **H264} if movie else {"duration": 1000.0 / fps, "loop": 0}
    writer: Any = None
    shapes: list[tuple[int, ...]] = []

    def append(image: np.ndarray) -> None:
        nonlocal writer
        image = _checked(image, shapes)
        if writer is None:  # opened with the first picture, so that an error before it leaves no file
            writer = imageio.get_writer(stack.enter_context(replaced(path)), mode="I", **settings)
            stack.callback(writer.close)
        writer.append_data(_even(image) if movie else image)

    try:
        with ExitStack() as stack:
            yield append
    except OSError as problem:
        raise OutputError(f"{str(path)!r} cannot be written: {problem}.") from None
    if writer is None:
        raise ParameterError("a movie needs at least one picture, received none.")


def _imageio(movie: bool) -> ModuleType:
    try:
        import imageio.v2 as imageio

        if movie:
            import imageio_ffmpeg  # noqa: F401
    except ImportError as missing:
        raise MissingPackageError(
            f"movies need the package {missing.name}, which is not installed. pip install 'facewrinkle[export]'"
        ) from None
    return imageio


def _checked(image: np.ndarray, shapes: list[tuple[int, ...]]) -> np.ndarray:
    """Return the picture without transparency; its shape is appended to `shapes`, and must be that of the first."""
    image = np.asarray(image)
    if image.ndim != 3 or image.shape[2] not in (3, 4) or image.dtype != np.uint8 or not image.size:
        raise ParameterError(
            f"pictures must be uint8 arrays (height, width, 3 or 4), received {image.dtype} of {image.shape}."
        )
    shapes.append(image.shape[:2])
    if shapes[-1] != shapes[0]:
        raise ParameterError(
            f"all pictures must have the size of the first, {shapes[0]}; picture {len(shapes) - 1} has {shapes[-1]}."
        )
    return image[..., :3]


def _even(image: np.ndarray) -> np.ndarray:
    """Return the picture with an even number of rows and columns; the last is repeated if need be."""
    height, width = image.shape[:2]
    return np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
