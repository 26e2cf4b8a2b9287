"""Machine code: kept where it can be, and done without where nothing can be written."""

from __future__ import annotations

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
