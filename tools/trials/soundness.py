"""Soundness of the skin in random sequences of contraction: no fault in any frame, on any face."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import facewrinkle as fw
from analysis.report import Report, Table, publish
from analysis.subjects import names, subject
from facewrinkle.export import output_folder
from facewrinkle.plotting import Scene, Style, save_picture

from .player import EVERY_SIMULATED, LIMITS, RECORDED, Player, can_wrinkle
from .runner import DIED, OUTPUT, run
from .sequences import sequence

Record = dict[str, Any]


@cache
def player(name: str, seed: int) -> tuple[Player, bool]:
    """Return the player of a face, and True if the face can wrinkle; they are kept."""
    face = subject(name, seed)
    return Player(face), can_wrinkle(face)


def play(seed: int, name: str, index: int) -> Record:
    """Play one sequence, and return its record."""
    on, wrinkles = player(name, seed)
    begin, simulated = time.process_time(), wrinkles and index % EVERY_SIMULATED == EVERY_SIMULATED - 1
    trial = on.play(sequence(on.face, seed, name, index), simulated)
    return {
        "face": name, "index": index, "frames": len(trial.largest), "simulated": simulated,
        "failed": {kind: count for kind, count in trial.failed().items() if count}, "worst": trial.worst(),
        "recorded": {kind: count for kind, count in trial.recorded().items() if count},
        "seconds": time.process_time() - begin,
    }  # fmt: skip


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
        numbers={"sequences": len(records), "sound": sound, "frames": frames, "seconds": seconds},
    )


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


def soundness(
    *,
    count: int = 40,
    faces: list[str] | None = None,
    workers: int = 1,
    minutes: float = np.inf,
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
    minutes
        Time after which no sequence is begun.
    seed
        Of the random people and sequences.
    replay
        Play one sequence again, given the name of the face and the sequence's number; print each frame and draw the
        worst.
    out
        Folder for soundness.jsonl, which a later run continues, and soundness.json.
    """
    if replay is not None:
        return _replay(*replay, seed, out)
    chosen = [name for name in names() if faces is None or name.startswith(tuple(faces))]
    if not chosen:
        raise SystemExit(f"No face is named so: {faces}. Names are {', '.join(names())}.")
    cases = [(seed, name, index) for index in range(count) for name in chosen]
    outcomes = run(output_folder(out) / "soundness.jsonl", play, cases, workers=workers, minutes=minutes)
    for case, outcome in outcomes.items():
        if outcome == DIED:
            print(f"{case}: {DIED}")
    publish(report([outcome for outcome in outcomes.values() if outcome != DIED]), out)


_replay = replay
