"""Store the shapes of the built-in head in full motion anew (seconds): ``python -m tools.build_shapes [FILE]``."""

import sys
from pathlib import Path

import numpy as np

import facewrinkle as fw
from facewrinkle.motion.material import SkinMaterial
from facewrinkle.simulation.fold_shapes import inputs_of, relaxed_shapes
from facewrinkle.simulation.stored_shapes import FILE, packed

if __name__ == "__main__":
    face, material = fw.default_face(), SkinMaterial()
    arrays = packed(face, inputs_of(face, material), relaxed_shapes(face, material))
    np.savez_compressed(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE, **arrays)  # type: ignore[arg-type]
