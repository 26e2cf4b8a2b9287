"""Store the shapes of the built-in head in full motion, and its lines, anew (seconds).

Usage: ``python -m tools.build_shapes [FILE]``.
"""

import sys
from pathlib import Path

import numpy as np

import facewrinkle as fw
from facewrinkle.layers.wave_folds.field import found_lines
from facewrinkle.layers.wave_folds.packets import Style
from facewrinkle.motion.material import SkinMaterial
from facewrinkle.simulation.fold_shapes import in_families, inputs_of, relaxed_shapes, unit_groups
from facewrinkle.simulation.stored_shapes import FILE, packed

if __name__ == "__main__":
    face, material = fw.default_face(), SkinMaterial()
    arrays = packed(
        face,
        inputs_of(face, material),
        relaxed_shapes(face, material),
        lambda shapes: found_lines(face, in_families(unit_groups(face), shapes), 1.0, Style()),
    )
    np.savez_compressed(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE, **arrays)  # type: ignore[arg-type]
