"""The studio: a page in the browser on a face that is simulated here."""

from __future__ import annotations

import atexit
import contextlib
import sys
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyvista as pv

from ..anatomy import Face, default_face
from ..errors import FaceWrinkleError, check_whole, optional_imports
from ..session import Session
from ..session.session import START
from .answers import Answers
from .capture import Capture
from .document import Document
from .library import Library
from .saving import Folder, Kept
from .server import Server
from .stage import Stage

if TYPE_CHECKING:
    from .widget import StudioWidget


class Studio(contextlib.AbstractContextManager["Studio"]):
    """A face in the browser, live. :func:`facewrinkle.studio` makes one.

    Attributes
    ----------
    url : str
        Address of the page, with the key of this studio.
    face : Face
    stage : Stage
        The thread that simulates. It plays the timeline, and goes to a time of it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> with Studio(fw.default_face(), browser=False) as studio:
    ...     studio.rates = {"AU12": 0.5}
    ...     frame = studio.frame()
    >>> frame.n_points > 2000
    True
    """

    def __init__(
        self,
        face: Face,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        save_to: Path | None = None,
        browser: bool = True,
        start: Session = START,
        listen: int | None = None,
    ) -> None:
        self._library = Library(face, start.face)
        self._document = Document(face.atlas, self._library.accepted, self._library.inside(start))
        folder = None if save_to is None else Folder(save_to)
        self._kept = Kept(folder, self._document, self._library, self._complain)
        self.stage = Stage(self._library, self._document)
        self._answers = answers = Answers(self._library, self._document, self.stage, folder, self._kept, self._changed)
        self._server = Server(answers.handle, answers.state, answers.greeting, answers.opened, host, port)
        answers.server = self._server
        self._server.start()
        if listen is not None:
            self._server.listen(Capture(answers.live, answers.driven), listen)
        self.stage.listeners += [self._server.wake, self._kept.changed]
        self.stage.tell_face = lambda: self._server.tell_all(lambda: {"is": "face", **answers.face()})
        self.stage.complain = self._tell
        self.stage.start()
        atexit.register(self.close)  # a thread at work in a library when Python ends would make that fail
        if browser:  # which starts while the first frame is made
            with contextlib.suppress(webbrowser.Error):
                webbrowser.open(self.url)
        try:
            self._first()
        except BaseException:
            self.close()
            raise

    def _first(self) -> None:
        stage = self.stage
        with stage.condition:
            stage.condition.wait_for(lambda: stage.shown is not None or stage.closed, 120.0)  # compiling, too
        if stage.shown is None:
            raise FaceWrinkleError("the face could not be simulated; make a Simulation of it to see why.")

    def __repr__(self) -> str:
        return f"Studio({self.face!r}, {len(self._server.clients)} pages)"

    # --- from Python ---------------------------------------------------------------------------

    @property
    def url(self) -> str:
        """Address of the page."""
        return self._server.url

    @property
    def face(self) -> Face:
        """The face that is shown."""
        return self.stage.face

    @property
    def rates(self) -> dict[str, float]:
        """Weights of expressions, action units and muscles as the sliders have them; may be set.

        Raises
        ------
        UnknownNameError, ParameterError
            For names and weights that the face does not have.
        """
        return dict(self._document.session.mixture)

    @rates.setter
    def rates(self, weights: Mapping[str, float]) -> None:
        self.change(mixture=dict(weights))

    @property
    def session(self) -> Session:
        """All that is set, and the time that is shown; may be set.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> with Studio(fw.default_face(), browser=False) as studio:
        ...     studio.session = fw.Session(mixture={"AU12": 0.5})
        ...     studio.session.mixture
        {'AU12': 0.5}
        """
        return self._library.outside(self._answers.session())

    @session.setter
    def session(self, session: Session) -> None:
        self._edited(lambda: self._document.load(self._library.inside(session)))

    def change(self, **parts: Any) -> None:
        """Set parts of the document, such as ``folds={"depth": 2.0}``, as one step of undo."""
        self._edited(lambda: self._document.change([((name,), value) for name, value in parts.items()]))

    def undo(self) -> bool:
        """Take the last step back; return False if there is none."""
        return self._edited(self._document.undo)

    def redo(self) -> bool:
        """Do the last step that was taken back again."""
        return self._edited(self._document.redo)

    def frame(self, settled: bool = True, timeout: float = 30.0) -> pv.PolyData:
        """Return the frame that is shown: a copy.

        Parameters
        ----------
        settled : bool
            Wait until the face has come to rest with all that was asked for.
        timeout : float
            Seconds to wait at most.

        Raises
        ------
        FaceWrinkleError
            If the face still moves then, as it does while the timeline plays.
        """
        stage = self.stage
        with stage.condition:
            stage.condition.wait_for(lambda: stage.settled or stage.closed, timeout if settled else 0.0)
            if settled and not stage.settled:
                raise FaceWrinkleError(f"the face still moves after {timeout:g} s. Take settled=False.")
            assert stage.shown is not None
            return stage.shown.frame.copy()

    def widget(self, height: int = 520) -> StudioWidget:
        """Return the view and the sliders as a widget, to be shown in a notebook; what changes there changes here.

        Parameters
        ----------
        height : int
            Pixels, 200 to 4000.

        Raises
        ------
        MissingPackageError
            Without the package anywidget.
        """
        check_whole("height", height, 200, 4000)
        with optional_imports("the widget needs"):
            from .widget import StudioWidget
        return StudioWidget(self._server, height)

    def as_python(self) -> str:
        """Return a program that makes what is shown, as the page copies it."""
        return self._answers.as_python()

    def wait(self) -> None:
        """Wait until the studio is closed, or Ctrl-C."""
        while self.stage.is_alive():
            self.stage.join(0.5)

    def close(self) -> None:
        """Disconnect all pages, save the session, and stop."""
        self.stage.close()
        self._server.close()
        self.end()
        atexit.unregister(self.close)

    def end(self) -> None:
        """Save the session, and end files that are being made: all that must be done when a signal ends the process."""
        self._kept.save()
        self._answers.process.stop()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _edited(self, act: Callable[[], object]) -> bool:
        with self.stage.condition:
            done = bool(act())
        self._changed()
        return done

    def _changed(self) -> None:
        self.stage.wake()
        self._server.wake()
        self._kept.changed()

    def _tell(self, text: str) -> None:
        self._server.tell_all(lambda: {"is": "error", "id": 0, "text": text})

    def _complain(self, text: str) -> None:
        """Tell pages, and whoever reads the terminal, as there may be no page."""
        self._tell(text)
        print(text, file=sys.stderr)


def studio(
    face: Face | None = None,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    save_to: str | Path | None = None,
    browser: bool = True,
    listen: int | None = None,
) -> Studio:
    """Open a face in the browser, with a slider for each expression, action unit and muscle.

    Parameters
    ----------
    face : Face, optional
        Default: the built-in head.
    host : str
        Address to listen at. Others than 127.0.0.1 let everybody in the network who knows the address with its key
        use the studio.
    port : int
        0 is any that is free.
    save_to : path, optional
        The one folder that the page may write to, with the session saved by itself. Default: what is saved is
        downloaded.
    browser : bool
        Open the browser; if not, open :attr:`Studio.url` yourself.
    listen : int, optional
        UDP port at which a phone or a tracker may drive the face, at the address of `host`: by Live Link Face, or by
        the Virtual Motion Capture protocol with ARKit's names. No key is asked for. Default: none.

    Returns
    -------
    Studio
        With `rates`, `frame()`, `wait()` and `close()`; it also closes at the end of a `with` statement.

    Raises
    ------
    MissingPackageError
        Without the packages of the extra `studio`.
    ParameterError
        For a port that is in use, and an address that is not of this computer.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> with fw.studio(fw.default_face(), browser=False) as window:
    ...     window.rates = {"AU1": 1.0, "AU2": 1.0}
    ...     frame = window.frame()
    >>> bool(frame["W"].min() < -0.2)
    True
    """
    folder = None if save_to is None else Path(save_to)
    return Studio(face or default_face(), host=host, port=port, save_to=folder, browser=browser, listen=listen)
