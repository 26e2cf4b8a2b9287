"""Machine code: kept where it can be, and done without where nothing can be written."""

import os
import subprocess
import sys

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


def test_without_a_folder_to_write_to_functions_run_and_that_is_said_once(monkeypatch, recwarn):
    def refuse(locator):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(caching._CacheLocator, "ensure_cache_path", refuse)
    with pytest.warns(FaceWrinkleWarning, match="machine code can be kept neither .* NUMBA_CACHE_DIR to a folder that"):
        assert compilation.compiled(doubled)(21) == 42
    assert compilation.compiled(tripled)(2) == 6
    assert not recwarn.list


def first_use(cache, around=""):
    """What a new process says on stderr that normalizes vectors twice, whose code is kept in a folder."""
    lines = [
        "import numpy as np",
        "from facewrinkle.geometry.normals import normalize",
        "from facewrinkle.progress import only_bars",
        around,
        " normalize(np.ones((2, 3)))",
        " normalize(np.ones((2, 3), np.float32))",
    ]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    return subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], env=environment, capture_output=True, text=True, check=True
    ).stderr


@pytest.mark.slow
def test_the_first_use_says_once_why_it_waits(tmp_path):
    said = first_use(tmp_path / "a", "if True:")
    assert said.startswith("facewrinkle: compiling for the first time, which takes up to a minute")
    assert said.count("\n") == 1
    assert first_use(tmp_path / "a", "if True:") == ""
    assert first_use(tmp_path / "b", "with only_bars():") == ""
