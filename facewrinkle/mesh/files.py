"""Text files in any encoding, files that are written completely or not at all, and checks of output paths."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_ISDIR
from tempfile import TemporaryFile

from ..errors import OutputError

_made: set[Path] = set()
"""Folders made by `replaced`, which are removed again if they stay empty."""


def text_of(path: Path) -> str:
    """Return the text of a file in UTF-8, with or without a byte order mark, or in Latin-1."""
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder, with the same ending; at the end that file replaces `path`.

    After an error or an interrupt, the old file is untouched, and nothing else is left; folders that were made and
    stayed empty are removed.
    """
    path = Path(os.path.expanduser(path)).absolute()
    parents = path.parents
    _made.update(folder for folder in parents if not folder.exists())
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{os.getpid()}.{path.name[-100:]}")
    try:
        yield temporary
        temporary.replace(path)
    except BaseException:
        with suppress(OSError):  # the first error matters more
            temporary.unlink(missing_ok=True)
        with suppress(OSError):  # it is no longer empty
            for folder in parents:
                if folder not in _made:
                    break
                folder.rmdir()
        raise


def output_folder(path: str | Path, make: bool = True) -> Path:
    """Return the folder, made if need be, after checking that a file can be written to it.

    Parameters
    ----------
    path : str or Path
    make : bool
        If False, only check that the folder could be made, before long work.

    Raises
    ------
    OutputError
        If a file stands in the folder's place or on the way to it, or if the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as parent:
    ...     output_folder(f"{parent}/pictures/smile").name
    'smile'
    """
    folder = Path(os.path.expanduser(path))
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
        with TemporaryFile(dir=there):  # permission bits say little: root ignores them
            pass
    except (FileExistsError, NotADirectoryError):
        raise OutputError(
            f"{str(folder)!r} cannot be an output folder: a file stands there or on the way to it. Name another folder."
        ) from None
    except (OSError, ValueError) as problem:
        raise OutputError(
            f"{str(folder)!r} cannot be written: {getattr(problem, 'strerror', problem)}. "
            "Name a folder that you may write to."
        ) from None
    return folder


def output_file(path: str | Path, endings: Sequence[str]) -> Path:
    """Return the path of a file with one of these endings, after checking that it can be written."""
    path = Path(os.path.expanduser(path))
    if path.suffix.lower() not in endings:
        raise OutputError(f"the file must end in {' or '.join(endings)}, received {path.name!r}.")
    output_folder(path.parent, make=False)
    try:
        is_folder = S_ISDIR(path.stat().st_mode)
    except FileNotFoundError:
        is_folder = False
    except (OSError, ValueError) as problem:
        raise OutputError(f"{str(path)!r} cannot be written: {problem}. Name another file.") from None
    if is_folder:
        raise OutputError(f"{str(path)!r} is a folder, and a file is to be written. Name a file in it.")
    return path
