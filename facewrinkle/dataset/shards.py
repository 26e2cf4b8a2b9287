"""Shards: files of consecutive samples, whole or absent, with a table of what is in them; and what is wrong with them.

A shard is a tar file as WebDataset reads it; beside it are a Parquet file with a row for each picture, sums over the
pictures, and the SHA-256 of all three as the program ``sha256sum`` checks it. The same samples give the same bytes:
members have no times and owners.
"""

from __future__ import annotations

import hashlib
import json
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from io import FileIO
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated, Any
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import OutputError, ParameterError, check_whole, optional_imports
from ..files import LARGEST_SETTINGS, bytes_of, opened, write_whole, written
from ..schemas import Limits, conforming, table_of
from .labels import PARTS
from .plan import person_at
from .sample import Sample, SampleMaker, compressed, row_of
from .spec import Spec, code_digest

Sums = dict[str, npt.NDArray[Any]]


def sums_of(sample: Sample) -> Sums:
    """Return the sums of one picture.

    Returns
    -------
    dict of str to ndarray of uint64
        ``pictures``, 1; ``pixels`` of each part (len(PARTS),); ``colors`` and ``squares``, the sums of red, green and
        blue over the pixels, and of their squares (3,); ``small`` and ``small_squares``, the picture reduced to
        128 pixels at most, and its square (h, w, 3).

    Examples
    --------
    >>> sample = Sample(0, np.full((4, 4, 3), 10, np.uint8), {"part": np.ones((4, 4), np.uint8)}, {})
    >>> sums = added(sums_of(sample), sums_of(sample))
    >>> sums["pictures"].tolist(), sums["pixels"][:3].tolist(), sums["squares"].tolist(), sums["small"].shape
    (2, [0, 32, 0], [3200, 3200, 3200], (4, 4, 3))
    """
    from PIL import Image as Pillow

    reduced = Pillow.fromarray(sample.image)
    reduced.thumbnail((128, 128), Pillow.Resampling.BOX)  # the size of the mean picture at most
    small, colors = np.array(reduced, np.uint64), sample.image.reshape(-1, 3).astype(np.uint64)
    return {
        "pictures": np.array(1, np.uint64),
        "pixels": np.bincount(sample.labels["part"].ravel(), minlength=len(PARTS)).astype(np.uint64),
        "colors": colors.sum(axis=0),
        "squares": (colors**2).sum(axis=0),
        "small": small,
        "small_squares": small**2,
    }


def added(one: Sums, other: Sums) -> Sums:
    """Return the sums of the pictures of both; those of none are an empty dictionary."""
    return {name: np.add(one.get(name, 0), other.get(name, 0), dtype=np.uint64) for name in one | other}


def sums_in(folder: Path) -> Sums:
    """Return the sums of all shards of a set."""
    sums: Sums = {}
    for path in sorted((folder / "statistics").glob("shard-*.npz")):
        try:
            with opened(path, kept=False) as file, np.load(file) as stored:
                sums = added(sums, dict(stored))
        except (OSError, ValueError, BadZipFile):
            raise OutputError(
                f"{path.name} is damaged. Remove it, and run again: the shard {path.stem} will be made again."
            ) from None
    return sums


def mean_and_deviation(count: npt.ArrayLike, total: npt.NDArray[Any], squares: npt.NDArray[Any]) -> tuple[Array, Array]:
    """Return the mean and the standard deviation of numbers, from their sum and the sum of their squares.

    Examples
    --------
    >>> mean_and_deviation(np.array(2), np.array([4, 10]), np.array([16, 52]))
    (array([2., 5.]), array([2., 1.]))
    """
    mean = total / np.maximum(count, 1)
    return mean, np.sqrt(np.maximum(squares / np.maximum(count, 1) - mean**2, 0.0))


STATE = "dataset.json"
"""The file in the folder of a set that tells which set it is."""


@dataclass
class State:
    """What the folder of a set says about it: digest, version and code of :class:`Spec`, number of samples."""

    digest: str
    version: str
    code: str
    count: Annotated[int, Limits(1, 10**12)]
    spec: dict[str, Any]


@dataclass(frozen=True)
class Shard:
    """Consecutive samples in one file.

    Attributes
    ----------
    number : int
    first, last : int
        Numbers of the first sample, and of the first one after the shard.
    """

    number: int
    first: int
    last: int

    @property
    def name(self) -> str:
        """The name of the files, without ending."""
        return f"shard-{self.number:06d}"

    def files(self) -> tuple[str, str, str, str]:
        """Return the names of tar file, table and statistics, and of the list of samples that could not be made."""
        name = self.name
        return f"{name}.tar", f"index/{name}.parquet", f"statistics/{name}.npz", f"{name}.failed.json"

    @property
    def sums(self) -> str:
        """The name of the file of their SHA-256."""
        return f"{self.name}.sha256"

    def done(self, folder: Path) -> bool:
        """Return True if tar file, table, statistics and their SHA-256 are there; the last is written last."""
        return all((folder / name).is_file() for name in (*self.files()[:3], self.sums))

    def sums_in(self, folder: Path, spec: str, archive: str = "") -> str:
        """Return the SHA-256 of the files that are there, a line each, after the digest of the specification; that of
        the tar file is not read for again if it is known.
        """
        lines = [f"# {spec}\n"]
        for name in self.files():
            if archive and name == self.files()[0]:
                lines.append(f"{archive}  {name}\n")
            elif (folder / name).is_file():
                with opened(folder / name, kept=False) as file:
                    lines.append(f"{hashlib.file_digest(file, 'sha256').hexdigest()}  {name}\n")
        return "".join(lines)


def shards_of(count: int, size: int) -> list[Shard]:
    """Return the shards of a set.

    Raises
    ------
    ParameterError
        If there would be more than 100,000.

    Examples
    --------
    >>> [(shard.first, shard.last) for shard in shards_of(25, 10)]
    [(0, 10), (10, 20), (20, 25)]
    """
    starts, most = range(0, count, size), 100_000
    if len(starts) > most:
        raise ParameterError(
            f"{count:,} samples make {len(starts):,} shards of {size:,}, and {most:,} are allowed. In the "
            f"specification, set shard = {-(-count // most)} or more, or ask for fewer samples."
        )
    return [Shard(number, first, min(first + size, count)) for number, first in enumerate(starts)]


def write_shard(spec: Spec, shard: Shard, folder: Path) -> Iterator[int]:
    """Make the samples of a shard and write it, and yield the number of each that is done.

    Each person is made once: samples are made person by person, kept in a file without a name, and written in order.
    One that fails twice is listed with its error in a file beside the shard, and left out.
    """
    archive, table, statistics, failed = (folder / name for name in shard.files())
    rows: list[dict[str, Any]] = []
    failures: list[dict[str, Any]] = []
    members: list[tuple[int, str, int, int]] = []
    sums: Sums = {}
    with written(archive) as partial, TemporaryFile(dir=folder) as store:
        for old in (folder / shard.sums, failed):
            old.unlink(missing_ok=True)
        with SampleMaker(spec) as maker:
            for index in sorted(range(shard.first, shard.last), key=lambda index: person_at(spec, index)):
                for sample in _tried(maker, index, failures):
                    files = sample.files().items()
                    sums = added(sums, sums_of(sample))
                    rows.append(row_of(sample.facts, sample.key) | {"shard": archive.name})
                    for ending, content in files:
                        members.append((index, f"{sample.key}.{ending}", store.tell(), len(content)))
                        store.write(content)
                yield index
        with (
            _Hashed(partial) as hashed,
            tarfile.open(fileobj=hashed, mode="w|", format=tarfile.USTAR_FORMAT) as tar,
        ):
            for _, name, start, size in sorted(members, key=itemgetter(0)):
                member = tarfile.TarInfo(name)
                member.size = size
                store.seek(start)
                tar.addfile(member, store)
    if failures:
        failures.sort(key=itemgetter("index"))
        write_whole(failed, json.dumps(failures, indent=1, sort_keys=True))
    write_table(sorted(rows, key=itemgetter("index")), table)
    write_whole(statistics, compressed(sums))
    write_whole(folder / shard.sums, shard.sums_in(folder, spec.digest, hashed.sum.hexdigest()))


class _Hashed(FileIO):
    """A file that is written, and the SHA-256 of all that was."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w")
        self.sum = hashlib.sha256()

    def write(self, content: Any) -> int:
        self.sum.update(content)
        return super().write(content)


def _tried(maker: SampleMaker, index: int, failures: list[dict[str, Any]]) -> list[Sample]:
    for attempt in range(2):
        try:
            return maker.pictures(index)
        except ParameterError:  # a file of the specification has changed: all that follows would be another set
            raise
        except Exception as problem:  # one sample must not stop a night's work
            if attempt:
                failures.append({"index": index, "error": f"{type(problem).__name__}: {problem}"})
    return []


def write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write rows as Parquet."""
    pyarrow, parquet = arrow()
    table = pyarrow.Table.from_pylist(rows)
    with written(path) as partial:
        parquet.write_table(table, partial)


def read_table(folder: Path, columns: tuple[str, ...]) -> dict[str, list[Any]]:
    """Return columns of the tables of all shards of a set, in order of the samples."""
    pyarrow, _ = arrow()
    found: dict[str, list[Any]] = {name: [] for name in columns}
    for path in sorted((folder / "index").glob("shard-*.parquet")):
        try:
            table = _table(path)
        except (OSError, pyarrow.ArrowException):
            raise OutputError(
                f"{path.name} is damaged. Remove it, and run again: the shard {path.stem} will be made again."
            ) from None
        for name, values in found.items() if len(table) else ():
            values += table[name].to_pylist()
    return found


def _table(path: Path) -> Any:
    """Return the table in a file.

    By name: what Python opened is let go in a thread of pyarrow's, which aborts a process that is ending.
    """
    with opened(path, kept=False), arrow()[1].ParquetFile(path) as file:
        return file.read()


def arrow() -> tuple[Any, Any]:
    """Return the modules that write tables.

    Raises
    ------
    MissingPackageError
        Without pyarrow.
    """
    with optional_imports("data sets need"):
        import pyarrow
        import pyarrow.parquet
    return pyarrow, pyarrow.parquet


def read_state(folder: Path) -> State:
    """Return what a folder says about the set in it."""
    try:
        found: State = conforming(table_of(bytes_of(folder / STATE, LARGEST_SETTINGS, kept=False)), State, "")
        return found
    except (OSError, ValueError):
        raise OutputError(f"{str(folder)!r} holds no data set: {STATE} is missing or damaged.") from None


def failures_in(folder: Path) -> list[str]:
    """Return what is said of the samples of a set that could not be made, in the files beside its shards."""
    found = (bytes_of(path, LARGEST_SETTINGS, kept=False) for path in sorted(folder.glob("shard-*.failed.json")))
    return [f"{failure['index']:09d}: {failure['error']}" for content in found for failure in json.loads(content)]


def check(folder: str | Path, remade: int = 3) -> Iterator[tuple[str, list[str]]]:
    """Check a data set, and yield for each shard, and for the samples that are made again, what is wrong with it.

    Parameters
    ----------
    folder : path
    remade : int
        So many samples, spread evenly, are made again and must have the same bytes.

    Yields
    ------
    name : str
    problems : list of str
        Empty if all is well.

    Raises
    ------
    OutputError
        If the folder holds no data set.

    Examples
    --------
    >>> import tempfile
    >>> from facewrinkle.dataset import generate
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     out = generate({"size": [32, 32], "shard": 2}, f"{folder}/small", count=2)
    ...     list(check(out, remade=1))
    [('dataset.json', []), ('shard-000000.tar', []), ('samples made again', [])]
    """
    folder, remade = Path(folder).expanduser(), check_whole("remade", remade, 0, 1e6)
    arrow()  # before anything is read
    state = read_state(folder)
    spec = Spec.of(state.spec, folder)
    shards = shards_of(state.count, spec.shard)
    changed = state.code == code_digest() and spec.digest != state.digest
    known = {folder / name for shard in shards for name in shard.files()}
    found = (path for pattern in ("shard-*.tar", "index/[!.]*", "statistics/[!.]*") for path in folder.glob(pattern))
    extra = {*found} - known
    problems = ["its specification is not that of the set"] if changed else []
    yield STATE, problems + [f"{path.name} is no file of the set" for path in sorted(extra)]
    whole = []
    for shard in shards:
        problems = _problems(shard, folder, state.digest)
        yield f"{shard.name}.tar", problems
        whole += [] if problems else [shard]
    if remade:
        other = f"the set was made by other code ({state.code}; this is {code_digest()}): they cannot be compared"
        same = state.code == code_digest()
        yield "samples made again", _differences(spec, folder, whole, remade) if same else [other]


def _problems(shard: Shard, folder: Path, digest: str) -> list[str]:
    """What is wrong with the files of a shard."""
    try:
        sums = bytes_of(folder / shard.sums, LARGEST_SETTINGS, kept=False)
    except OSError:
        return [f"{shard.sums} is missing"]
    known = sums.decode(errors="replace").splitlines()
    of_set, *found = shard.sums_in(folder, digest).splitlines()
    problems = [] if known[:1] == [of_set] else ["is of another set"]
    problems += [f"{name} is missing" for name in shard.files()[:3] if not (folder / name).is_file()]
    return problems + [f"{line.split()[1]} is not what was made" for line in found if line not in known]


def _differences(spec: Spec, folder: Path, shards: list[Shard], remade: int) -> list[str]:
    """Return which of some samples in whole shards, made again, are not as they are stored."""
    made: list[tuple[int, Shard]] = []
    problems = []
    for shard in shards:
        try:
            rows = _table(folder / shard.files()[1]).to_pylist()  # of none, it has no columns
            made += [(index, shard) for index in sorted({row["index"] for row in rows})]
        except Exception:  # its sums say that it is whole: it was damaged before they were made
            problems.append(f"{shard.files()[1]} is damaged")
    with SampleMaker(spec) as maker:
        for place in sorted({round(k) for k in np.linspace(0, len(made) - 1, min(remade, len(made)))}):
            index, shard = made[place]
            if not all(_is_stored(sample, folder / shard.files()[0]) for sample in maker.pictures(index)):
                problems.append(f"{index:09d} differs from what is stored")
    return problems


def _is_stored(sample: Sample, archive: Path) -> bool:
    """True if the files of a picture are in a shard as they are."""
    try:
        with opened(archive, kept=False) as whole, tarfile.open(fileobj=whole) as tar:
            own = [member for member in tar if member.name.startswith(f"{sample.key}.")]
            stored = {member.name: file.read() for member in own if (file := tar.extractfile(member)) is not None}
    except (tarfile.TarError, OSError, RecursionError):  # damaged before its sums were made
        return False
    return stored == {f"{sample.key}.{ending}": content for ending, content in sample.files().items()}
