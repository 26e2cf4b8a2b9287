"""Mutated files for all readers: each must be refused with an error of this package, or read as a good mesh.

    python -m analysis.fuzzing .obj --minutes 60

Files are read in a process beside this one, with 2 GB of memory, each within ten seconds; one that fails is read once
more in a process of its own before it counts. The seeds are small files that the package and its libraries write;
what fails is kept in ``output/fuzzing``. A run goes on where the last one stopped. Animations, takes, landmarks,
sessions and specs have names of their own: ``clip.glb``, ``take.csv`` and so on.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS, Atlas
from facewrinkle.anatomy.landmarks import NAMES, read_landmarks
from facewrinkle.dataset.spec import Spec
from facewrinkle.errors import FaceWrinkleError
from facewrinkle.export.gltf import gltf
from facewrinkle.export.model import Morphs, WeightTrack, skin_model
from facewrinkle.live.document import Document

MEMORY, SECONDS = 2 * 2**30, 10

PER_CHILD = 500
"""Files that a process reads before the next one takes over."""

DIED = "the process died of it, or it took too long"

TEXTS: dict[str, tuple[str, ...]] = {
    "take.csv": (
        "Timecode,BlendShapeCount,JawOpen,MouthSmileLeft,HeadYaw,HeadPitch,HeadRoll\n"
        + "".join(f"00:00:01:{n:02}.000,61,{0.1 * n:.3f},0.25,0.01,-0.02,0.0\n" for n in range(9)),
        "time\tAU12_r\tAU04_r\n0.0\t0.5\t1.5\n0.1\t4.5\t0.0\n",
    ),
    "take.json": (
        json.dumps([{"timestamp": 0.1 * n, "jawOpen": 0.1 * n, "browInnerUp": 0.5} for n in range(5)]),
        json.dumps(
            {
                "faceBlendshapes": [
                    [
                        {
                            "categories": [
                                {"categoryName": "jawOpen", "score": 0.3},
                                {"categoryName": "_neutral", "score": 0},
                            ]
                        }
                    ]
                ]
                * 3
            }
        ),
        json.dumps({"jawOpen": [0.0, 0.5, 1.0], "mouthPucker": [0.0, 0.1, 0.2]}),
    ),
    "spec.toml": (
        "seed = 7\nsize = [256, 256]\n[identity]\nage = { normal = [0.4, 0.2], within = [0.0, 1.0] }\n",
        "[gaze]\nyaw = [-30.0, 30.0]\n[clip]\nframes = 4\n[folds]\n",
    ),
    "landmarks.json": (
        json.dumps({name: [1.0, 2.0, 3.0] for name in NAMES}),
        json.dumps({"landmarks": {name: {"xyz": [0.0, 1.5, -2.0], "found": [0.0, 1.5, -2.0]} for name in NAMES[:6]}}),
    ),
    "session.json": (
        json.dumps(
            {
                "facewrinkle session": 1,
                "mixture": {"AU12": 0.7},
                "gaze": [5.0, 0.0],
                "identity": {"nose_width": 0.2},
                "timeline": {
                    "length": 2.0,
                    "loop": True,
                    "keys": {"a": {"unit": "AU4", "weight": 1.0, "onset": 0.1, "apex": 0.5, "offset": 1.0, "end": 1.5}},
                },
            }
        ),
    ),
}
"""Small good files of text, by their names."""


@lru_cache(maxsize=1)
def _atlas() -> Atlas:
    return fw.read_atlas(DEFAULT_ATLAS)


READERS: dict[str, Callable[[Path], object]] = {
    **dict.fromkeys((".obj", ".off", ".ply", ".stl", ".glb", ".gltf", ".usda", ".usdc"), fw.read_surface),
    **dict.fromkeys((".vtk", ".vtp", ".vtu", ".vtm", ".vtkhdf"), fw.read_surface),
    **dict.fromkeys(("clip.glb", "clip.vtkhdf", "clip.usda"), fw.read_animation),
    **dict.fromkeys(("take.csv", "take.json"), fw.read_take),
    ".face": fw.read_face,
    ".toml": fw.read_atlas,
    "spec.toml": Spec.read,
    "landmarks.json": read_landmarks,
    "session.json": lambda path: Document(_atlas()).load(path.read_text(encoding="utf-8", errors="replace")),
}
"""Readers of files: by their ending, or by their whole name where an ending has several."""

WORDS = (
    b"0",
    b"-1",
    b"nan",
    b"inf",
    b"1e309",
    b"99999999999",
    b"2147483648",
    b"4294967295",
    b"\0",
    b"\xff\xff\xff\xff",
)


@lru_cache(maxsize=1)
def _ball() -> pv.PolyData:
    ball = pv.Icosphere(nsub=1)
    ball.point_data["W"] = np.linspace(0.0, 1.0, ball.n_points)
    return ball


def file_name(kind: str) -> str:
    """Return the name of a file that is read as a key of :data:`READERS` says."""
    return f"mutant{kind}" if kind.startswith(".") else kind


def seeds(folder: Path, kind: str) -> list[bytes]:
    """Return small good files of a kind; `folder` is for temporary ones."""
    ball, path = _ball(), folder / f"seed{kind}"
    match kind:
        case ".obj" | ".ply" | ".glb" | ".gltf":
            return [fw.write_mesh(ball, path).read_bytes()]
        case ".stl":
            return [_saved(ball, path, binary=binary) for binary in (True, False)]
        case ".vtk":
            return [_saved(ball, path, binary=binary) for binary in (True, False)]
        case ".vtp":
            return [_saved(ball, path)]
        case ".vtu":
            return [_saved(ball.cast_to_unstructured_grid(), path)]
        case ".vtm":
            return [_saved(pv.MultiBlock([ball]), path)]
        case ".vtkhdf":
            return [fw.export.write_series([ball, ball], [0.0, 1.0], path).read_bytes()]
        case ".off":
            rows = [" ".join(map(str, row)) for row in ball.points.tolist()]
            rows += [f"3 {a} {b} {c}" for a, b, c in ball.regular_faces.tolist()]
            return [f"OFF\n{ball.n_points} {ball.n_cells} 0\n".encode() + "\n".join(rows).encode()]
        case ".usda" | ".usdc":
            return [_usd(ball, path)]
        case ".face":
            return [fw.write_face(fw.default_face(), path).read_bytes()]
        case ".toml":
            return [DEFAULT_ATLAS.read_bytes()]
        case "clip.glb":
            return [_animated(ball)]
        case "clip.vtkhdf":
            return seeds(folder, ".vtkhdf")
        case "clip.usda":
            return [_usd(ball, folder / "seed.usda", times=(0.0, 12.0))]
        case _:
            return [seed.encode() for seed in TEXTS[kind]]


def _saved(mesh: pv.DataObject, path: Path, **options: bool) -> bytes:
    mesh.save(path, **options)
    return path.read_bytes()


def _animated(ball: pv.PolyData) -> bytes:
    ways = np.stack([0.1 * ball.points, 0.1 * ball.point_normals]).astype(np.float32)
    shapes = Morphs(("jawOpen", "mouthSmileLeft"), ways, np.zeros_like(ways))
    track = WeightTrack(np.array([0.0, 0.5, 1.0]), np.array([[0.0, 0.0], [1.0, 0.2], [0.1, 0.9]]))
    return gltf({"ball": skin_model(ball, None)}, 1.0, binary=True, morphs={"ball": shapes}, tracks={"ball": track})


def _usd(ball: pv.PolyData, path: Path, times: Sequence[float] = ()) -> bytes:
    from pxr import Usd, UsdGeom

    path.unlink(missing_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    mesh = UsdGeom.Mesh.Define(stage, "/ball")
    points = mesh.CreatePointsAttr(ball.points.tolist())
    for moment in times:
        points.Set(((1.0 + 0.01 * moment) * ball.points).tolist(), moment)
    mesh.CreateFaceVertexCountsAttr([3] * ball.n_cells)
    mesh.CreateFaceVertexIndicesAttr(ball.regular_faces.ravel().tolist())
    stage.GetRootLayer().Save()
    return path.read_bytes()


def mutated(seed: bytes, generator: np.random.Generator) -> bytes:
    """Return a file with a few changes: bits, bytes, numbers, pieces cut out, doubled or moved, and ends cut off."""
    data = bytearray(seed)
    for _ in range(int(generator.integers(1, 6))):
        n = max(len(data), 1)
        at = int(generator.integers(min(n, 400) if generator.random() < 0.5 else n))  # headers are short
        length = int(generator.integers(1, 1 + min(64, n)))
        match int(generator.integers(7)):
            case 0:
                data[at : at + 1] = bytes([int(generator.integers(256))])
            case 1:
                data[at : at + 4] = generator.bytes(4)
            case 2:
                data[at : at + length] = WORDS[int(generator.integers(len(WORDS)))]
            case 3:
                del data[at : at + length]
            case 4:
                data[at:at] = data[at : at + length]
            case 5:
                other = int(generator.integers(n))
                data[at : at + length] = data[other : other + length]
            case _:
                if generator.random() < 0.3:
                    del data[at:]
    return bytes(data)


def outcome(path: Path) -> str:
    """Read a file in a process of its own: "read", "refused", or else what is wrong with the reader."""
    return next(outcomes([path]))


def outcomes(paths: Iterable[Path]) -> Iterator[str]:
    """Read files one after the other, in a process beside this one: yield as :func:`outcome` returns.

    A file may have been written just before its path comes: no more than one path is taken at a time.
    """
    pool, files = _pool(), 0
    try:
        for path in paths:
            if files == PER_CHILD:
                pool.shutdown()
                pool, files = _pool(), 0
            said = _said(pool, path)
            if said not in ("read", "refused") and files:  # what was read before may be the cause
                pool.shutdown()
                pool, files = _pool(), 0
                said = _said(pool, path)
            files += 1
            if said is DIED:
                pool.shutdown()
                pool, files = _pool(), 0
            yield said
    finally:
        pool.shutdown()


def _pool() -> ProcessPoolExecutor:
    """One process that begins as a copy of this one."""
    return ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("fork"), initializer=_limit)


def _said(pool: ProcessPoolExecutor, path: Path) -> str:
    """Read a file in the process of a pool, and return what came of it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of forking with threads: the process only reads
            return pool.submit(_timed, path).result()
    except BrokenProcessPool:
        return DIED


def _limit() -> None:
    """Limit the memory of this process, and let it die of the alarms that :func:`_timed` sets."""
    import resource

    for number in (signal.SIGALRM, signal.SIGPROF):
        signal.signal(number, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)


def _timed(path: Path) -> str:
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    signal.alarm(3 * SECONDS)  # a busy machine is slower; the processor's time is what counts
    said = _read(path)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    signal.alarm(0)
    return said


def _read(path: Path) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = (READERS.get(path.name) or READERS[path.suffix])(path)
        except FaceWrinkleError:
            return "refused"
        except BaseException as error:
            return f"raised {type(error).__name__}: {error}"
    if isinstance(found, pv.PolyData) and (found.n_cells == 0 or not found.is_all_triangles):
        return "read a mesh without triangles"
    return "read"


def main() -> None:
    """Mutate files for some minutes, and tell what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("kind", choices=sorted(READERS))
    parser.add_argument("--minutes", type=float, default=60.0)
    options = parser.parse_args()
    folder = Path("output") / "fuzzing" / options.kind.removeprefix(".")
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / "counts.json"
    counts = Counter(json.loads(table.read_text()) if table.exists() else {})
    end = time.monotonic() + 60.0 * options.minutes
    with tempfile.TemporaryDirectory() as scratch:
        path, found = Path(scratch) / file_name(options.kind), seeds(Path(scratch), options.kind)

        def mutants() -> Iterator[Path]:
            while time.monotonic() < end:
                number = counts["files"]
                path.write_bytes(mutated(found[number % len(found)], np.random.default_rng(number)))
                yield path

        for came in outcomes(mutants()):
            if came not in ("read", "refused"):
                path.rename(folder / f"{counts['files']}_{path.name}")
                print(counts["files"], came, flush=True)
            counts[came if came in ("read", "refused") else "failed"] += 1
            counts["files"] += 1
            if counts["files"] % 100 == 0 or time.monotonic() > end:
                table.write_text(json.dumps(counts))
    table.write_text(json.dumps(counts))
    print(options.kind, dict(counts), file=sys.stderr)


if __name__ == "__main__":
    main()
