"""Text files in any encoding, files that are written completely or not at all, and checks of output paths."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from tempfile import TemporaryFile

from ..arguments import checked
from ..disk import NO_SPACE, free_bytes
from ..errors import FaceWrinkleError, MeshError, OutputError
from ..input_files import is_input

SCARCE = 2**20
"""With fewer free bytes than this, what could not be written is taken to have found no room."""

_made: set[Path] = set()
"""Folders made by `replaced`, which are removed again if they stay empty."""

_number = count()
"""So that two threads may write files of the same name."""

_unfinished: set[Path] = set()
"""Files that `replaced` has not put into their place yet."""


def text_of(path: Path) -> str:
    """Return the text of a file in UTF-8, with or without a byte order mark, or in Latin-1."""
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn whatever goes wrong while a file is read into a MeshError: every format can be damaged in its own ways."""
    try:
        yield
    except FaceWrinkleError:
        raise
    except MemoryError as problem:
        raise MeshError(
            f"{path.name} cannot be read: there is not enough memory for what it announces. If the file is whole, use "
            "a machine with more memory, or a mesh with fewer triangles."
        ) from problem
    except OSError as problem:
        raise MeshError(f"{str(path)!r} cannot be read: {problem.strerror or problem}. Check the file.") from problem
    except Exception as problem:
        raise MeshError(
            f"{path.name} cannot be read: its content makes no sense ({type(problem).__name__}). The file is damaged "
            "or of another format: export it again."
        ) from problem


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder, with the same ending; at the end that file replaces `path`.

    Where `path` is a link, what it leads to is replaced. After an error or an interrupt, the old file is untouched, and
    nothing else is left; folders that were made and stayed empty are removed.
    """
    name = Path(os.path.expanduser(path)).name
    path = output_target(path)
    _made.update(folder for folder in path.parents if not folder.exists())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise not_written(path, problem) from None
    temporary = path.with_name(f".{os.getpid()}.{next(_number)}.{name[-100:]}")
    _unfinished.add(temporary)
    try:
        yield temporary
        try:
            _synchronise(temporary)
            temporary.replace(path)
        except OSError as problem:
            raise not_written(path, problem) from None
    except BaseException:
        _remove(temporary)
        raise
    finally:
        _unfinished.discard(temporary)


@contextmanager
def written(path: str | Path) -> Iterator[Path]:
    """Do what `replaced` does, with an OutputError also for errors of the disk while the file is written."""
    try:
        with replaced(path) as whole:
            yield whole
    except OSError as problem:
        raise not_written(path, problem) from None


def not_written(path: str | Path, problem: OSError | str) -> OutputError:
    """Return the error for a file that could not be written, which says so if there is no room for it."""
    path = Path(os.path.expanduser(path)).absolute()
    reason = problem if isinstance(problem, str) else problem.strerror or str(problem)
    free = free_bytes(path)
    if (isinstance(problem, OSError) and problem.errno in NO_SPACE) or (free is not None and free < SCARCE):
        left = "" if free is None else f" ({free / 1e6:.1f} MB are free)"
        return OutputError(
            f"{str(path)!r} cannot be written: no space left on its disk{left}. What was there before is untouched. "
            "Free some space, or write to another disk."
        )
    return OutputError(f"{str(path)!r} cannot be written: {reason.rstrip('.')}. Name a file that you may write.")


def drop_unfinished() -> None:
    """Remove all files that are being written, and the folders made for them: the process is about to end."""
    for temporary in list(_unfinished):
        _remove(temporary)


def _synchronise(path: Path) -> None:
    """Bring a file onto the disk: some systems tell only now that it did not fit."""
    if os.name == "nt":  # where only files opened for writing can be
        return
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    except OSError as problem:
        if problem.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EROFS):  # it cannot be asked for here
            raise
    finally:
        os.close(file)


def _remove(temporary: Path) -> None:
    """Remove an unfinished file, and the folders that were made for it."""
    with suppress(OSError):  # the first error matters more
        temporary.unlink(missing_ok=True)
    with suppress(OSError):  # it is no longer empty
        for folder in temporary.parents:
            if folder not in _made:
                break
            folder.rmdir()


@checked
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
    """Return the path of a file with one of these endings, after checking that it can be written.

    Raises
    ------
    OutputError
        For another ending, a folder, what is no ordinary file, or one that a command has read; or if the folder cannot
        be written.
    """
    path = Path(os.path.expanduser(path))
    if path.suffix.lower() not in endings:
        raise OutputError(f"the file must end in {' or '.join(endings)}, received {path.name!r}.")
    output_folder(path.parent, make=False)
    output_target(path)
    return path


def output_target(path: str | Path) -> Path:
    """Return the path that a file is to be written to, with links followed.

    Raises
    ------
    OutputError
        If a folder or no ordinary file stands there, or one that a command has read.

    Examples
    --------
    >>> output_target("/dev/null")
    Traceback (most recent call last):
    facewrinkle.errors.OutputError: '/dev/null' is no ordinary file, and is not written to. Name another file.
    """
    path = Path(os.path.expanduser(path))
    try:
        target = Path(os.path.realpath(path))
        status = target.stat()
    except FileNotFoundError:
        return target
    except (OSError, ValueError) as problem:
        raise OutputError(f"{str(path)!r} cannot be written: {problem}. Name another file.") from None
    if S_ISDIR(status.st_mode):
        raise OutputError(f"{str(path)!r} is a folder, and a file is to be written. Name a file in it.")
    if not S_ISREG(status.st_mode):  # it would become one
        raise OutputError(f"{str(path)!r} is no ordinary file, and is not written to. Name another file.")
    if is_input(status):
        raise OutputError(
            f"{str(path)!r} was read, and would be replaced by what is made of it. Write to another folder: --out."
        )
    return target
