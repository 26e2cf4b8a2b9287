"""Shards: files of consecutive samples, whole or absent, with a table of what is in them.

A shard is a tar file as WebDataset reads it; beside it is a Parquet file with a row for each sample. The same samples
give the same bytes: members have no times and owners.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import missing_package
from ..files import written
from .sample import Sample, SampleMaker
from .spec import Spec

FORMAT = tarfile.USTAR_FORMAT

FAILED = ".failed.json"
"""Ending of the file that lists samples of a shard that could not be made."""


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

    A sample that fails twice is listed with its error in a file beside the shard, and left out.
    """
    archive, table = shard.paths(folder)
    rows: list[dict[str, Any]] = []
    failures: list[dict[str, Any]] = []
    table.parent.mkdir(parents=True, exist_ok=True)
    with SampleMaker(spec) as maker, written(archive) as partial, tarfile.open(partial, "w", format=FORMAT) as tar:
        for index in range(shard.first, shard.last):
            for sample in _tried(maker, index, failures):
                rows.append(row_of(sample) | {"shard": archive.name})
                for ending, content in sample.files().items():
                    member = tarfile.TarInfo(f"{sample.key}.{ending}")
                    member.size = len(content)
                    tar.addfile(member, io.BytesIO(content))
            yield index
    archive.with_suffix(FAILED).unlink(missing_ok=True)  # of an earlier run
    if failures:
        with written(archive.with_suffix(FAILED)) as partial:
            Path(partial).write_text(json.dumps(failures, indent=1, sort_keys=True), encoding="utf-8")
    write_table(rows, table)


def _tried(maker: SampleMaker, index: int, failures: list[dict[str, Any]]) -> list[Sample]:
    for attempt in range(2):
        try:
            return maker.pictures(index)
        except Exception as problem:  # one sample must not stop a night's work
            if attempt:
                failures.append({"index": index, "error": f"{type(problem).__name__}: {problem}"})
    return []


def row_of(sample: Sample) -> dict[str, Any]:
    """Return what the table tells of a sample: numbers to search and to plot by."""
    facts = sample.facts
    plan, person = facts["plan"], facts["person"]
    row: dict[str, Any] = {"index": sample.index, "key": sample.key, "person": person["number"]}
    row["frame"] = 0 if sample.frame is None else sample.frame
    row["scan"] = -1 if person["scan"] is None else person["scan"]
    row["expression"] = json.dumps(plan["expression"], sort_keys=True)
    row["action_units"] = json.dumps(facts["action_units"], sort_keys=True)
    row["tears"] = plan["tears"] is not None
    row["attempt"] = plan["attempt"]
    row |= {f"identity_{name}": value for name, value in person["identity"].items()}
    row |= {f"gaze_{name}": value for name, value in plan["gaze"].items()}
    row |= {f"camera_{name}": value for name, value in plan["camera"].items()}
    row |= {f"light_{name}": value for name, value in plan["lights"].items()}
    row["furrows"] = len(facts["furrows"])
    row["deepest"] = max((furrow["depth"] for furrow in facts["furrows"]), default=0.0)
    row["visible_landmarks"] = sum(landmark["visible"] for landmark in facts["landmarks"].values())
    return row


def write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write rows as Parquet."""
    pyarrow, parquet = arrow()
    columns = sorted({name for row in rows for name in row}, key=lambda name: (name != "index", name))
    table = pyarrow.table({name: [row.get(name) for row in rows] for name in columns})
    with written(path) as partial:
        parquet.write_table(table, partial)


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
