"""What was found is found again, and never anything else in its place."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import llvmlite
import numba
import numpy as np
import pytest
import pyvista as pv
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.anatomy.eyeball import Eyeball
from facewrinkle.geometry import compilation
from facewrinkle.mesh import keeping
from facewrinkle.mesh.keeping import digest, kept, unkept

ARRAYS = {"numbers": np.arange(5000.0), "names": np.array(["eyes", "chin"]), "none": np.empty((0, 3), np.int32)}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder in which things are kept."""
    monkeypatch.setenv(keeping.FOLDER, str(tmp_path / "kept"))
    return tmp_path / "kept"


def made(asked):
    """A function that notes that it was asked for the arrays."""

    def make():
        asked.append(True)
        return ARRAYS

    return make


def assert_same(found, arrays=ARRAYS):
    assert list(found) == list(arrays)
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


def test_arrays_are_made_once_for_the_same_inputs(folder):
    asked = []
    for _ in range(3):
        assert_same(kept("numbers", [1, np.zeros(3)], made(asked)))
    assert len(asked) == 1
    kept("numbers", [1, np.zeros(4)], made(asked))
    kept("others", [1, np.zeros(3)], made(asked))
    assert len(asked) == 3
    assert len(list(folder.iterdir())) == 3


def test_another_package_makes_them_anew(folder, monkeypatch):
    asked = []
    kept("numbers", 1, made(asked))
    monkeypatch.setattr(keeping, "_package", lambda: [("0.0.1", 0, 0)])
    kept("numbers", 1, made(asked))
    assert len(asked) == 2


@pytest.mark.parametrize("package", [np, scipy, numba, llvmlite, pv])
def test_another_version_of_what_computes_them_makes_them_anew(folder, monkeypatch, package):
    asked = []
    kept("numbers", 1, made(asked))
    monkeypatch.setattr(package, "__version__", "0.0.1")
    keeping._computing.cache_clear()
    kept("numbers", 1, made(asked))
    keeping._computing.cache_clear()
    assert len(asked) == 2


@pytest.mark.parametrize("name, value", [("CPU_NAME", "generic"), ("CPU_FEATURES", "")])
def test_another_processor_makes_them_anew(folder, monkeypatch, name, value):
    asked = []
    kept("numbers", 1, made(asked))
    monkeypatch.setattr(numba.config, name, value)
    keeping._computing.cache_clear()
    kept("numbers", 1, made(asked))
    keeping._computing.cache_clear()
    assert len(asked) == 2


def test_every_module_that_may_have_a_part_stands_for_the_package():
    names = [name for name, *_ in keeping._package()]
    parts = "motion/skin.py", "layers/wave_folds/_packet_kernels.py", "anatomy/data/atlas.toml", "geometry/rings.py"
    assert all(any(name.endswith(part) for name in names) for part in parts)


@pytest.mark.parametrize("damage", ["byte", "shorter", "empty", "rubbish"])
def test_a_damaged_file_is_written_anew(folder, damage):
    asked = []
    kept("numbers", 1, made(asked))
    (file,) = folder.iterdir()
    whole = file.read_bytes()
    middle = bytearray(whole)
    middle[len(whole) // 2] ^= 64  # within the numbers
    damaged = {"byte": bytes(middle), "shorter": whole[:-100], "empty": b"", "rubbish": b"rubbish" * 1000}
    file.write_bytes(damaged[damage])
    assert_same(kept("numbers", 1, made(asked)))
    assert len(asked) == 2
    assert_same(kept("numbers", 1, made(asked)))
    assert len(asked) == 2


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The bytes of a file, and a path to write others to."""
    path = tmp_path_factory.mktemp("damaged") / "facewrinkle-numbers.npz"
    assert keeping._wrote(path, SMALL)
    return path.read_bytes(), path


SMALL = {"numbers": np.arange(3.0), "names": np.array(["eyes"])}


@settings(max_examples=300)
@given(st.data())
def test_of_a_changed_file_only_what_was_written_is_read(whole, data):
    content, path = bytearray(whole[0]), whole[1]
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)) | st.just(len(content)))])
    found = keeping._read(path)
    if found is not None:
        assert_same(found, SMALL)


def test_nothing_is_kept_where_nothing_can_be(folder, monkeypatch, recwarn):
    folder.write_text("a file stands in the folder's place")
    asked = []
    for value in (str(folder), str(folder / "inner"), ""):
        monkeypatch.setenv(keeping.FOLDER, value)
        assert_same(kept("numbers", 1, made(asked)))
    assert len(asked) == 3
    assert not recwarn.list


def raised(error):
    def function(*_, **__):
        raise error

    return function


@pytest.mark.parametrize("home", [raised(RuntimeError("no home")), lambda *_, **__: Path("~/.cache/facewrinkle")])
def test_without_a_home_they_are_kept_among_temporary_files_or_not_at_all(tmp_path, monkeypatch, home):
    monkeypatch.delenv(keeping.FOLDER)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("platformdirs.user_cache_path", home)
    monkeypatch.setattr(compilation.tempfile, "gettempdir", lambda: str(tmp_path))
    asked = []
    for _ in range(2):
        assert_same(kept("numbers", 1, made(asked)))
    assert len(asked) == 1
    (folder,) = tmp_path.iterdir()
    assert folder == compilation.temporary_folder()
    monkeypatch.setattr(compilation.tempfile, "gettempdir", raised(FileNotFoundError(2, "No usable temporary folder")))
    assert keeping._folders() == []
    assert_same(kept("numbers", 1, made(asked)))
    assert len(asked) == 2


def test_nobodys_home_is_not_a_folder_of_this_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(keeping.FOLDER, "~nobody-of-this-name/kept")
    assert_same(kept("numbers", 1, made([])))
    assert not list(tmp_path.iterdir())


def test_the_next_folder_is_taken_if_the_first_cannot_be_written(tmp_path, monkeypatch):
    first, second, asked = tmp_path / "first", tmp_path / "second", []
    first.write_text("a file stands in the folder's place")
    monkeypatch.setattr(keeping, "_folders", lambda: [first, second])
    for _ in range(2):
        assert_same(kept("numbers", 1, made(asked)))
    assert len(asked) == 1
    assert len(list(second.iterdir())) == 1


def test_those_not_used_for_longest_give_way(folder, monkeypatch):
    monkeypatch.setattr(keeping, "MOST", 3)
    asked = []
    for number in range(3):
        kept("numbers", number, made(asked))
        for file in folder.iterdir():
            os.utime(file, ns=(0, file.stat().st_mtime_ns - 10**9))
    kept("numbers", 0, made(asked))  # used again
    kept("numbers", 3, made(asked))
    assert len(asked) == 4
    for number in (0, 2, 3):
        kept("numbers", number, made(asked))
    assert len(asked) == 4
    kept("numbers", 1, made(asked))
    assert len(asked) == 5


def test_only_files_of_our_own_are_removed(folder, monkeypatch):
    monkeypatch.setattr(keeping, "MOST", 1)
    folder.mkdir()
    digits = "0123456789abcdef" * 2
    foreign = ["mine.npz", f"lines-{digits}.npz", f"facewrinkle-lines-{digits}.npz.bak", f"{digits}.npz", "notes.txt"]
    foreign += ["facewrinkle-scan.npz", f"my-facewrinkle-lines-{digits}.npz", f"facewrinkle-lines-{digits[:-1]}.npz"]
    left = f".4711.facewrinkle-lines-{digits}.npz"  # by a process that was killed
    for name in [*foreign, left]:
        (folder / name).write_bytes(b"0")
        os.utime(folder / name, (0, 0))
    for number in range(3):
        kept("numbers", number, made([]))
    names = {path.name for path in folder.iterdir()}
    assert names > set(foreign)
    assert left not in names
    assert len(names) == len(foreign) + 1


def test_all_together_take_no_more_than_so_many_bytes(folder, monkeypatch):
    size, asked = sum(array.nbytes for array in ARRAYS.values()), []
    monkeypatch.setattr(keeping, "WHOLE", 5 * size)
    for number in range(6):
        kept("numbers", number, made(asked))
        for file in folder.iterdir():
            os.utime(file, ns=(0, file.stat().st_mtime_ns - 10**9))
    assert len(list(folder.iterdir())) == 4  # and what a file needs besides its arrays
    assert sum(file.stat().st_size for file in folder.iterdir()) <= 5 * size
    kept("numbers", 5, made(asked))
    assert len(asked) == 6
    monkeypatch.setattr(keeping, "WHOLE", int(size / keeping.SHARE) - 1)
    before = set(folder.iterdir())
    assert_same(kept("numbers", 9, made(asked)))
    assert set(folder.iterdir()) == before  # it would be too large a part of the whole


def test_what_never_comes_again_is_not_kept(folder):
    asked = []
    kept("numbers", 1, made(asked))
    with unkept("numbers"), unkept("names"):
        assert_same(kept("numbers", 1, made(asked)))  # it was kept before
        assert len(asked) == 1
        for name in ("numbers", "names", "others"):
            kept(name, 2, made(asked))
    assert sorted(file.name.split("-")[1] for file in folder.iterdir()) == ["numbers", "others"]
    kept("numbers", 2, made(asked))
    assert len(list(folder.iterdir())) == 3


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner, max_size=2),
    max_leaves=6,
)


@given(values, values)
def test_content_has_one_digest_and_no_other_has_it(one, other):
    assert digest(one) is not None
    assert (digest(one) == digest(other)) == (repr(one) == repr(other))


def test_arrays_differ_by_type_shape_and_values():
    zeros, tiny = np.zeros(6), np.array([0, 0, 0, 0, 0, 1e-300])
    others = [zeros.astype(np.float32), zeros.astype(np.int64), zeros.reshape(2, 3), zeros.reshape(3, 2), tiny, -zeros]
    others += [zeros.tolist(), np.array(["a", "b"]), np.array("ab"), np.array(["a", "bc"])]
    assert len({digest(other) for other in [zeros, *others]}) == len(others) + 1
    assert digest(zeros[::2]) == digest(np.zeros(3))


def test_dataclasses_and_meshes_are_told_apart_by_what_they_hold(face):
    eye = face.eyes[0]
    assert digest(eye) == digest(Eyeball(eye.side, eye.centre.copy(), eye.radius, eye.gaze.copy(), eye.up.copy()))
    assert digest(eye) != digest(dataclasses.replace(eye, radius=np.nextafter(eye.radius, 99.0)))
    ball = pv.Sphere()
    painted = ball.copy()
    painted["paint"] = np.zeros(ball.n_points)
    assert digest(ball) == digest(ball.copy()) != digest(painted)
    assert digest(face) == digest(dataclasses.replace(face))
    muscles = dict(face.muscles)
    name, muscle = next((name, muscle) for name, muscle in muscles.items() if hasattr(muscle, "wrinkles"))
    assert digest(face) != digest(face.with_muscles({name: muscle.replaced(alpha=0.123)}))


def test_objects_of_a_users_classes_keep_nothing(folder):
    @dataclasses.dataclass
    class Own:
        number: int = 1

    asked = []
    for inputs in (Own(), [Own()], {"own": object()}, np.array([None])):
        kept("numbers", inputs, made(asked))
    assert len(asked) == 4
    assert not folder.exists()
