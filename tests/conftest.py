"""What the tests share: the built-in face, real faces beside the repository, and played expressions."""

import hashlib
import os
import signal
import subprocess
import sys
import warnings
from functools import cache, lru_cache, partial
from types import SimpleNamespace

import hypothesis
import numpy as np
import pytest
from real_faces import FACES, built_in

if "PYTEST_XDIST_WORKER" not in os.environ:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the workers have the cores
# More than a hundred interpreters are started: without bytecode each compiles the package anew, for half a second.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
hypothesis.settings.register_profile("untimed", deadline=None)  # the first example may compile, and machines are busy
hypothesis.settings.load_profile("untimed")
collect_ignore = ["blender/scene.py"]
"""What runs in programs of its own, and is no test."""


def fingerprint(mesh):
    """A digest of everything a PolyData holds."""
    digest = hashlib.sha256(np.ascontiguousarray(mesh.points).tobytes() + np.ascontiguousarray(mesh.faces).tobytes())
    for data in (mesh.point_data, mesh.cell_data, mesh.field_data):
        for name in sorted(data):
            array = np.ascontiguousarray(data[name])
            digest.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
    digest.update(str(mesh.active_texture_coordinates is None).encode() + str(mesh.active_scalars_name).encode())
    return digest.hexdigest()


def pytest_collection_modifyitems(config, items):
    """Examples that `test_no_side_effects` runs and watches are not run as doctests, too; those of files, sets and the
    studio are slow.
    """
    watched = {item.callspec.params["name"] for item in items if "test_examples_change_nothing" in item.name}
    twice = [item for item in items if isinstance(item, pytest.DoctestItem) and item.name in watched]
    config.hook.pytest_deselected(items=twice)
    items[:] = [item for item in items if item not in twice]
    slow = tuple(f"facewrinkle.{room}." for room in ("dataset", "export", "live"))
    for item in items:
        if isinstance(item, pytest.DoctestItem) and item.name.startswith(slow):
            item.add_marker("slow")


@pytest.fixture(scope="session", name="fingerprint")
def _fingerprint():
    return fingerprint


@pytest.fixture
def signals_heard():
    """Signals reach what a test starts, also where they are ignored: under nohup, and in the background of a shell."""
    usual = {"SIGINT": signal.default_int_handler, "SIGHUP": signal.SIG_DFL}
    ignored = [
        name for name in usual if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) == signal.SIG_IGN
    ]
    for name in ignored:
        signal.signal(getattr(signal, name), usual[name])
    yield
    for name in ignored:
        signal.signal(getattr(signal, name), signal.SIG_IGN)


@pytest.fixture
def run(capsys, monkeypatch):
    """Runs a command, and returns what it prints on stdout and stderr."""
    from facewrinkle.cli import main

    for module in ("progress", "commands.options"):
        monkeypatch.setattr(f"facewrinkle.{module}.SHORTEST", 1e9)  # a slow machine would say what it waits for

    def run(*words, code=0):
        assert main(list(words)) == code
        return capsys.readouterr()

    return run


@pytest.fixture
def small_disk(tmp_path):
    """A folder on a disk of 8 MB; skips where none may be mounted."""
    folder = tmp_path / "small_disk"
    folder.mkdir()
    try:
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8m", "tmpfs", folder], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no small disk may be mounted here")
    yield folder
    subprocess.run(["umount", folder], check=True)


@pytest.fixture(scope="session")
def face():
    """The built-in face. Not to be changed."""
    face = built_in()
    before = fingerprint(face.mesh)
    yield face
    assert fingerprint(face.mesh) == before, "a test changed the mesh of the shared face"


@pytest.fixture(scope="session")
def real_face():
    """Fits one of the real faces by the start of its name; skips where it is absent."""
    import facewrinkle as fw

    @lru_cache(maxsize=4)
    def fitted(stem):
        with warnings.catch_warnings(
            action="ignore", category=fw.FaceWrinkleWarning
        ):  # texture seams, and landmarks that we have no name for
            return fw.fit_face(FACES / f"{stem}.obj", FACES / f"{stem}.landmarks.json")

    def real_face(stem):
        if not (FACES / f"{stem}.obj").exists():
            pytest.skip(f"{stem}.obj is not beside the repository")
        return fitted(stem)

    return real_face


@pytest.fixture
def any_face(request, face, real_face):
    """The built-in face for None, else a synthetic or a real one by its name: for parameters that are indirect."""
    from synthetic_faces import MAKERS, head_with

    if request.param is None:
        return face
    return head_with(request.param) if request.param in MAKERS else real_face(request.param)


@pytest.fixture(scope="session")
def clip():
    """A captured animation of a real face: that face, and the recording. Not to be changed."""
    import facewrinkle as fw

    path = FACES / "ict_face_narrow_anim.glb"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the repository")
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):  # landmarks that we have no name for
        mesh, recorded = fw.read_animation(path)
        return fw.fit_face(mesh, FACES / "ict_face_narrow.landmarks.json"), recorded


@pytest.fixture(scope="session")
def papers(face):
    """The built-in face whose muscles fold the skin over them, as in the paper, where they have creases."""
    from facewrinkle.anatomy.muscles import Crease, Wrinkles

    return face.with_muscles(
        {
            name: muscle.replaced(folds=None, wrinkles=Wrinkles(**face.atlas.muscles[name].get("wrinkles", {})))
            for name, muscle in face.muscles.items()
            if isinstance(muscle.folds, Crease)
        }
    )


@pytest.fixture(scope="session")
def played(papers):
    """Expressions of a face without creases: 70 frames to full strength, then, if asked for, 160 after release."""
    import facewrinkle as fw

    @lru_cache(maxsize=8)
    def play(name):
        sim = fw.Simulation(papers, layers=[fw.MuscleWrinkles()])
        sim.express(name)
        frames = list(sim.run(70))
        held = SimpleNamespace(
            displacement=sim.skin.displacement.copy(),
            vertices=sim.vertices,
            triangles=sim.forest.triangles,
            barycentric=sim.forest.barycentric,
            corners=sim.forest.corners,
            fields={m: sim.fields(m) for m in sim.muscles},
            rates=dict(zip(sim.muscles, sim.skin.rates, strict=True)),
            bare=sim.skin.points + sim.skin.displacement,
        )
        return SimpleNamespace(frames=frames, top=frames[-1], held=held, released=cache(partial(release, sim)))

    def release(sim):
        sim.relax()
        return list(sim.run(160, ramp=0.1))

    return play
