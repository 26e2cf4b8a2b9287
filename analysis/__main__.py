"""``python -m analysis``: redo every table and plot into one folder, with a page that shows them all."""

from __future__ import annotations

from pathlib import Path

import facewrinkle as fw

from . import emotions, folds, motion, performance, profiles, realism, refinement, relief, volume
from .report import OUTPUT, publish, run


def main(*, out: Path = OUTPUT, quick: bool = False) -> None:
    """Redo every table and plot.

    Parameters
    ----------
    out
        Folder for the tables as JSON, the plots and index.html.
    quick
        Coarser meshes, fewer expressions and repetitions.
    """
    for module in (profiles, folds, volume, realism, refinement, performance):
        publish(module.report(quick), out)
    if (motion.FACES / "ict_face_expressions.npz").exists():
        face = fw.fit_face(
            motion.FACES / "ict_face_narrow.obj", motion.FACES / "ict_face_narrow.landmarks.json", units="cm"
        )
        shapes = motion.read_shapes(motion.FACES / "ict_face_expressions.npz", face.mesh.n_points, face.unit)
        publish(motion.report(face, shapes, pictures=not quick), out)
        publish(emotions.report(face, shapes), out)
        publish(relief.report(face, shapes), out)
    else:
        left_out = (
            "motion, emotions and relief are left out. Give them to python -m analysis.motion, .emotions and .relief."
        )
        print(f"No captured shapes in {motion.FACES}: {left_out}")
    print(f"\n{out / 'index.html'}")


if __name__ == "__main__":
    run(main)
