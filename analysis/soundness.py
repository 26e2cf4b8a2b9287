"""Soundness of the skin in random sequences of contraction: no fault in any frame, on any face.

    python -m analysis.soundness [--count 40] [--faces head --faces ict-3] [--workers 2]

A run that was stopped goes on where it was. A sequence with a fault is played again, frame by frame, by

    python -m analysis.soundness --replay head-1 17
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

import facewrinkle as fw
from facewrinkle.export import output_folder
from facewrinkle.plotting import Scene, Style, save_picture

from .report import COLOURS, OUTPUT, Plot, Report, Table, plot, publish, run
from .sequences import sequence
from .subjects import names, subject
from .trials import EVERY_SIMULATED, LIMITS, RECORDED, Player, can_wrinkle

Record = dict[str, Any]

AT_ONCE = 2
"""Sequences of a face that a worker plays before it tells of them."""


def code() -> str:
    """Return a digest of the package's and this analysis's source: other code is another measurement."""
    digest, root = hashlib.sha256(), Path(__file__).parents[1]
    files = [path for folder in ("facewrinkle", "analysis") for path in (root / folder).rglob("*")]
    for path in sorted(files):
        if path.suffix in (".py", ".toml", ".json"):
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def player(name: str, seed: int) -> tuple[Player, bool]:
    """Return the player of a face, and True if the face can wrinkle; they are kept."""
    face = subject(name, seed)
    return Player(face), can_wrinkle(face)


def play(name: str, seed: int, index: int) -> Record:
    """Play one sequence, and return its record."""
    on, wrinkles = player(name, seed)
    begin, simulated = time.process_time(), wrinkles and index % EVERY_SIMULATED == EVERY_SIMULATED - 1
    trial = on.play(sequence(on.face, seed, name, index), simulated)
    return {
        "face": name, "index": index, "seed": seed, "frames": len(trial.largest), "simulated": simulated,
        "failed": {kind: count for kind, count in trial.failed().items() if count}, "worst": trial.worst(),
        "recorded": {kind: count for kind, count in trial.recorded().items() if count},
        "seconds": time.process_time() - begin,
    }  # fmt: skip


def read_records(path: Path, seed: int, digest: str) -> list[Record]:
    """Return the records in a file that the same code has made from the same seed; a line that is torn is left out."""
    found = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            continue
        if record.get("seed") == seed and record.get("code") == digest:
            found.append(record)
    return found


def play_all(path: Path, faces: Sequence[str], count: int, seed: int = 0, workers: int = 1) -> list[Record]:
    """Play the first `count` sequences of each face that are not in the file yet, add them to it, and return all."""
    digest = code()
    records = read_records(path, seed, digest)
    done = {(record["face"], record["index"]) for record in records}
    tasks = []
    for first in range(0, count, AT_ONCE):
        for name in faces:
            left = [k for k in range(first, min(first + AT_ONCE, count)) if (name, k) not in done]
            tasks += [(name, seed, left)] if left else []
    with path.open("a+", encoding="utf-8") as file, _progress() as bar:
        file.seek(0)
        text = file.read()
        file.write("\n" if text and not text.endswith("\n") else "")
        shown = bar.add_task("Sequences", total=len(faces) * count, completed=len(faces) * count - _left(tasks))
        for played in _played(tasks, workers):
            for record in played:
                records.append({**record, "code": digest})
                file.write(json.dumps(records[-1]) + "\n")
            file.flush()
            bar.advance(shown, len(played))
    return records


def _left(tasks: Iterable[tuple[str, int, list[int]]]) -> int:
    return sum(len(left) for _, _, left in tasks)


def _progress() -> Progress:
    return Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("left"),
        TimeRemainingColumn(),
    )  # fmt: skip


def _played(tasks: list[tuple[str, int, list[int]]], workers: int) -> Iterator[list[Record]]:
    """Yield the records of tasks, in the order in which they are done."""
    if workers <= 1:
        yield from map(_play_some, tasks)
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield from pool.imap_unordered(_play_some, tasks)


def _play_some(task: tuple[str, int, list[int]]) -> list[Record]:
    name, seed, left = task
    return [play(name, seed, index) for index in left]


def report(records: Sequence[Record]) -> Report:
    """Return the report on some sequences."""
    faces = list(dict.fromkeys(record["face"] for record in sorted(records, key=lambda r: r["face"])))
    groups = {name: [r for r in records if r["face"] == name] for name in faces} | {"all": list(records)}
    kinds = list(LIMITS)
    failures = [
        (name, len(some), sum(r["frames"] for r in some), *(sum(r["failed"].get(k, 0) for r in some) for k in kinds))
        for name, some in groups.items()
    ]
    worst = _largest(records, "failed", LIMITS)
    beside = _largest(records, "recorded", dict.fromkeys(RECORDED, 0.0))
    frames = sum(r["frames"] for r in records)
    sound = sum(not r["failed"] for r in records)
    seconds = sum(r["seconds"] for r in records)
    return Report(
        "soundness",
        "Soundness of the skin",
        "Random sequences of contraction rates on several faces, with jumps, ramps, holds and releases. In every frame "
        "no triangle may turn over, no skin be deeper than 0.1 mm in eyes, teeth, the other lip or the other lid, no "
        "vertex go far off its way, and no energy be gained at held rates; a release ends exactly at rest.",
        f"{sound} of {len(records)} sequences ({frames:,} frames, {1e3 * seconds / max(frames, 1):.1f} ms each) are "
        "without a fault.",
        [
            Table("Frames with faults", ("face", "sequences", "frames", *kinds), failures),
            Table("The worst", ("fault", "sequences", "frames", "largest", "face", "index", "frame"), worst),
            Table("Not judged", ("value", "sequences", "frames", "largest", "face", "index", "frame"), beside),
        ],
        [Plot("faults", _figure(records), "Sequences with each kind of fault, and the largest depths in them.")],
        {"sequences": len(records), "sound": sound, "frames": frames, "seconds": seconds},
    )  # fmt: skip


def _largest(records: Sequence[Record], counted: str, limits: Mapping[str, float]) -> list[tuple[Any, ...]]:
    """Rows of the largest values above their limits: sequences and frames `counted`, value, face, index, frame."""
    rows: list[tuple[Any, ...]] = []
    for kind, limit in limits.items():
        most = max(records, key=lambda r: r["worst"][kind][0], default=None)
        if most is not None and most["worst"][kind][0] > limit:
            value, frame = most["worst"][kind]
            counts = [r[counted][kind] for r in records if kind in r[counted]]
            rows.append((kind, len(counts), sum(counts), value, most["face"], most["index"], frame))
    return rows


def _figure(records: Sequence[Record]) -> Figure:
    figure, axes = plot(1, 2, (11.0, 3.6))
    counts = [sum(kind in r["failed"] for r in records) for kind in LIMITS]
    axes[0].barh(list(LIMITS), counts, color=COLOURS[0])
    axes[0].invert_yaxis()
    axes[0].set(xlabel="sequences with a fault")
    for k, kind in enumerate(("eyes", "lips", "lids", "teeth")):
        depths = np.sort([r["worst"][kind][0] for r in records])[::-1]
        axes[1].plot(np.arange(1, len(depths) + 1), depths, color=COLOURS[k], label=kind)
    axes[1].axhline(LIMITS["eyes"], color=COLOURS[5], linestyle="--", linewidth=1)
    axes[1].set(xlabel="sequences, the deepest first", ylabel="depth (mm)", yscale="symlog")
    axes[1].legend(fontsize=7, frameon=False)
    return figure


def replay(name: str, index: int, seed: int, out: Path) -> None:
    """Print the values of each frame of a sequence, and draw the worst frame of each kind of fault."""
    on, wrinkles = player(name, seed)
    played = sequence(on.face, seed, name, index)
    simulated = wrinkles and index % EVERY_SIMULATED == EVERY_SIMULATED - 1
    worst = on.play(played, simulated)
    limits = LIMITS | dict.fromkeys(RECORDED, np.inf)
    print(f"{name}, sequence {index} of seed {seed}" + (", with wrinkles" if simulated else ""))
    print("frame  muscles  rates  largest  " + "  ".join(limits))
    for f, largest in enumerate(worst.largest):
        rates = played.rates[f]
        change = "change" if f == 0 or not np.array_equal(rates, played.rates[f - 1]) else "held  "
        cells = "  ".join(
            f"{worst.values[kind][f]:{len(kind)}.3g}" + ("!" if worst.values[kind][f] > limit else "")
            for kind, limit in limits.items()
        )
        print(f"{f:5d}  {int((rates > 0.0).sum()):7d}  {change} {largest:7.2f}  {cells}")
    frames = {frame: kind for kind, (value, frame) in worst.worst().items() if value > limits[kind]}
    for f, _ in enumerate(on.frames(played, simulated)):
        if f not in frames:
            continue
        rates = {m: round(float(r), 3) for m, r in zip(on.face.muscles, played.rates[f], strict=True) if r > 0.0}
        path = output_folder(out) / f"soundness_{name}_{index}_{f}.png"
        draw(on.face, on.positions, path)
        print(f"{path}: {frames[f]}, frame {f}, {rates}")


def draw(face: fw.Face, points: np.ndarray, path: Path) -> None:
    """Draw a face with its skin at positions (n, 3), mm, from the front and from the side."""
    shown = face.mesh.copy()
    shown.points = points / face.unit
    shown.point_data.pop("Normals", None)
    pictures = []
    for view in ("front", "left_profile"):
        with Scene(face, Style(size=(700, 800), view=view, quick=True)) as scene:
            pictures.append(scene.picture(shown))
    save_picture(np.hstack(pictures), path)


def main(
    *,
    count: int = 40,
    faces: list[str] | None = None,
    workers: int = 1,
    seed: int = 0,
    replay: tuple[str, int] | None = None,
    out: Path = OUTPUT,
) -> None:
    """Check that random sequences of contraction keep the skin sound.

    Parameters
    ----------
    count
        Sequences on each face, of some 200 frames each.
    faces
        Names of faces, or what these begin with. Default: all.
    workers
        Processes.
    seed
        Of the random people and sequences.
    replay
        Play one sequence again, given the name of the face and the sequence's number; print each frame and draw the
        worst.
    out
        Folder for soundness.jsonl, which a later run continues, soundness.json, the plot and the index page.
    """
    if replay is not None:
        return _replay(*replay, seed, out)
    chosen = [name for name in names() if faces is None or name.startswith(tuple(faces))]
    if not chosen:
        raise SystemExit(f"No face is named so: {faces}. Names are {', '.join(names())}.")
    publish(report(play_all(output_folder(out) / "soundness.jsonl", chosen, count, seed, workers)), out)


_replay = replay

if __name__ == "__main__":
    run(main)
