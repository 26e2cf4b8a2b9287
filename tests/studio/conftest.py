"""A studio on the built-in face, without a browser."""

from __future__ import annotations

import pytest

pytest.importorskip("aiohttp", reason="the studio needs aiohttp")


@pytest.fixture(scope="package")
def studio_of_package(face):
    from facewrinkle.studio import Studio

    with Studio(face, browser=False) as studio:
        yield studio


@pytest.fixture
def studio(studio_of_package):
    """A studio in which nothing is set."""
    from facewrinkle.studio.document import START

    stage = studio_of_package._stage
    stage.live({})
    stage.play(False)
    stage.go_to(0.0)
    studio_of_package.change(**START)
    studio_of_package.frame()
    return studio_of_package
