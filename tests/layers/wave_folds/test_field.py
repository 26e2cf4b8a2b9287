"""Lines that are kept in a file: the same as those that were found."""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.layers.wave_folds import FoldShapes, field
from facewrinkle.layers.wave_folds.packets import Style
from facewrinkle.mesh import keeping


def test_lines_are_the_same_from_a_file(face, tmp_path, monkeypatch):
    monkeypatch.setenv(keeping.FOLDER, str(tmp_path))
    squeezed = FoldShapes({"squeezed": [face.points * [1.0, 0.9, 1.0]]})
    lines = field.Lines(face, squeezed, 1.0, Style())
    monkeypatch.delattr(field, "found_lines")
    again = field.Lines(face, squeezed, 1.0, Style())
    assert again.names == lines.names == ("squeezed",)
    np.testing.assert_array_equal(again.compression, lines.compression)
    normals = np.tile([0.0, 0.0, 1.0], (len(face.points), 1))
    (first,), (second,) = lines.packets, again.packets
    np.testing.assert_array_equal(second.zone, first.zone)
    for mine, theirs in zip(second.at(face.points, normals), first.at(face.points, normals), strict=True):
        np.testing.assert_array_equal(mine, theirs)
        assert mine.any()
    flat = FoldShapes({"squeezed": [face.points]})
    for other in ((squeezed, 1.1, Style()), (squeezed, 1.0, Style(seed=1)), (flat, 1.0, Style())):
        with pytest.raises(NameError):
            field.Lines(face, *other)
