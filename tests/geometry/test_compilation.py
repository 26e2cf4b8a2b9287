"""Machine code: kept where it can be, and done without where nothing can be written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba.core import caching

from facewrinkle.errors import FaceWrinkleWarning
from facewrinkle.geometry import compilation


def doubled(number):
    return 2 * number


def tripled(number):
    return 3 * number


def test_machine_code_is_kept_for_the_next_start(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    hits = []
    for _ in range(2):
        function = compilation.compiled(tripled)
        assert function(14) == 42
        hits.append(sum(function.stats.cache_hits.values()))
    assert hits == [0, 1]
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


def test_options_are_those_of_numba(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    with pytest.raises(ZeroDivisionError):
        compilation.compiled(lambda number: 1 / number)(0)
    assert compilation.compiled(error_model="numpy")(lambda number: 1 / number)(0) == float("inf")


def test_without_a_folder_to_write_to_functions_run_and_that_is_said_once(monkeypatch, recwarn):
    def refuse(locator):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(caching._CacheLocator, "ensure_cache_path", refuse)
    with pytest.warns(FaceWrinkleWarning, match="machine code can be kept neither .* NUMBA_CACHE_DIR to a folder that"):
        assert compilation.compiled(doubled)(21) == 42
    assert compilation.compiled(tripled)(2) == 6
    assert not recwarn.list


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs namespaces of mounts")
def test_a_read_only_installation_without_a_home(tmp_path):
    package = Path(compilation.__file__).parents[1]
    program = "import facewrinkle.geometry.topology as k, sys; sys.stdout.write('it runs')"
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
