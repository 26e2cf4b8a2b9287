"""Mutated files for all readers: each must be refused with an error of this package, or read as a good mesh.

The seeds are small files that the package and its libraries write. Animations, takes, landmarks, sessions and specs
have names of their own: ``clip.glb``, ``take.csv`` and so on.
"""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
import pyvista as pv
from PIL import Image

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS
from facewrinkle.anatomy.landmarks import NAMES, read_landmarks
from facewrinkle.dataset.spec import Spec
from facewrinkle.errors import FaceWrinkleError
from facewrinkle.export.gltf import gltf
from facewrinkle.export.model import Morphs, WeightTrack, skin_model
from facewrinkle.mesh.formats.radiance import radiance_of
from facewrinkle.mesh.formats.textures import image_of_file
from facewrinkle.session import Session

from .runner import OUTPUT, run

MEMORY, SECONDS = 2 * 2**30, 10
"""Memory, and time of the processor, that reading a file may take."""

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


READERS: dict[str, Callable[[Path], object]] = {
    **dict.fromkeys((".obj", ".off", ".ply", ".stl", ".glb", ".gltf", ".usda", ".usdc"), fw.read_surface),
    **dict.fromkeys((".vtk", ".vtp", ".vtm", ".vtkhdf"), fw.read_surface),
    **dict.fromkeys(("clip.glb", "clip.vtkhdf", "clip.usda"), fw.read_animation),
    **dict.fromkeys(("take.csv", "take.json"), fw.read_take),
    ".face": fw.read_face,
    "arrays.face": lambda path: fw.Simulation(fw.read_face(path)).step(),
    **dict.fromkeys((".png", ".jpg", ".gif", ".bmp", ".tif", ".webp"), image_of_file),
    ".hdr": lambda path: radiance_of(path.read_bytes(), path.name),
    ".toml": fw.read_atlas,
    "spec.toml": Spec.read,
    "landmarks.json": read_landmarks,
    "session.json": Session.read,
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


@cache
def _ball() -> pv.PolyData:
    ball = pv.Icosphere(nsub=1)
    ball.point_data["W"] = np.linspace(0.0, 1.0, ball.n_points)
    return ball


@cache
def seeds(kind: str) -> list[bytes]:
    """Return small good files of a kind."""
    with tempfile.TemporaryDirectory() as folder:
        return _seeds(Path(folder), kind)


def _seeds(folder: Path, kind: str) -> list[bytes]:
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
        case ".png" | ".jpg" | ".gif" | ".bmp" | ".tif" | ".webp":
            Image.fromarray(np.arange(24 * 32 * 3, dtype=np.uint8).reshape(24, 32, 3)).save(path)
            return [path.read_bytes()]
        case ".hdr":
            head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 16\n"
            row = bytes([2, 2, 0, 16]) + 3 * bytes([144, 200]) + bytes([8, *range(120, 128), 136, 129])
            return [head + 3 * row, head.replace(b"16", b"4") + bytes(range(100, 148))]
        case ".face" | "arrays.face":
            return [fw.write_face(fw.default_face(), path).read_bytes()]
        case ".toml":
            return [DEFAULT_ATLAS.read_bytes()]
        case "clip.glb":
            return [_animated(ball)]
        case "clip.vtkhdf":
            return _seeds(folder, ".vtkhdf")
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


@cache
def _limited() -> None:
    """Limit the memory of this process, and let it tell nothing; once."""
    import resource

    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)


def outcome(path: Path) -> str:
    """Read a file in a process of its own: return "read", "refused", or what is wrong with the reader."""
    _limited()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = (READERS.get(path.name) or READERS[path.suffix])(path)
        except FaceWrinkleError:
            return "refused"
        except MemoryError:
            os._exit(1)  # files before may have filled it
        except BaseException as error:
            return f"raised {type(error).__name__}: {error}"
    if isinstance(found, pv.PolyData) and (found.n_cells == 0 or not found.is_all_triangles):
        return "read a mesh without triangles"
    return "read"


def mutant(kind: str, number: int, folder: Path) -> Path:
    """Write one of the mutants of a kind into a folder, and return its path."""
    found, generator = seeds(kind), np.random.default_rng(number)
    path = folder / (f"mutant{kind}" if kind.startswith(".") else kind)
    if kind == "arrays.face":  # a zip tells when its bytes were changed; who makes one changes arrays
        with np.load(BytesIO(found[0])) as stored:
            arrays = dict(stored)
        name = sorted(arrays)[int(generator.integers(len(arrays)))]
        changed = mutated(arrays[name].tobytes(), generator)
        kind_of, size = arrays[name].dtype, max(arrays[name].dtype.itemsize, 1)
        flat = np.frombuffer(changed[: len(changed) // size * size], kind_of)
        arrays[name] = flat.reshape(arrays[name].shape) if flat.size == arrays[name].size else flat
        with path.open("wb") as file:
            np.savez(file, **arrays)
        return path
    path.write_bytes(mutated(found[number % len(found)], generator))
    return path


def play(kind: str, number: int) -> str:
    """Return the outcome of reading a mutant."""
    with tempfile.TemporaryDirectory() as scratch:
        return outcome(mutant(kind, number, Path(scratch)))


def fuzzing(
    kind: str = "all", /, *, count: int = 10000, workers: int = 1, minutes: float = np.inf, out: Path = OUTPUT
) -> None:
    """Read mutated files, and keep those that neither are refused nor become a mesh.

    Parameters
    ----------
    kind
        Ending of the files, such as .obj, or a name, such as clip.glb; or "all".
    count
        Files, of all kinds together.
    workers
        Processes.
    minutes
        Time after which no file is begun.
    out
        Folder for fuzzing/KIND.jsonl, which a later run continues, and for files beside it that make readers fail.
    """
    if kind not in (*READERS, "all"):
        raise SystemExit(f"No reader is tried with {kind}. Kinds are all, {', '.join(sorted(READERS))}.")
    folder, totals = out / "fuzzing", Counter[str]()
    kinds = sorted(READERS) if kind == "all" else [kind]
    for each in kinds:
        path = folder / f"{each.removeprefix('.')}.jsonl"
        cases = [(each, number) for number in range(-(-count // len(kinds)))]
        outcomes = run(path, play, cases, workers=workers, minutes=minutes, seconds=SECONDS)
        for (_, number), came in outcomes.items():
            if came not in ("read", "refused"):
                print(number, came)
                kept = folder / str(number)
                kept.mkdir(exist_ok=True)
                mutant(each, number, kept)
        found = Counter(came if came in ("read", "refused") else "failed" for came in outcomes.values())
        totals += found
        print(each, dict(found))
    print(f"{totals.total()} files of {len(kinds)} kinds:", dict(totals))
