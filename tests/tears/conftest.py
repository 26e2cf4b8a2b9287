"""Surfaces that tears run down."""

import pytest
import pyvista as pv


@pytest.fixture(scope="module")
def sphere():
    return pv.Icosphere(radius=50.0, nsub=4)
