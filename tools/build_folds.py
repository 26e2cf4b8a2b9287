"""Store the shapes of the built-in head in full motion, and its lines, anew (seconds).

Usage: ``python -m tools.build_folds [FILE]``.
"""

import dataclasses
import sys
from pathlib import Path

import numpy as np

import facewrinkle as fw
from facewrinkle.anatomy.known_folds import OF_HEAD, known_folds, restore, to_store
from facewrinkle.layers.wave_folds.field import found_lines
from facewrinkle.layers.wave_folds.stripes import Style
from facewrinkle.simulation.fold_layers import in_families, relaxed_shapes

if __name__ == "__main__":
    face = dataclasses.replace(fw.default_face())  # which knows nothing of its folds
    known = known_folds(face)
    known.shapes = relaxed_shapes(face)
    restore(face, to_store(face))  # rounded, as they are stored
    known.lines = found_lines(face, in_families(face, known.shapes), 1.0, Style())
    np.savez_compressed(Path(sys.argv[1]) if len(sys.argv) > 1 else OF_HEAD, **to_store(face))  # type: ignore[arg-type]
