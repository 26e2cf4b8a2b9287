"""Reports of the analyses in quick mode, made once."""

from functools import lru_cache
from importlib import import_module

import pytest


@pytest.fixture(scope="session")
def report():
    """The quick report of an analysis, by name."""

    @lru_cache
    def made(name):
        return import_module(f"analysis.{name}").report(quick=True)

    return made
