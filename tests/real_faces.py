"""The built-in face that tests share, and where the faces of others lie, beside the repository."""

from functools import cache
from pathlib import Path

import pytest

FACES = Path(__file__).parents[2] / "shared" / "faces"
needs_faces = pytest.mark.skipif(not FACES.is_dir(), reason="the faces of other projects are not here")


@cache
def built_in():
    """The built-in face, with what is worked out for it once. Not to be changed."""
    import facewrinkle as fw

    return fw.default_face()
