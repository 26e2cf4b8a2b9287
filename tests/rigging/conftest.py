"""Rigs of the built-in head that the tests of this room share. Not to be changed."""

import pytest

import facewrinkle as fw


@pytest.fixture(scope="session")
def rig(face):
    """The 52 shapes of ARKit, with wrinkles, on triangles that are split once."""
    return fw.rig(face, level=1)


@pytest.fixture(scope="session")
def smooth_rig(face):
    """Two shapes without wrinkles, on the head's own triangles."""
    return fw.rig(face, "jawOpen+browInnerUp", wrinkles="none", level=0)
