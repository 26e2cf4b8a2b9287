"""Store the shapes of the built-in head in full motion, and its lines, anew (seconds).

Usage: ``python -m tools.build_folds [FILE]``.
"""

import sys
from pathlib import Path

from facewrinkle.anatomy.atlas import load_atlas
from facewrinkle.anatomy.fitting import mean_face
from facewrinkle.layers.wave_folds.field import found_lines
from facewrinkle.layers.wave_folds.stripes import Style
from facewrinkle.simulation.fold_layers import OF_HEAD, Lines, Shapes, in_families, relaxed_shapes, store_folds


def lines_of(shapes: Shapes) -> Lines:
    """Return the lines of the built-in head."""
    return found_lines(head, in_families(head, shapes), 1.0, Style())


if __name__ == "__main__":
    head = mean_face(load_atlas())
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else OF_HEAD
    store_folds(path, head.atlas, relaxed_shapes(head), lines_of)
