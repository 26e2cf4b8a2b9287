"""The view and the sliders of a studio as a widget of a notebook."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import anywidget
import traitlets

from ..plotting.web import bundled
from .protocol import LARGEST_MESSAGE, key_of
from .server import Client, Server, page_files

if TYPE_CHECKING:
    from aiohttp import web


def style(files: Mapping[str, tuple[str, bytes]]) -> str:
    """Return the style of the page, for what is inside of a widget alone."""
    inner = files["style.css"][1].decode().replace(":root", "&").replace("html, body", "&")
    inner = re.sub(r"^ *body \{.*\}$", "", inner, flags=re.MULTILINE)
    return f"""
.facewrinkle-studio {{ {inner}
  display: grid; grid-template-columns: 280px minmax(0, 1fr); background: var(--panel);
  color: var(--text); min-height: 200px;
  .left {{ display: flex; flex-direction: column; min-height: 0; }}
  .sliders {{ overflow-y: auto; flex: 1; padding: 4px 12px; }}
  .view {{ position: relative; }}
}}
"""


class _Comm:
    """The channel of a widget, as a socket that a client sends to."""

    def __init__(self, widget: StudioWidget) -> None:
        self._widget = widget

    async def send_str(self, text: str) -> None:
        self._widget.send({"text": text})

    async def send_bytes(self, data: bytes) -> None:
        self._widget.send({"photo": data[:4] == b"PHOT"}, buffers=[data])

    async def close(self, **_: Any) -> None:
        return


class StudioWidget(anywidget.AnyWidget):
    """A studio in a cell of a notebook; :meth:`facewrinkle.live.Studio.widget` makes one.

    Attributes
    ----------
    height : int
        Pixels.
    """

    height = traitlets.Int(520).tag(sync=True)
    _esm = traitlets.Unicode().tag(sync=True)
    _css = traitlets.Unicode().tag(sync=True)

    def __init__(self, server: Server, height: int = 520) -> None:
        files = page_files()
        super().__init__(height=height, _esm=bundled(files, "widget.js") + "export default made;\n", _css=style(files))
        self._server = server
        self._client: Client | None = None
        self.on_msg(self._received)

    def _received(self, _: Any, content: Any, __: Any) -> None:
        text = content.get("text") if isinstance(content, dict) else None
        if not isinstance(text, str) or len(text) > LARGEST_MESSAGE:
            return
        if key_of(text) is not None:  # shown, or shown again: all is sent anew
            socket: web.WebSocketResponse = _Comm(self)  # type: ignore[assignment]
            self._client = self._server.attach(Client(socket), self._client)
        elif self._client is not None:
            self._server.receive(self._client, text)

    def close(self) -> None:
        """Take the widget away; the studio goes on."""
        client = getattr(self, "_client", None)  # also called where the widget could not be made
        if client is not None:
            self._client = None
            self._server.detach(client)
        super().close()
