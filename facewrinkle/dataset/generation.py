"""Making a data set: shards that are missing are made, here or by the workers of a cluster."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import FaceWrinkleError, OutputError, ParameterError, check_whole, missing_package
from ..files import inside_only, is_inside_only, written
from .card import write_card
from .sample import Sample, SampleMaker
from .shards import Shard, arrow, shards_of, write_shard
from .spec import Spec

STATE = "dataset.json"
"""The file in the folder of a set that tells which set it is."""

ABANDONED = 600.0
"""Seconds after which an unfinished file to which nothing was added is taken to be of a run that was killed."""

Progress = Callable[[int], None]


def generate(
    spec: Spec | str | Path | dict[str, Any] | None = None,
    out: str | Path = "dataset",
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
        Number of processes.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``, whose workers see the same folder and have the
        same version of the package; they are used in place of processes here.
    progress : callable, optional
        Called with the number of samples that have become done.

    Returns
    -------
    Path
        The folder: shards, ``index/`` with Parquet tables, ``README.md``, and ``dataset.json``.

    Raises
    ------
    OutputError
        If the folder holds something else, or cannot be written.
    ParameterError
        If a scheduler cannot be reached.
    FaceWrinkleError
        If a process died, or the scheduler was lost; what is missing is made when the same is run again.
    MissingPackageError
        Without pyarrow, or for a scheduler without Dask.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> out = generate({"size": [32, 32], "shard": 2}, f"{folder.name}/small", count=3)
    >>> sorted(path.name for path in out.iterdir())
    ['README.md', 'dataset.json', 'distributions.png', 'index', 'shard-000000.tar', 'shard-000001.tar']
    >>> folder.cleanup()
    """
    spec = spec_of(spec)
    count, workers = check_whole("count", count, 1, 1e12), check_whole("workers", workers, 1, 1024)
    arrow()  # before anything is drawn
    folder = Path(out).expanduser().absolute()
    _begin(folder, spec, count)
    report = progress or (lambda done: None)
    missing = []
    for shard in shards_of(count, spec.shard):
        if shard.done(folder):
            report(shard.last - shard.first)
        else:
            missing.append(shard)
    if scheduler is None and (workers == 1 or len(missing) < 2):
        for shard in missing:
            for _ in write_shard(spec, shard, folder):
                report(1)
    else:
        _distribute(spec, missing, folder, workers, scheduler, report)
    for path in folder.rglob(".[0-9]*.shard-*"):  # another run may be at work in the same folder
        if time.time() - path.stat().st_mtime > ABANDONED:
            path.unlink(missing_ok=True)
    write_card(folder, spec, count)
    return folder


def preview(spec: Spec | str | Path | dict[str, Any] | None = None, count: int = 24) -> Iterator[Sample]:
    """Yield samples of `count` different people, to look at before a set is made.

    Examples
    --------
    >>> [sample.index for sample in preview({"size": [32, 32]}, count=2)]
    [0, 10]
    """
    spec = spec_of(spec)
    with SampleMaker(spec) as maker:
        for number in range(check_whole("count", count, 1, 10000)):
            yield maker.sample(number * spec.per_person)


def spec_of(what: Spec | str | Path | dict[str, Any] | None) -> Spec:
    """Return a specification from whatever describes it."""
    if isinstance(what, Spec):
        return what
    return Spec.read(what) if isinstance(what, str | Path) else Spec.of(what)


def _begin(folder: Path, spec: Spec, count: int) -> None:
    """Refuse a folder that holds something else; leave a note which set this one will hold."""
    state = folder / STATE
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{str(folder)!r} is not a folder. Name another with --out.")
    if not state.exists():
        if folder.exists() and any(folder.iterdir()):
            raise OutputError(f"{str(folder)!r} holds other files, and no data set. Name a new folder.")
        _state(folder, spec, count)
        return
    known = read_state(folder)
    if known["digest"] != spec.digest:
        raise OutputError(
            f"{str(folder)!r} holds a set of another specification or version ({known['version']}; this is "
            f"{__version__}). Name a new folder, or go on with the specification in its {STATE}."
        )
    if count < known["count"] or (count > known["count"] and known["count"] % spec.shard):
        raise OutputError(
            f"{str(folder)!r} holds a set of {known['count']} samples. Go on with the same count, or with a larger one "
            f"if all shards of {spec.shard} are full."
        )
    _state(folder, spec, count)


def read_state(folder: Path) -> dict[str, Any]:
    """Return what a folder says about the set in it."""
    try:
        state = json.loads((folder / STATE).read_text(encoding="utf-8"))
        return {
            "digest": str(state["digest"]),
            "version": str(state["version"]),
            "count": int(state["count"]),
            "spec": state["spec"],
        }
    except (OSError, ValueError, KeyError, TypeError):
        raise OutputError(f"{str(folder)!r} holds no data set: {STATE} is missing or damaged.") from None


def _state(folder: Path, spec: Spec, count: int) -> None:
    state = {"digest": spec.digest, "version": __version__, "count": count, "spec": spec.written}
    with written(folder / STATE) as partial:
        Path(partial).write_text(json.dumps(state, indent=1, default=str), encoding="utf-8")


def _distribute(
    spec: Spec, shards: list[Shard], folder: Path, workers: int, scheduler: str | None, report: Progress
) -> None:
    """Make shards at once; when one fails, the others are finished."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    outcomes = (
        _by_processes(spec, shards, folder, workers) if scheduler is None else _by_dask(spec, shards, folder, scheduler)
    )
    reason = ""
    for shard, problem in outcomes:
        if problem:
            reason = problem
        else:
            report(shard.last - shard.first)
    if reason:
        missing = sum(not shard.done(folder) for shard in shards)
        raise FaceWrinkleError(f"{missing} of {len(shards)} shards are missing: {reason}. Run the same again to go on.")


def _by_processes(spec: Spec, shards: list[Shard], folder: Path, workers: int) -> Iterator[tuple[Shard, str]]:
    """Make shards by processes here, and yield each with what went wrong."""
    with ProcessPoolExecutor(min(workers, len(shards)), get_context("spawn")) as pool:  # VTK does not get over a fork
        futures = {pool.submit(_made, spec, shard, folder, is_inside_only()): shard for shard in shards}
        for future in as_completed(futures):
            yield futures[future], str(future.exception() or "").rstrip(".")


def _by_dask(spec: Spec, shards: list[Shard], folder: Path, scheduler: str) -> Iterator[tuple[Shard, str]]:
    """Make shards by the workers of a scheduler, and yield each with what went wrong."""
    try:
        import distributed
    except ImportError:
        raise missing_package("a scheduler needs", "distributed", "dataset") from None
    try:
        client = distributed.Client(scheduler)
    except (OSError, ValueError) as problem:
        raise ParameterError(
            f"the scheduler {scheduler!r} cannot be reached ({type(problem).__name__}). Check the address, and "
            "that it is running: dask scheduler."
        ) from None
    with client:
        inside = is_inside_only()
        futures = {client.submit(_made, spec, shard, folder, inside, pure=False): shard for shard in shards}
        for future in distributed.as_completed(futures):
            failed = str(future.exception()) if future.status == "error" else "the scheduler was lost"
            yield futures[future], "" if future.status == "finished" else failed


def _made(spec: Spec, shard: Shard, folder: Path, inside: bool) -> None:
    """Make a shard, in a worker; with `inside`, files that scans name are read within their folders only."""
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    os.environ.setdefault("LP_NUM_THREADS", "0")  # software that draws does so in the same thread: one core a worker
    with inside_only(inside):
        for _ in write_shard(spec, shard, folder):
            pass
