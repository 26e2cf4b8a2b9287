"""The document of a studio: a session that pages change by patches, with undo and redo.

A patch is a path and a value: ``[["mixture", "AU12L"], 0.7]``. Patches of one gesture, such as the drag of a slider,
are one step of undo. They are applied all or none. Places that come as coordinates become places on triangles, so that
they go along when the face becomes another person.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from ..anatomy.atlas import Atlas
from ..errors import check_name
from ..session import Session
from ..session.session import START


class Document:
    """All that was set by hand, with its history.

    Parameters
    ----------
    atlas : Atlas
        Of the face, for the names that a mixture may have.
    accept : callable, optional
        Called with each new session; returns it with its places on triangles, or raises an error.
    start : Session, optional
        What is set at the beginning, and after a reset.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> document = Document(fw.default_face().atlas)
    >>> document.change([(("mixture", "AU12"), 0.5)], gesture="drag 1")
    >>> document.change([(("mixture", "AU12"), 0.8)], gesture="drag 1")
    >>> document.session.mixture, document.undo(), document.session.mixture
    ({'AU12': 0.8}, True, {})
    """

    def __init__(
        self, atlas: Atlas, accept: Callable[[Session], Session] = lambda session: session, start: Session = START
    ) -> None:
        self._atlas, self._accept, self.start = atlas, accept, accept(start)
        self.version = 0
        self._states = [self.start]
        self._at, self._gesture = 0, ""

    @property
    def session(self) -> Session:
        """All that is set."""
        return self._states[self._at]

    @property
    def history(self) -> tuple[int, int]:
        """Numbers of steps that can be undone, and done again."""
        return self._at, len(self._states) - 1 - self._at

    def change(self, patches: Iterable[tuple[Sequence[str], Any]], gesture: str = "") -> None:
        """Apply patches, all or none; those with the gesture of the last step belong to that step.

        A patch is a path and its new value; None takes an entry of a table away.

        Raises
        ------
        ParameterError, UnknownNameError
            For paths and values that a session does not have or allow.
        """
        table = self.session.table()
        heads = [_set(table, path, value) for path, value in patches]
        if heads:
            parts = {head: table.get(head, getattr(START, head)) for head in heads}
            self._take(self.session.changed(self._atlas, **parts), gesture)

    def _take(self, session: Session, gesture: str = "") -> None:
        """Take a session over, as a step that can be undone."""
        session = self._accept(session)
        if gesture and gesture == self._gesture:
            self._states[self._at :] = [session]
        else:
            self._states[self._at + 1 :] = [session]
            self._at = len(self._states) - 1
        self._gesture, self.version = gesture, self.version + 1

    def undo(self) -> bool:
        """Take the last step back; return False if there is none."""
        return self._move(-1)

    def refuse(self) -> bool:
        """Take the last step back for good, as no face can follow it; return False if there is none."""
        undone = self.undo()
        del self._states[self._at + 1 :]
        return undone

    def redo(self) -> bool:
        """Do the last step that was undone again; return False if there is none."""
        return self._move(1)

    def _move(self, by: int) -> bool:
        if not 0 <= self._at + by < len(self._states):
            return False
        self._at, self._gesture, self.version = self._at + by, "", self.version + 1
        return True

    def reset(self) -> None:
        """Set everything back but the expressions that are kept, as a step that can be undone."""
        self.load(self.start.changed(self._atlas, mixtures=self.session.mixtures))

    def load(self, session: Session | str | bytes) -> None:
        """Take over a session, or that of a file, as a step that can be undone.

        Raises
        ------
        ParameterError
            If it is not a session, or one of a newer version.
        """
        if not isinstance(session, Session):
            session = Session.from_json(session, self._atlas)
        if session != self.session:
            self._take(session)


def _set(data: dict[str, Any], path: Sequence[str], value: Any) -> str:
    """Set an entry of a table, or take it away, and return the name of the part."""
    check_name("part of the session", path[0] if path else "", vars(START))
    table = data
    for name in path[:-1]:
        check_name("table of the session", name, [key for key in table if isinstance(table[key], dict)])
        table = table[name]
    if value is None:
        table.pop(path[-1], None)
    else:
        table[path[-1]] = value
    return path[0]
