"""A folder against what it says: files against their hashes, rows against files, and some samples made again."""

from __future__ import annotations

import json
import tarfile
from collections.abc import Iterator
from difflib import unified_diff
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import OutputError, check_whole
from .card import read_table
from .generation import STATE, read_state
from .sample import SampleMaker, key_of
from .shards import Shard, failed_in, row_of, rows_of, sha256_of, shards_of, stored
from .spec import Spec, code_digest


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
    wanted = [key_of(i, frame) for i in range(shard.first, shard.last) if i not in failed for frame in frames]
    by_key = {str(row.get("key")): row for row in rows}
    found: list[str] = []
    problems = []
    try:
        for key, files in stored(archive):
            found.append(key)
            if key in by_key and (fault := _fault(files, by_key[key], archive.name, digest)):
                problems.append(f"{key} {fault}")
    except (OSError, EOFError, ValueError, tarfile.TarError) as problem:
        problems.append(f"cannot be read after {found[-1] if found else 'its start'} ({type(problem).__name__})")
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
