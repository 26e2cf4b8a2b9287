"""A session: all that can be wished of a face, as one document that is checked, written, read and played."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pyvista as pv

from ..array_types import Image
from ..export import movie_writer
from ..export.animation import AnimationWriter
from ..progress import Progress
from .content import Content
from .player import Moment, Player, pictured, scene_of
from .program import program_of
from .subject import Subject, subject_of


@dataclass(frozen=True)
class Session(Content):
    """All that can be wished of a face: who it is, what folds it, what it does, and how it is seen.

    A session is what the studio edits, and what ``facewrinkle express --session`` reads. It is checked when it is made,
    and does not change: :meth:`changed` returns another one.

    Parameters
    ----------
    face : str
        A mesh, an animation that moves one, or a .face file. Default: the built-in head.
    atlas : str
        A TOML file with muscles, action units and expressions of one's own.
    take : str
        A recording of a phone or a tracker, which the face performs in place of `mixture`.
    identity : dict of str to float
        Of the built-in head, see :class:`facewrinkle.Identity`.
    landmarks : dict
        Landmarks that are elsewhere than they were found, each a :class:`Place` or three numbers.
    mixture : dict of str to float
        Weights of expressions, action units and muscles.
    mixtures : dict of str to dict
        Expressions of one's own: mixtures by name.
    intensity : float
        Factor for `mixture`.
    gaze : tuple of float
        Degrees to the subject's left, and upwards.
    folds : Folds
    regions : dict of str to float
        Factors for the depth of folds in a region, such as ``{"forehead": 2.0}``.
    patterns : dict of str to Pattern
    tears : dict of str to Tear
    probes : dict
        Places whose numbers are told.
    timeline : Timeline
    time : float
        The moment of the timeline, or of a recording, that pictures show, s.
    look : Look
    known : Atlas, optional
        The names that mixtures may have. Default: those of `atlas`, and `mixtures`.

    Raises
    ------
    ParameterError, UnknownNameError
        For what is not allowed.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> session = fw.Session(mixture={"AU12": 0.8}, regions={"crow's feet": 2.0}, identity={"age": 0.5})
    >>> frame = session.frame()
    >>> bool(frame["W"].min() < -0.2), fw.Session.from_json(session.to_json()) == session
    (True, True)
    >>> session.changed(mixture={"AU12": 2.0})
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: mixture.AU12 must be at most 1, received 2.0.
    """

    def as_python(self, subject: Subject | None = None) -> str:
        """Return a program of public calls that makes :meth:`frame` and :meth:`picture`, and writes the picture.

        Examples
        --------
        >>> print(Session(mixture={"AU12L": 0.5, "AU12R": 0.5}).as_python().splitlines()[4])
        sim.express({'AU12': 0.5})
        """
        return program_of(self, subject or self.subject())

    # --- what it shows -------------------------------------------------------------------------

    def subject(self, progress: Progress | None = None) -> Subject:
        """Return the face, and what moves it. It takes a while for a scan: give it to the other methods."""
        return subject_of(self, progress)

    def frame(self, subject: Subject | None = None) -> pv.PolyData:
        """Return the face that has come to rest with all that is wished at :attr:`time`; see
        :meth:`facewrinkle.Simulation.step`.
        """
        return Player(self, subject or self.subject()).settled()

    def frames(self, subject: Subject | None = None) -> Iterator[Moment]:
        """Yield the moments of a movie: the timeline or the recording from its beginning, or without keys from rest to
        what is wished. Each has its frame, its time in s, and the surfaces of the tears.

        Examples
        --------
        >>> session = Session(mixture={"AU26": 1.0}, look={"fps": 2.0})
        >>> [round(moment.time, 1) for moment in session.frames()]
        [0.5, 1.0, 1.5, 2.0, 2.5]
        """
        yield from Player(self, subject or self.subject()).moments()

    def picture(self, subject: Subject | None = None) -> Image:
        """Return the picture of :meth:`frame`: ndarray of uint8, shape (height, width, 3)."""
        player = Player(self, subject or self.subject())
        frame = player.settled()
        with scene_of(self, player.face) as scene:
            return pictured(scene, self, frame, player.arrived_tears(frame), player.contractions)

    def movie(self, path: str | Path, subject: Subject | None = None, progress: Progress | None = None) -> Path:
        """Write the movie of :meth:`frames` to an .mp4 or .gif file.

        Raises
        ------
        MissingPackageError
            Without the packages of the extra ``export``.
        """
        player = Player(self, subject or self.subject())
        with scene_of(self, player.face) as scene, movie_writer(path, fps=self.look.fps) as append:
            for moment in _shown(progress, player, "Movie"):
                append(pictured(scene, self, moment.frame, moment.tears, player.contractions))
        return Path(path)

    def animation(self, path: str | Path, subject: Subject | None = None, progress: Progress | None = None) -> Path:
        """Write :meth:`frames` as an animation, a .glb, .gltf or .usd file."""
        player = Player(self, subject or self.subject(), coarsen=False)
        writer = AnimationWriter(player.face, path)
        for moment in _shown(progress, player, "Animation"):
            writer.add(moment.frame)
        writer.write(player.times, player.simulation.forest)
        return Path(path)


def _shown(progress: Progress | None, player: Player, what: str) -> Iterable[Moment]:
    """Return the moments of a player, with progress."""
    return player.moments() if progress is None else progress(player.moments(), what, len(player.times))


START = Session()
"""A session in which nothing is set."""
