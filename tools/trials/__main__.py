"""``python -m tools.trials``: long trials of the package, each of which goes on where it was stopped."""

from __future__ import annotations

import os
import sys

from cyclopts import App

from . import corpus, crossings, finding, fuzzing, signals, soundness, studio, wrinkle_detection

app = App(
    name="python -m tools.trials", help="Long trials of the package; those with --out go on where they were stopped."
)
for command in (
    soundness.soundness, crossings.crossings, corpus.corpus, fuzzing.fuzzing, signals.signals,
    wrinkle_detection.wrinkle_detection,
):  # fmt: skip
    app.command(command)
app.command(finding.app)
app.command(studio.app)

if __name__ == "__main__":
    if sys.platform.startswith("linux"):  # otherwise VTK looks for a display first
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    app()
