"""Build the built-in head anew (about ten seconds): ``python -m tools.build_head [FILE]``."""

import sys
from pathlib import Path

import numpy as np

from facewrinkle.anatomy.head import DATA, cage_data

from .build import head_arrays, stored

if __name__ == "__main__":
    np.savez_compressed(
        Path(sys.argv[1]) if len(sys.argv) > 1 else DATA / "head.npz", **stored(head_arrays(cage_data()))
    )
