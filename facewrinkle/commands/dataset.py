"""``facewrinkle dataset``: labeled pictures of faces by the hundred thousand."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import OutputError, ParameterError
from ..plotting.images import save_picture, side_by_side, stacked
from .options import Report, Whole

if TYPE_CHECKING:
    from ..dataset import Spec


def dataset(
    what: str | None = None,
    folder: Path | None = None,
    /,
    *,
    out: Path | None = None,
    count: Whole = 1000,
    workers: Whole = 1,
    scheduler: str | None = None,
    preview: bool = False,
    quiet: bool = False,
) -> None:
    """Generate labeled pictures of faces, or complete a data set that was interrupted.

    Parameters
    ----------
    what
        A specification, a TOML file (default: the built-in one); or "spec" to print the built-in one, to edit; or
        "check" to check the set in a folder.
    folder
        With check: the folder of the set.
    out
        Folder of the set: a new one, or one with part of the set. Default: dataset.
    count
        Number of samples.
    workers
        Number of processes.
    scheduler
        Address of a Dask scheduler whose workers see the same folder, such as tcp://10.0.0.1:8786.
    preview
        Only draw 24 people into OUT.png, in a minute or two, before the long run.
    quiet
        Print only errors.
    """
    from ..dataset import Spec, generate  # which take a while to load; --help needs none
    from ..dataset.shards import read_table
    from ..dataset.spec import DEFAULT

    report = Report(quiet)
    if folder is not None and what != "check":
        raise ParameterError(f"a folder is named with check only, or by --out; received {str(folder)!r}.")
    if what == "spec":
        sys.stdout.write(DEFAULT.read_text(encoding="utf-8"))
        return
    if what == "check":
        _check(folder, report)
        return
    spec = Spec.of() if what is None else Spec.read(what)
    where = Path("dataset") if out is None else out
    if preview:
        if where.name in ("", ".."):
            raise ParameterError(f"--out must name the folder of the set, received {str(where)!r}.")
        report.say(f"{_preview(spec, where.with_name(where.name + '.png'), report)}")
        return
    generate(spec, where, count=count, workers=workers, scheduler=scheduler, progress=report.progress)
    table = read_table(where, ("index", "attempt"))
    attempts, missing = table["attempt"], count - len({*table["index"]})
    again = sum(map(bool, attempts))
    report.say(
        f"{where}: {len(attempts)} pictures of {count} samples; README.md there tells what is in them."
        + (f" {again} were drawn anew, as the first draw was not fit." if again else "")
    )
    if missing:
        raise OutputError(f"{missing} of {count} samples are missing in {str(where)!r}; the note says why.")


def _preview(spec: Spec, path: Path, report: Report) -> Path:
    from ..dataset import preview

    rows, columns = 4, 6
    samples = report.progress(preview(spec, rows * columns), "Drawing", rows * columns)
    images = [sample.image for sample in samples]
    return save_picture(stacked([side_by_side(images[k * columns : (k + 1) * columns]) for k in range(rows)]), path)


def _check(folder: Path | None, report: Report) -> None:
    """Print what is wrong with a set; raise an error if anything is."""
    from ..dataset import check

    if folder is None:
        raise ParameterError("name the folder of the set: facewrinkle dataset check FOLDER.")
    problems = []
    with report.waiting("Checking"):
        for name, found in check(folder):
            problems += [f"{name}: {problem}" for problem in found]
    for problem in problems:
        report.say(problem)
    if problems:
        raise OutputError(
            f"{str(folder)!r} has {len(problems)} problems. Remove the shards that are named, with their tables "
            "in index/, and run the same again."
        )
    report.say(f"{folder}: all is well.")
