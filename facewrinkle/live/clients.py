"""One page that is connected: what it has, what it may be sent, and what waits for it."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from typing import Any

from aiohttp import web

from .encoding import Known, Part, message
from .stage import Shown

CREDIT = 1
"""Frames that may be under way to a page. With 2, what a slow page shows is two to three of its frames old; with 1, a
little more than one.
"""

MOST_WAITING = 64
"""Answers that wait for a page at most; one that reads none of them is disconnected."""


class Client:
    """A page.

    Parameters
    ----------
    socket : WebSocketResponse
    """

    def __init__(self, socket: web.WebSocketResponse) -> None:
        self.socket = socket
        self.field: str | None = None
        self.credit = CREDIT
        self.wake = asyncio.Event()
        self._known: Known = {}
        self._step = 0
        self._document = -1
        self._photos = 0
        self._texts: deque[str] = deque()
        self.lost = False

    def tell(self, what: dict[str, Any]) -> None:
        """Let a message wait for the page."""
        if len(self._texts) >= MOST_WAITING:
            self.lost = True
        else:
            self._texts.append(json.dumps(what, allow_nan=False))
        self.wake.set()

    def drawn(self) -> None:
        """The page has drawn a frame."""
        self.credit = min(self.credit + 1, CREDIT)
        self.wake.set()

    def next_text(self) -> str | None:
        """Return the answer that waits longest, if there is one."""
        return self._texts.popleft() if self._texts else None

    def needs_document(self, version: int) -> bool:
        """Return True, once, if the page does not have this version of the document."""
        if version == self._document:
            return False
        self._document = version
        return True

    def needs_photos(self, number: int) -> bool:
        """Return True, once, if the page does not have these photos."""
        if number == self._photos:
            return False
        self._photos = number
        return True

    def frame(self, shown: Shown | None) -> bytes | None:
        """Return the newest frame as a message, if the page may be sent one that it does not have."""
        field = None if shown is None or self.field is None else shown.fields.get(self.field)
        if shown is None or not self.credit or shown.step == self._step:
            return None
        parts = list(shown.parts)
        if field is not None:
            values = {"value": field.values}
            parts.append(Part("field", "field", shown.step, shown.step, {}, values, {}, field.info))
        box = [*(float(x) for x in shown.box.low), shown.box.size]
        head = {"step": shown.step, "time": round(shown.time, 4), "box": box, "still": shown.still}
        data, self._known = message(head, parts, self._known)
        self._step = shown.step
        self.credit -= 1
        return data
