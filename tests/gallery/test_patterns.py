"""The gallery's pages on patterns run, and the numbers that they assert hold."""

from __future__ import annotations

import runpy
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest

PAGES = ("forehead_cycle", "pattern_functions", "wrinkle_patterns", "dimples", "eye_pouch", "any_surface")


@pytest.mark.parametrize("page", PAGES)
def test_page(page):
    matplotlib.use("Agg")
    try:
        runpy.run_path(str(Path(__file__).parents[2] / "gallery" / f"plot_{page}.py"))
    finally:
        plt.close("all")
