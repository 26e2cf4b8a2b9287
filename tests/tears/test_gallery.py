"""The figures of the tears are made, and what they claim holds: every script asserts a number."""

import runpy
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest
import pyvista as pv

SCRIPTS = sorted((Path(__file__).parents[2] / "gallery").glob("plot_*tear*.py"))


def test_there_are_the_figures_of_the_paper():
    assert [path.name.split("_")[1] for path in SCRIPTS] == ["fig08", "fig09", "fig11", "fig12"]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_script(script):
    matplotlib.use("agg")
    try:
        runpy.run_path(str(script))
    finally:
        plt.close("all")
        pv.close_all()
