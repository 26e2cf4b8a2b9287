"""``python -m analysis``: redo every table and plot into one folder, with a page that shows them all."""

from __future__ import annotations

from pathlib import Path

from . import creases, emotions, folds, motion, performance, profiles, realism, refinement, relief, volume
from .report import OUTPUT, publish, run


def main(*, out: Path = OUTPUT, quick: bool = False) -> None:
    """Redo every table and plot.

    Parameters
    ----------
    out
        Folder for the tables as JSON, the plots and index.html.
    quick
        Coarser meshes and fewer repetitions.
    """
    for module in (profiles, folds, volume, realism, refinement, performance):
        publish(module.report(quick), out)
    if (found := motion.captured()) is not None:
        publish(motion.report(*found, pictures=not quick), out)
        publish(emotions.report(*found), out)
        publish(relief.report(*found), out)
        publish(creases.report(*found), out)
    print(f"\n{out / 'index.html'}")


if __name__ == "__main__":
    run(main)
