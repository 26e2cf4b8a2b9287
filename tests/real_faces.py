"""Where the faces of others lie, beside the repository."""

from pathlib import Path

import pytest

FACES = Path(__file__).parents[2] / "shared" / "faces"
needs_faces = pytest.mark.skipif(not FACES.is_dir(), reason="the faces of other projects are not here")
