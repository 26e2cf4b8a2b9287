"""Making a data set: shards that are missing are made, here or by the workers of a cluster."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import FaceWrinkleError, OutputError, ParameterError, check_whole, optional_imports, warn
from ..files import inside_only, is_inside_only, output_folder, write_whole
from ..progress import Progress, bar
from .card import write_card
from .plan import first_sample_of
from .sample import Sample, SampleMaker
from .shards import STATE, Shard, State, arrow, failures_in, read_state, shards_of, write_shard
from .spec import Spec, code_digest


def generate(
    spec: Spec | str | Path | dict[str, Any] | None = None,
    out: str | Path = "dataset",
    *,
    count: int = 1000,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Path:
    """Make a data set in a folder, or what is missing of it.

    Sample i depends on the specification and on i alone: the same bytes come from one worker or many, in any order, and
    after any interruption.

    Parameters
    ----------
    spec : Spec, path or dict, optional
        Default: the default specification.
    out : path
        A folder that is empty, does not exist, or holds a part of the same set.
    count : int
        Number of samples. A set can be continued with a larger one if its last shard was full.
    workers : int
        Number of processes; each makes whole shards.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``, whose workers see the same folder and have the
        same code of the package; they are used in place of processes here.
    progress : callable, optional
        Called with an iterable of the samples, what is being done, and the number of samples; yields the samples, each
        when it is done. Default: a bar on stderr where that is a terminal.

    Returns
    -------
    Path
        The folder: shards with their SHA-256, ``index/`` with Parquet tables, ``statistics/`` of pixels, ``README.md``
        with ``mean.png``, and ``dataset.json``.

    Raises
    ------
    OutputError
        If the folder holds something else, or a set that other code began, or cannot be written.
    ParameterError
        If a scheduler cannot be reached, or a file of the specification is missing or changes meanwhile.
    FaceWrinkleError
        If a process died, or the scheduler was lost; what is missing is made when the same is run again.
    MissingPackageError
        Without pyarrow, or for a scheduler without Dask.

    Warns
    -----
    FaceWrinkleWarning
        For samples that could not be made; they are left out.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> out = generate({"size": [32, 32], "shard": 2}, f"{folder.name}/small", count=3)
    >>> sorted(path.name for path in out.iterdir())
    ['README.md', 'dataset.json', 'index', 'mean.png', 'shard-000000.sha256', 'shard-000000.tar',
     'shard-000001.sha256', 'shard-000001.tar', 'statistics']
    >>> folder.cleanup()
    """
    spec = spec_of(spec)
    count, workers = check_whole("count", count, 1, 1e12), check_whole("workers", workers, 1, 1024)
    arrow()  # before anything is drawn
    folder = Path(out).expanduser().absolute()
    shards = shards_of(count, spec.shard)
    if scheduler is None and len(shards) < workers:
        warn(
            f"{workers} processes, and {len(shards)} of them at work: each makes whole shards, and {count} samples are "
            f"{len(shards)} of {spec.shard}. For all to work, begin a set with shard = {max(count // workers, 1)}."
        )
    _begin(output_folder(folder), spec, count)
    for _ in (progress or bar)(_samples(spec, shards, folder, workers, scheduler), "Making samples", count):
        pass
    write_card(folder, spec, count)
    if failures := failures_in(folder):
        warn(
            f"{len(failures)} of {count} samples could not be made and are left out (shard-*.failed.json); the "
            f"first is {failures[0]}. To try them again, remove their shards, and run the same again."
        )
    return folder


def _samples(spec: Spec, shards: list[Shard], folder: Path, workers: int, scheduler: str | None) -> Iterator[int]:
    """Make what is missing of a set, and yield the number of each of its samples when it is done."""
    missing = []
    for shard in shards:
        if shard.done(folder):
            yield from range(shard.first, shard.last)
        else:
            missing.append(shard)
    if scheduler is not None or (workers > 1 and len(missing) > 1):
        yield from _distributed(spec, missing, folder, workers, scheduler)
        return
    for shard in missing:
        yield from write_shard(spec, shard, folder)


def preview(spec: Spec | str | Path | dict[str, Any] | None = None, count: int = 24) -> Iterator[Sample]:
    """Yield samples of `count` different people, to look at before a set is made.

    Examples
    --------
    >>> [sample.index for sample in preview({"size": [32, 32], "shard": 10}, count=2)]
    [0, 10]
    """
    spec = spec_of(spec)
    with SampleMaker(spec) as maker:
        for number in range(check_whole("count", count, 1, 10000)):
            yield maker.sample(first_sample_of(spec, number))


def spec_of(what: Spec | str | Path | dict[str, Any] | None) -> Spec:
    """Return a specification from whatever describes it."""
    if isinstance(what, Spec):
        return what
    return Spec.read(what) if isinstance(what, str | Path) else Spec.of(what)


def _begin(folder: Path, spec: Spec, count: int) -> None:
    """Refuse a folder that holds something else; leave a note which set this one will hold."""
    if (folder / STATE).exists():
        _check_same(read_state(folder), folder, spec, count)
    elif any(folder.iterdir()):
        raise OutputError(f"{str(folder)!r} holds other files, and no data set. Name a new folder.")
    state = State(spec.digest, __version__, code_digest(), count, spec.written)
    write_whole(folder / STATE, json.dumps(asdict(state), indent=1))


def _check_same(known: State, folder: Path, spec: Spec, count: int) -> None:
    """Raise an OutputError if the set in a folder is not the one that is to be made."""
    if known.digest != spec.digest:
        what = "another specification, or of other files"
        if known.code != code_digest():
            what = f"facewrinkle {known.version} with other code ({known.code}; this is {__version__}, {code_digest()})"
        raise OutputError(
            f"{str(folder)!r} holds a set of {what}. Name a new folder, or go on with that code, those files, and the "
            f"specification in {STATE}."
        )
    if count < known.count or (count > known.count and known.count % spec.shard):
        raise OutputError(
            f"{str(folder)!r} holds a set of {known.count} samples. Go on with the same count, or with a larger one "
            f"if all shards of {spec.shard} are full."
        )


def _distributed(spec: Spec, shards: list[Shard], folder: Path, workers: int, scheduler: str | None) -> Iterator[int]:
    """Make shards at once, and yield the numbers of their samples; when one fails, the others are finished."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    reason = ""
    with _executor(min(workers, len(shards)), scheduler) as pool:
        futures = {pool.submit(_made, spec, shard, folder, is_inside_only()): shard for shard in shards}
        for future in as_completed(futures):
            try:
                future.result()
            except CancelledError:
                reason = "the scheduler was lost"
            except Exception as problem:
                reason = str(problem).rstrip(".")
            else:
                yield from range(futures[future].first, futures[future].last)
    if reason:
        missing = sum(not shard.done(folder) for shard in shards)
        raise FaceWrinkleError(f"{missing} of {len(shards)} shards are missing: {reason}. Run the same again to go on.")


@contextmanager
def _executor(workers: int, scheduler: str | None) -> Iterator[Executor]:
    """Processes here, or the workers of a scheduler."""
    if scheduler is None:
        spawn = get_context("spawn")  # VTK does not get over a fork
        with ProcessPoolExecutor(workers, spawn, _end_with_parent) as pool:
            yield pool
        return
    with optional_imports("a scheduler needs"):
        import distributed
    try:
        client = distributed.Client(scheduler)
    except (OSError, ValueError) as problem:
        raise ParameterError(
            f"the scheduler {scheduler!r} cannot be reached ({type(problem).__name__}). Check the address, and "
            "that it is running: dask scheduler."
        ) from None
    with client:
        yield client.get_executor(pure=False)


def _end_with_parent() -> None:
    """Have a worker end when its parent has, even if that was killed."""
    threading.Thread(target=_outlive, daemon=True).start()


def _outlive() -> None:
    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(1)


def _made(spec: Spec, shard: Shard, folder: Path, inside: bool) -> None:
    """Make a shard, in a worker; with `inside`, files that scans name are read within their folders only."""
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    os.environ.setdefault("LP_NUM_THREADS", "0")  # software that draws does so in the same thread: one core a worker
    if Spec.of(spec.written).digest != spec.digest:
        raise OutputError(
            "a worker has other code of facewrinkle, other scans or pictures. Give it those of this machine."
        )
    with inside_only(inside):
        for _ in write_shard(spec, shard, folder):
            pass
