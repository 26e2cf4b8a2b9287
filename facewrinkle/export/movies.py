"""Pictures as a movie."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..checks import picture
from ..errors import ParameterError, check_range, optional_imports
from ..files import not_written, output_file, path_of, replaced


def write_movie(images: Iterable[np.ndarray], path: str | Path, *, fps: float = 25.0) -> Path:
    """Write pictures one by one as an .mp4 (H.264) or an endless .gif.

    H.264 needs even sizes: the last row or column of an odd picture is written twice, and nothing is rescaled. A GIF
    counts in hundredths of a second: each picture begins at the nearest one. It holds equal pictures in a row as one
    that is shown longer.

    Parameters
    ----------
    images : iterable of (height, width, 3 or 4) uint8 arrays
        All of the same size. Transparency is dropped.
    path : path
        Ends in .mp4 or .gif. An existing file is replaced.
    fps : float
        Pictures per second, 1 to 100; in a .gif up to 50, as programs show faster ones slowly.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    MissingPackageError
        For .mp4 without imageio and its ffmpeg (extra `export`).
    ParameterError
        If there are no pictures, one has another shape or type, or `fps` is out of range.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     pictures = (np.full((8, 8, 3), 20 * i, np.uint8) for i in range(5))
    ...     write_movie(pictures, f"{folder}/gray.gif", fps=10).name
    'gray.gif'
    """
    with movie_writer(path, fps=fps) as append:
        for image in images:
            append(image)
    return path_of(path)


@contextmanager
def movie_writer(path: str | Path, *, fps: float = 25.0) -> Iterator[Callable[[np.ndarray], None]]:
    """Yield a function that appends one picture to a movie; for the arguments see :func:`write_movie`.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder, movie_writer(f"{folder}/gray.gif") as append:
    ...     for i in range(5):
    ...         append(np.full((8, 8, 3), 20 * i, np.uint8))
    """
    path = output_file(path, (".mp4", ".gif"))
    gif = path.suffix.lower() == ".gif"
    fps = check_range("fps", fps, 1.0, 50.0 if gif else 100.0, "For more than 50, write .mp4." if gif else "")
    opened = _gif if gif else partial(_film, _imageio())
    shapes: list[tuple[int, ...]] = []

    def append(image: np.ndarray) -> None:
        image = _checked(image, shapes)
        with _refusals(path):
            write(image)

    with ExitStack() as stack:
        with _refusals(path):
            write = stack.enter_context(opened(stack.enter_context(replaced(path)), fps))
        yield append
        if not shapes:
            raise ParameterError("a movie needs at least one picture, received none.")
        with _refusals(path):
            stack.close()


@contextmanager
def _refusals(path: Path) -> Iterator[None]:
    """Turn errors of the disk into those for a file that cannot be written; imageio's quote ffmpeg at length."""
    try:
        yield
    except OSError as problem:
        brief = (str(problem).strip().splitlines() or ["ffmpeg failed"])[0]
        raise not_written(path, brief if problem.errno is None else problem) from None


@contextmanager
def _film(imageio: ModuleType, path: Path, fps: float) -> Iterator[Callable[[np.ndarray], None]]:
    """Yield a function that appends a picture to an MP4 file, which ffmpeg writes.

    With a quality at which the pores of moving skin just stay, and a fast preset that still looks at pictures ahead, or
    files were 1.6 times as large. The default preset takes four times as long, for files that are a ninth smaller.
    """
    writer = imageio.get_writer(
        path,
        mode="I",
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=1,
        ffmpeg_log_level="quiet",
        output_params=["-crf", "21", "-preset", "superfast", "-x264-params", "mbtree=1:rc-lookahead=10"],
    )
    count = 0

    def append(image: np.ndarray) -> None:
        nonlocal count
        height, width = image.shape[:2]  # the last row and column are repeated where their number is odd
        writer.append_data(np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge"))
        count += 1

    try:
        yield append
    except BaseException:
        with suppress(OSError):  # the first error matters more
            writer.close()
        raise
    writer.close()
    if _pictures_in(path) != count:  # ffmpeg does not tell
        raise OSError("ffmpeg could not finish it")


@contextmanager
def _gif(path: Path, fps: float) -> Iterator[Callable[[np.ndarray], None]]:
    """Yield a function that appends a picture to a GIF file, which Pillow writes when all are there."""
    from PIL import Image as Pillow

    images: list[Any] = []
    yield lambda image: images.append(Pillow.fromarray(np.ascontiguousarray(image)))
    begins = 10 * np.rint(100.0 / fps * np.arange(len(images) + 1)).astype(int)  # ms; the format cuts off the rest
    durations = np.diff(begins).tolist()
    images[0].save(path, format="GIF", save_all=True, append_images=images[1:], duration=durations, loop=0)


def _pictures_in(path: Path) -> int:
    """Return the number of pictures in a film; 0 if it cannot be read."""
    from imageio_ffmpeg import count_frames_and_secs

    try:
        return int(count_frames_and_secs(str(path))[0])
    except RuntimeError:
        return 0


def _imageio() -> ModuleType:
    with optional_imports("movies need"):
        import imageio.v2 as imageio
        import imageio_ffmpeg  # noqa: F401
    return imageio


def _checked(image: np.ndarray, shapes: list[tuple[int, ...]]) -> np.ndarray:
    """Return the picture without transparency; its shape is appended to `shapes`, and must be that of the first."""
    image = picture(image)
    shapes.append(image.shape[:2])
    if shapes[-1] != shapes[0]:
        raise ParameterError(
            f"all pictures must have the size of the first, {shapes[0]}; picture {len(shapes) - 1} has {shapes[-1]}."
        )
    return image[..., :3]
