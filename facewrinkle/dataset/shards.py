"""Shards: files of consecutive samples, whole or absent, with a table of what is in them; and what is wrong with them.

A shard is a tar file as WebDataset reads it; beside it is a Parquet file with a row for each picture, which tells the
SHA-256 of its files. The same samples give the same bytes: members have no times and owners.
"""

from __future__ import annotations

import hashlib
import json
import tarfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from difflib import unified_diff
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from ..errors import MissingPackageError, OutputError, check_whole, missing_package
from ..files import write_whole, written
from .plan import person_at
from .sample import Sample, SampleMaker, key_of
from .spec import Spec, code_digest

FAILED = ".failed.json"
"""Ending of the file that lists samples of a shard that could not be made."""

STATE = "dataset.json"
"""The file in the folder of a set that tells which set it is."""


class State(Struct):
    """What the folder of a set says about it: digest, version and code of :class:`Spec`, number of samples."""

    digest: str
    version: str
    code: str
    count: Annotated[int, Meta(ge=1)]
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

    def paths(self, folder: Path) -> tuple[Path, Path]:
        """Return the paths of the tar and of the Parquet file."""
        return folder / f"{self.name}.tar", folder / "index" / f"{self.name}.parquet"

    def done(self, folder: Path) -> bool:
        """Return True if both files are there; the table is written last."""
        return all(path.is_file() for path in self.paths(folder))


def shards_of(count: int, size: int) -> list[Shard]:
    """Return the shards of a set.

    Examples
    --------
    >>> [(shard.first, shard.last) for shard in shards_of(25, 10)]
    [(0, 10), (10, 20), (20, 25)]
    """
    starts = range(0, count, size)
    return [Shard(number, first, min(first + size, count)) for number, first in enumerate(starts)]


def write_shard(spec: Spec, shard: Shard, folder: Path) -> Iterator[int]:
    """Make the samples of a shard and write it, and yield the number of each that is done.

    Each person is made once: samples are made person by person, kept in a file without a name, and written in order.
    One that fails twice is listed with its error in a file beside the shard, and left out.
    """
    archive, table = shard.paths(folder)
    rows: list[dict[str, Any]] = []
    failures: list[dict[str, Any]] = []
    members: list[tuple[int, str, int, int]] = []
    with written(archive) as partial, TemporaryFile(dir=folder) as store:
        for old in (table, archive.with_suffix(FAILED)):
            old.unlink(missing_ok=True)
        with SampleMaker(spec) as maker:
            for index in sorted(range(shard.first, shard.last), key=lambda index: person_at(spec, index)):
                for sample in _tried(maker, index, failures):
                    files = sample.files().items()
                    rows.append(row_of(sample.facts) | {"shard": archive.name, "sha256": sha256_of(files)})
                    for ending, content in files:
                        members.append((index, f"{sample.key}.{ending}", store.tell(), len(content)))
                        store.write(content)
                yield index
        with tarfile.open(partial, "w", format=tarfile.USTAR_FORMAT) as tar:
            for _, name, start, size in sorted(members, key=itemgetter(0)):
                member = tarfile.TarInfo(name)
                member.size = size
                store.seek(start)
                tar.addfile(member, store)
    if failures:
        failures.sort(key=itemgetter("index"))
        write_whole(archive.with_suffix(FAILED), json.dumps(failures, indent=1, sort_keys=True))
    write_table(sorted(rows, key=itemgetter("index")), table)


def _tried(maker: SampleMaker, index: int, failures: list[dict[str, Any]]) -> list[Sample]:
    for attempt in range(2):
        try:
            return maker.pictures(index)
        except Exception as problem:  # one sample must not stop a night's work
            if attempt:
                failures.append({"index": index, "error": f"{type(problem).__name__}: {problem}"})
    return []


def stored(archive: Path) -> Iterator[tuple[str, list[tuple[str, bytes]]]]:
    """Yield the key of each picture in a shard, with the endings and contents of its files.

    Raises
    ------
    TarError
        If the shard is damaged, or does not end as it was written: after its last file are zeros, to a whole record.
    """
    with archive.open("rb") as whole, tarfile.open(fileobj=whole, mode="r:") as tar:
        for key, members in groupby(tar, key=lambda member: member.name.partition(".")[0]):
            files = [(member.name.partition(".")[2], tar.extractfile(member)) for member in members]
            yield key, [(ending, b"" if file is None else file.read()) for ending, file in files]
        end = tar.offset + 2 * tarfile.BLOCKSIZE
        whole.seek(tar.offset)
        if whole.read() != bytes(2 * tarfile.BLOCKSIZE + -end % tarfile.RECORDSIZE):
            raise tarfile.TarError("bytes were appended or are missing")


def sha256_of(files: Iterable[tuple[str, bytes]]) -> str:
    """Return the SHA-256 of files, before each of which is a line with its ending and size.

    Examples
    --------
    >>> sha256_of([("png", b"...")]) == hashlib.sha256(b"png 3\\n...").hexdigest()
    True
    """
    digest = hashlib.sha256()
    for ending, content in files:
        digest.update(f"{ending} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def failed_in(archive: Path) -> set[int]:
    """Return the numbers of the samples of a shard that could not be made."""
    path = archive.with_suffix(FAILED)
    try:
        return {int(entry["index"]) for entry in json.loads(path.read_text(encoding="utf-8"))}
    except FileNotFoundError:
        return set()
    except (OSError, ValueError, KeyError, TypeError):
        raise _damaged(path, "no list of failed samples") from None


def row_of(facts: dict[str, Any]) -> dict[str, Any]:
    """Return what the table tells of a picture: numbers to search and to plot by."""
    plan, person, frame = facts["plan"], facts["person"], facts.get("frame")
    row = {
        "index": plan["index"],
        "key": key_of(plan["index"], frame),
        "person": person["number"],
        "frame": frame or 0,
        "scan": -1 if person["scan"] is None else person["scan"],
        "expression": json.dumps(plan["expression"], sort_keys=True),
        "action_units": json.dumps(facts["action_units"], sort_keys=True),
        "tears": plan["tears"] is not None,
        "attempt": plan["attempt"],
        "furrows": len(facts["furrows"]),
        "deepest": max((furrow["depth"] for furrow in facts["furrows"]), default=0.0),
        "visible_landmarks": sum(landmark["visible"] for landmark in facts["landmarks"].values()),
    }
    drawn = {"identity": person["identity"], "gaze": plan["gaze"], "camera": plan["camera"], "light": plan["lights"]}
    return row | {f"{group}_{name}": value for group, values in drawn.items() for name, value in values.items()}


def write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write rows as Parquet."""
    pyarrow, parquet = arrow()
    columns = sorted({name for row in rows for name in row}, key=lambda name: (name != "index", name))
    table = pyarrow.table({name: [row.get(name) for row in rows] for name in columns})
    with written(path) as partial:
        parquet.write_table(table, partial)


def rows_of(path: Path, columns: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return the rows of a table, with these columns (default: all) as far as it has them.

    Raises
    ------
    OutputError
        If the file is damaged.
    """
    try:
        with arrow()[1].ParquetFile(path) as file:
            known = [name for name in file.schema_arrow.names if not columns or name in columns]
            return list(file.read(known).to_pylist())
    except MissingPackageError:
        raise
    except Exception as problem:  # whatever a damaged file provokes
        raise _damaged(path, f"no Parquet table that can be read ({type(problem).__name__})") from None


def read_table(folder: Path, columns: tuple[str, ...]) -> dict[str, list[Any]]:
    """Return columns of the tables of all shards of a set, in order of the samples; None where a row lacks one."""
    rows = [row for path in sorted((folder / "index").glob("shard-*.parquet")) for row in rows_of(path, columns)]
    return {name: [row.get(name) for row in rows] for name in columns}


def _damaged(path: Path, what: str) -> OutputError:
    shard = f"{path.name.partition('.')[0]}.tar"
    return OutputError(f"{path.name} is {what}, as after a copy that broke off. Remove it and {shard}, and run again.")


def arrow() -> tuple[Any, Any]:
    """Return the modules that write tables.

    Raises
    ------
    MissingPackageError
        Without pyarrow.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise missing_package("data sets need", "pyarrow", "dataset") from None
    return pyarrow, pyarrow.parquet


def read_state(folder: Path) -> State:
    """Return what a folder says about the set in it."""
    try:
        return msgspec.json.decode((folder / STATE).read_bytes(), type=State)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        raise OutputError(f"{str(folder)!r} holds no data set: {STATE} is missing or damaged.") from None


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
    state = read_state(folder)
    spec, same = Spec.of(state.spec, folder), state.code == code_digest()
    shards = shards_of(state.count, spec.shard)
    changed = same and spec.digest != state.digest
    known = {path for shard in shards for path in shard.paths(folder)}
    extra = {*folder.glob("shard-*.tar"), *folder.glob("index/[!.]*")} - known
    problems = ["its specification is not that of the set"] if changed else []
    yield STATE, problems + [f"{path.name} is no shard or table of the set" for path in sorted(extra)]
    for shard in shards:
        yield f"{shard.name}.tar", _problems(shard, folder, spec, state.digest)
    if remade:
        other = f"the set was made by other code ({state.code}; this is {code_digest()}): they cannot be compared"
        yield "samples made again", _differences(spec, folder, state.count, remade) if same else [other]


def _problems(shard: Shard, folder: Path, spec: Spec, digest: str) -> list[str]:
    """What is wrong with a shard and its table, for each picture."""
    archive, table = shard.paths(folder)
    missing = [path.name for path in (archive, table) if not path.is_file()]
    if missing:
        return [f"{name} is missing" for name in missing]
    try:
        failed, rows = failed_in(archive), rows_of(table)
    except OutputError as problem:
        return [str(problem)]
    frames = range(spec.clip.frames) if spec.clip.frames > 1 else [None]
    there = sorted(failed & {row.get("index") for row in rows})
    problems = [f"{archive.with_suffix(FAILED).name} lists {key_of(i)}, which its table has" for i in there]
    absent = failed - {*there}
    wanted = [key_of(i, frame) for i in range(shard.first, shard.last) if i not in absent for frame in frames]
    by_key = {str(row.get("key")): row for row in rows}
    found: list[str] = []
    try:
        for key, files in stored(archive):
            found.append(key)
            if key in by_key and (fault := _fault(files, by_key[key], archive.name, digest)):
                problems.append(f"{key} {fault}")
    except (OSError, EOFError, ValueError, tarfile.TarError) as problem:
        problems.append(f"is damaged after {found[-1] if found else 'its start'}: {problem}")
    for where, keys in (("the shard", found), ("its table", [str(row.get("key")) for row in rows])):
        lines = unified_diff(wanted, keys, n=0, lineterm="")
        changes = [line for line in lines if not line.startswith(("---", "+++", "@@"))]
        if changes:
            problems.append(f"{where} lacks (-), or has once too often or elsewhere (+): {', '.join(changes)}")
    return problems


def _fault(files: list[tuple[str, bytes]], row: dict[str, Any], shard: str, digest: str) -> str:
    """Return what is wrong with a picture, in words; nothing if all is well."""
    if sha256_of(files) != row.get("sha256"):
        return f"is not what was made: its files ({', '.join(ending for ending, _ in files)}) have another SHA-256"
    facts = json.loads(dict(files)["json"])  # as they were written
    if facts["spec"] != digest:
        return "is of another set"
    due = row_of(facts) | {"shard": shard, "sha256": row["sha256"]}
    wrong = sorted(name for name in {*row, *due} if row.get(name) != due.get(name))
    return f"has another {', '.join(wrong)} in the table than in its facts" if wrong else ""


def _differences(spec: Spec, folder: Path, count: int, remade: int) -> list[str]:
    """Return which of some samples, made again, are not as they are stored."""
    try:
        table = read_table(folder, ("index", "key", "sha256"))
    except OutputError:
        return ["a table is damaged: they cannot be compared"]
    known = dict(zip(table["key"], table["sha256"], strict=True))
    chosen = {round(k) for k in np.linspace(0, count - 1, remade)} & {*table["index"]}
    problems = []
    with SampleMaker(spec) as maker:
        for index in sorted(chosen):
            if any(sha256_of(made.files().items()) != known.get(made.key) for made in maker.pictures(index)):
                problems.append(f"{index:09d} differs from what is stored")
    return problems
