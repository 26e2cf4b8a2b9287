"""A folder against what it says: shards are read, counted, and some samples made again and compared."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .. import __version__
from ..errors import check_whole
from .card import read_table
from .generation import read_state
from .sample import SampleMaker, key_of
from .shards import FAILED, Shard, arrow, shards_of
from .spec import Spec

ENDINGS = ("json", "npz", "png")
"""Endings of the files of a picture; with meshes, one more."""


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
    [('shard-000000.tar', []), ('samples made again', [])]
    """
    folder, remade = Path(folder).expanduser(), check_whole("remade", remade, 0, 1e6)
    state = read_state(folder)
    spec = Spec.of(state["spec"], folder)
    for shard in shards_of(state["count"], spec.shard):
        yield f"{shard.name}.tar", _problems(shard, folder, spec)
    if remade:
        yield "samples made again", _differences(spec, folder, state["count"], remade, state["version"])


def _problems(shard: Shard, folder: Path, spec: Spec) -> list[str]:
    archive, table = shard.paths(folder)
    missing = [path.name for path in (archive, table) if not path.is_file()]
    if missing:
        return [f"{name} is missing" for name in missing]
    failures = archive.with_suffix(FAILED)
    failed = (
        {entry["index"] for entry in json.loads(failures.read_text(encoding="utf-8"))} if failures.is_file() else set()
    )
    frames: list[int | None] = [None] if spec.clip.frames == 1 else list(range(spec.clip.frames))
    wanted = [key_of(i, frame) for i in range(shard.first, shard.last) if i not in failed for frame in frames]
    try:
        found = _members(archive)
        rows = [key for key in read_table_of(table) if key is not None]
    except Exception as problem:  # whatever a damaged file provokes
        return [f"cannot be read: {type(problem).__name__}: {problem}"]
    problems = []
    if sorted(found) != wanted:
        problems.append(f"holds {len(found)} pictures of {len(wanted)}")
    if rows != wanted:
        problems.append(f"its table has {len(rows)} rows for {len(wanted)} pictures")
    problems += [f"{key}: {what}" for key, files in found.items() if (what := _damage(files, spec))]
    return problems


def read_table_of(path: Path) -> list[str]:
    """Return the keys of the samples in the table of a shard."""
    keys: list[str] = arrow()[1].read_table(path, columns=["key"])["key"].to_pylist()
    return keys


def _members(archive: Path, index: int | None = None) -> dict[str, dict[str, bytes]]:
    """The files of a shard, or those of one sample, by key and ending."""
    found: dict[str, dict[str, bytes]] = {}
    with tarfile.open(archive) as tar:
        for member in tar:
            key, _, ending = member.name.partition(".")
            if index is not None and not key.startswith(key_of(index)):
                continue
            file = tar.extractfile(member)
            found.setdefault(key, {})[ending] = file.read() if file is not None else b""
    return found


def _damage(files: dict[str, bytes], spec: Spec) -> str:
    """Return what is wrong with the files of a sample, in words; nothing if all is well."""
    from PIL import Image

    endings = sorted([*ENDINGS, *([f"mesh.{spec.mesh}"] if spec.mesh else [])])
    if sorted(files) != endings:
        return f"has {sorted(files)} in place of {endings}"
    try:
        width, height = json.loads(files["json"])["size"]
        with Image.open(io.BytesIO(files["png"])) as picture:
            picture.load()
            sizes = {picture.size[::-1]}
        with np.load(io.BytesIO(files["npz"]), allow_pickle=False) as arrays:
            sizes |= {arrays[name].shape[:2] for name in arrays.files}
    except Exception as problem:
        return f"{type(problem).__name__}: {problem}"
    return "" if sizes == {(height, width)} else f"has sizes {sizes}"


def _differences(spec: Spec, folder: Path, count: int, remade: int, version: str) -> list[str]:
    if version != __version__:
        return [f"the set was made by version {version}, this is {__version__}: samples cannot be compared"]
    known = set(read_table(folder, ("index",))["index"])
    problems = []
    with SampleMaker(spec) as maker:
        for index in sorted({round(k) for k in np.linspace(0, count - 1, remade)} & known):
            archive = folder / f"shard-{index // spec.shard:06d}.tar"
            try:
                stored = _members(archive, index)
            except (OSError, tarfile.TarError):
                stored = {}
            if {sample.key: sample.files() for sample in maker.pictures(index)} != stored:
                problems.append(f"{index:09d} differs from what is stored")
    return problems
