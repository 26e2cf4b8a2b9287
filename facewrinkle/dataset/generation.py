"""Making a data set: shards that are missing are made, here or by the workers of a cluster."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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

RETRIES = 2
"""So often is a shard begun again after its worker died."""

REACH = 20.0
"""Seconds to wait for a scheduler to answer."""

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
        Number of processes. More than one need Dask.
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
        If a scheduler cannot be reached, or its workers have another version.
    MissingPackageError
        Without pyarrow, or for several workers without Dask.

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
    if scheduler is not None or (workers > 1 and len(missing) > 1):
        with _client(min(workers, max(len(missing), 1)), scheduler) as client:
            _distribute(client, spec, missing, folder, report)
    else:
        for shard in missing:
            for _ in write_shard(spec, shard, folder):
                report(1)
    for path in folder.rglob(".[0-9]*.shard-*"):  # what runs that were killed have left
        path.unlink()
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


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """Yield a Dask client: of a scheduler, or of processes here."""
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise missing_package("several workers need", "distributed", "dataset") from None
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=REACH)
        except (OSError, ValueError) as problem:
            raise ParameterError(
                f"the scheduler {scheduler!r} cannot be reached ({type(problem).__name__}). Check the address, and "
                "that it is running: dask scheduler."
            ) from None
        with client:
            yield _checked(client)
        return
    settings = {
        "distributed.worker.profile.enabled": False,  # it would wake a hundred times a second
        # Dask's own setting has the system fill every large array with zeros, which takes a third of a sample's time.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
    }
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=logging.ERROR
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _checked(client: Any) -> Any:
    """Return a client if all its workers have this version of the package."""
    versions = client.run(_version)
    if not versions:
        raise ParameterError("the scheduler has no workers. Start some: dask worker ADDRESS.")
    other = {where: version for where, version in versions.items() if version != __version__}
    if other:
        where, version = next(iter(other.items()))
        raise ParameterError(
            f"the worker {where} has facewrinkle {version}, this is {__version__}. Install the same on all."
        )
    return client


def _version() -> str:
    return __version__


def _made(spec: Spec, shard: Shard, folder: Path, inside: bool) -> None:
    """Make a shard, in a worker; with `inside`, files that scans name are read within their folders only."""
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    os.environ.setdefault("LP_NUM_THREADS", "0")  # software that draws does so in the same thread: one core a worker
    with inside_only(inside):
        for _ in write_shard(spec, shard, folder):
            pass


def _distribute(client: Any, spec: Spec, shards: list[Shard], folder: Path, report: Progress) -> None:
    from distributed import as_completed

    inside = is_inside_only()
    futures = [client.submit(_made, spec, shard, folder, inside, retries=RETRIES, pure=False) for shard in shards]
    problem = "the scheduler was lost"  # then futures are cancelled, and have neither error nor result
    samples = {future.key: shard.last - shard.first for future, shard in zip(futures, shards, strict=True)}
    for future in as_completed(futures):
        if future.status == "finished":
            report(samples[future.key])
        elif future.status == "error":
            problem = str(future.exception())
    if missing := sum(not shard.done(folder) for shard in shards):
        raise FaceWrinkleError(
            f"{missing} of {len(shards)} shards are missing: {problem}. Run the same again to go on."
        )
