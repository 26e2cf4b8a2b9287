"""The report of a problem."""

from __future__ import annotations

import numpy as np
import pyvista as pv

import facewrinkle as fw


def test_a_report_names_the_package_and_what_it_uses():
    said = str(fw.Report(gpu=False))
    assert f"facewrinkle : {fw.__version__}" in said
    assert f"numpy : {np.__version__}" in said
    assert f"pyvista : {pv.__version__}" in said
    assert "numba : " in said
