"""A small set that tests look at, and copy."""

from __future__ import annotations

import pytest

SPEC = {"size": [48, 48], "quick": True, "shard": 2, "per_person": 2, "tears": {"share": 0.0}}


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A set of three samples in two shards. Not to be changed."""
    from facewrinkle.dataset import generate

    return generate(SPEC, tmp_path_factory.mktemp("set") / "small", count=3)
