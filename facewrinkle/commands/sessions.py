"""Sessions on the command line: one is shown, or made of the options of a command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..anatomy.atlas import load_atlas, read_atlas
from ..errors import ParameterError
from ..session import Folds, Look, Session
from ..session.player import Player, pictured, scene_of
from .options import FaceOptions, FoldOptions, OutputOptions, Report, given, parse_mixture, refuse
from .recorder import Recorder

USUAL = OutputOptions()
"""The options that leave size, view and speed to the session."""


def show(path: Path, output: OutputOptions, report: Report) -> None:
    """Write the picture of a session, and what else was asked for: movie, mesh, series, animation."""
    session = Session.read(path)
    session = session.changed(look={**session.table()["look"], **_look(output)})
    recorder = Recorder(output.folder(path.stem), path.stem, output, report)
    subject = session.subject(report.progress)
    with report.waiting("Preparing the skin"):
        player = Player(session, subject)
        frame = player.settled()
        tears = player.arrived_tears(frame)
    with scene_of(session, subject.face) as scene:
        recorder.save_picture(pictured(scene, session, frame, tears, player.contractions))
    recorder.save_mesh(frame, subject.face, tears=tears)
    if output.movie:
        recorder.save_movie(lambda target: session.movie(target, subject, report.progress))
    if output.series:
        recorder.write_series([moment.frame for moment in session.frames(subject)], player.times)
    if output.save_animation is not None:
        recorder.named.append(session.animation(output.save_animation, subject, report.progress))
    recorder.tabulate(path.name, {"triangles": f"{subject.face.n_cells} → {frame.n_cells}"})


def _look(output: OutputOptions) -> dict[str, Any]:
    """Return what options change of the look of a session."""
    found = given(view=output.view, clay=output.clay or None)
    found |= {"size": output.pixels} if output.size != USUAL.size else {}
    return found | ({"fps": output.fps} if output.fps != USUAL.fps else {})


def session_of(name: str, intensity: float, source: FaceOptions, folds: FoldOptions, output: OutputOptions) -> Session:
    """Return the session of an expression with the options of a command."""
    why = "is not kept in a session: leave out --write-session, or fit the face first."
    refuse(why, landmarks=source.landmarks, units=source.units, texture=source.texture)
    if folds.folds != "wave" or folds.no_limit:
        raise ParameterError("a session has folds that are waves, within their limit: leave out --write-session.")
    session = source.session()
    atlas = read_atlas(session.atlas) if session.atlas else load_atlas()
    return session.changed(
        atlas,
        mixture=parse_mixture(name, atlas),
        intensity=intensity,
        folds=Folds(
            **given(depth=folds.depth, density=folds.density, length=folds.length, seed=folds.seed, age=folds.age)
        ),
        look=Look(**{"size": output.pixels, "fps": output.fps, **_look(output)}),
    )
