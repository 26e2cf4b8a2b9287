"""Machine code where nothing can be written: read-only installations without a home, and full disks."""

from __future__ import annotations

import gc
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba.core import caching, event

from facewrinkle.errors import FaceWrinkleWarning
from facewrinkle.geometry import compilation


@pytest.fixture
def read_only(tmp_path, monkeypatch):
    """Nothing can be written but a folder for temporary files."""
    original = caching._CacheLocator.ensure_cache_path

    def refuse(locator):
        if not locator.get_cache_path().startswith(str(tmp_path)):
            raise OSError(30, "Read-only file system")
        original(locator)

    monkeypatch.setattr(caching._CacheLocator, "ensure_cache_path", refuse)
    monkeypatch.setattr(compilation, "_told", set())
    monkeypatch.setattr(compilation.tempfile, "gettempdir", lambda: str(tmp_path))
    return tmp_path


def doubled(number):
    return 2 * number


def tripled(number):
    return 3 * number


def test_machine_code_is_kept_among_temporary_files(read_only, recwarn):
    before = numba.config.CACHE_DIR
    with pytest.warns(FaceWrinkleWarning, match="is kept in .*facewrinkle-.* NUMBA_CACHE_DIR to a folder that you may"):
        compiled = compilation.njit(cache=True)(doubled)
    assert compiled(21) == 42
    assert list(read_only.rglob("*.nbi"))
    assert before == numba.config.CACHE_DIR
    (folder,) = read_only.iterdir()
    assert folder.stat().st_mode & 0o077 == 0
    assert compilation.njit(cache=True)(tripled)(2) == 6
    assert not recwarn.list  # it was said once


def test_folders_that_others_can_write_to_are_not_trusted(read_only):
    (read_only / compilation.temporary_folder().name).chmod(0o777)
    with pytest.warns(FaceWrinkleWarning, match="is kept nowhere, so that every start takes half a minute more"):
        compiled = compilation.njit(cache=True)(doubled)
    assert compiled(21) == 42
    assert not list(read_only.rglob("*.nbi"))


def test_a_full_disk_keeps_no_machine_code(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(caching.IndexDataCacheFile, "save", full)
    assert compilation.njit(cache=True)(tripled)(14) == 42


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize(
    "damaged",
    [lambda whole: b"", lambda whole: bytes(len(whole)), lambda whole: whole[:-9]],
    ids=["empty", "0", "short"],
)
def test_damaged_machine_code_is_compiled_anew(tmp_path, monkeypatch, ending, damaged):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    hits = []
    for _ in range(3):
        compiled = compilation.njit(cache=True)(tripled)
        assert compiled(14) == 42
        hits.append(sum(compiled.stats.cache_hits.values()))
        if len(hits) == 1:
            (file,) = tmp_path.rglob(f"*.{ending}")
            file.write_bytes(damaged(file.read_bytes()))
    assert hits == [0, 0, 1]  # it was kept again


@pytest.mark.parametrize("module, collects", [("facewrinkle.some", False), ("facewrinkles", True), ("another", True)])
@pytest.mark.parametrize("wanted", [True, False])
def test_garbage_is_not_collected_while_our_functions_are_compiled(monkeypatch, module, collects, wanted):
    seen = []

    class Looking(event.Listener):
        def on_start(self, event):
            seen.append(gc.isenabled())

        def on_end(self, event):
            seen.append(gc.isenabled())

    def odd(number):
        return number.absent  # numba fails

    monkeypatch.setattr(doubled, "__module__", module)
    odd.__module__ = module
    before = gc.isenabled()
    (gc.enable if wanted else gc.disable)()
    try:
        with event.install_listener("numba:compile", Looking()):
            assert numba.njit(doubled)(21) == 42
            assert gc.isenabled() is wanted
            with pytest.raises(numba.TypingError):
                numba.njit(odd)(1)
        assert gc.isenabled() is wanted
    finally:
        (gc.enable if before else gc.disable)()
    assert seen[0] is (wanted and collects)
    assert len(seen) == 4


def test_functions_without_a_module_compile_as_ever():
    scope = {}
    exec("def halved(number):\n    return number / 2", scope)
    scope["halved"].__module__ = None  # as for code that is run without a name
    assert numba.njit(scope["halved"])(6) == 3.0


def test_whatever_is_compiled_the_listener_raises_nothing():
    listener, before = compilation._Uncollected(), gc.isenabled()
    for data in (None, {}, {"dispatcher": None}, {"dispatcher": object()}):
        listener.on_start(event.Event("numba:compile", event.EventStatus.START, data))
        assert gc.isenabled() is before
        listener.on_end(event.Event("numba:compile", event.EventStatus.END, data))


def test_without_any_folder_for_temporary_files_there_is_none(monkeypatch):
    def none():
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr(compilation.tempfile, "gettempdir", none)
    assert compilation.temporary_folder() is None


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs namespaces of mounts")
def test_a_read_only_installation_without_a_home(tmp_path):
    package = Path(compilation.__file__).parents[1]
    program = "import facewrinkle.geometry._mesh_kernels as k, sys; sys.stdout.write('it runs')"
    script = (
        f"mount --bind {package} {package} && mount -o remount,bind,ro {package} && "
        f'HOME=/proc/nobody TMPDIR={tmp_path} PYTHONPATH={package.parent} exec {sys.executable} -c "{program}"'
    )
    unshared = ["unshare", "--mount", "sh", "-c", script]
    try:
        subprocess.run(["unshare", "--mount", "true"], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no mounts of one's own here")
    run = subprocess.run(unshared, capture_output=True, text=True, timeout=120.0, check=False)
    assert run.stdout == "it runs", run.stderr
    assert run.stderr.count("machine code can be kept neither") == 1
