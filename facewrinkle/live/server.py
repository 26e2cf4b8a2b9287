"""The web server of a studio: pages and scripts of the package, and one socket.

It listens on this computer alone unless asked otherwise. A page must name the key that was made at the start, in its
first message; requests from other origins, or for other hosts, are refused. No path of the file system ever comes from
a page.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import logging
import re
import secrets
import socket
import tempfile
import threading
import traceback
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web
from aiohttp.http_exceptions import HttpProcessingError

from ..errors import FaceWrinkleError, ParameterError
from ..plotting.web import web_files
from .protocol import FACE_ALONE, LARGEST_MESSAGE, Change, Known, Message, Shown, key_of, message, parse, photo_message
from .stage import Shown as Frame

LARGEST_UPLOAD = 256 * 2**20
"""Bytes of a file that is sent."""

UPLOAD_TIME = 600.0
"""Seconds that the files of a form may take to arrive."""

LOG = logging.getLogger(__name__)
LOG.addFilter(lambda record: not (record.exc_info and isinstance(record.exc_info[1], HttpProcessingError)))
"""What goes wrong here; requests that are no HTTP, which anyone can send, are refused in silence."""


class Client:
    """A page that is connected: what it has, what it may be sent, and what waits for it.

    Parameters
    ----------
    socket : WebSocketResponse

    Attributes
    ----------
    ready : bool
        True if a frame may be sent: the page has drawn the last one. With two under way, what a slow page shows would
        be two to three of its frames old.
    shows : Field
        What the page shows besides the face.
    change : int
        Number of the page's last change that was taken. A page leaves out documents that its later changes are not in,
        or a slider that is moved would jump back.
    """

    def __init__(self, socket: web.WebSocketResponse) -> None:
        self.socket = socket
        self.shows = FACE_ALONE
        self.ready = True
        self.wake = asyncio.Event()
        self._known: Known = {}
        self.change = 0
        self._step = 0
        self._document = -1, 0
        self._photos = 0
        self._texts: deque[str] = deque()

    def tell(self, what: dict[str, Any]) -> None:
        """Let a message wait for the page."""
        self._texts.append(json.dumps(what, allow_nan=False))
        self.wake.set()

    def drawn(self) -> None:
        """The page has drawn a frame."""
        self.ready = True
        self.wake.set()

    async def send(self, state: Mapping[str, Any]) -> None:
        """Send the page what waits for it, and what of the newest state it does not have and may be sent."""
        while self._texts:
            await self.socket.send_str(self._texts.popleft())
        if (state["version"], self.change) != self._document:
            self._document = state["version"], self.change
            await self.socket.send_str(json.dumps({"is": "document", "change": self.change, **state["document"]()}))
        number, photos = state["photos"]
        if number != self._photos:
            self._photos = number
            for name, photo in photos.items():
                await self.socket.send_bytes(photo_message(name, photo))
        shown = state["shown"]
        if shown is not None and self.ready and shown.step != self._step:
            await self.socket.send_bytes(self._frame(shown))

    def _frame(self, shown: Frame) -> bytes:
        parts = list(shown.parts)
        parts += [shown.fields[name] for name in self.shows.parts & shown.fields.keys()]
        box = [*(float(x) for x in shown.box.low), shown.box.size]
        head = {"step": shown.step, "time": round(shown.time, 4), "box": box, "still": shown.still}
        data, self._known = message(head, parts, self._known)
        self._step = shown.step
        self.ready = False
        return data


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return the files of the page with their types, by name."""
    return web_files(files(__package__) / "page")


async def received(request: web.Request, folder: Path) -> None:
    """Write the files of a form into a folder, under their names without folders.

    Raises
    ------
    ParameterError
        For too large files, two of one name, and a form that makes no sense or does not arrive in time.
    """
    try:
        async with asyncio.timeout(UPLOAD_TIME):
            parts: Any = await request.clone(client_max_size=LARGEST_UPLOAD).multipart()
            async for part in parts:
                with (folder / Path(part.filename).name).open("xb") as file:
                    file.write(await part.read())
    except TimeoutError:
        raise ParameterError(f"the files were not received within {UPLOAD_TIME:g} s. Send smaller ones.") from None
    except Exception as problem:  # a form can be bad in many ways, and a page leave at any time
        raise ParameterError(f"the files were not received: {' '.join(str(problem).split())}.") from None


class Server:
    """A server on a thread of its own.

    Parameters
    ----------
    handler : callable
        Called with a message and the page; it returns the answer.
    state : callable
        Returns the newest frame, the document's version, the document, and the number of the photos and the photos.
    greeting : callable
        Returns what a page is told first.
    opened : callable
        Called, on a thread of its own, with a folder of files; returns the answer.
    host, port :
        Where to listen; port 0 is any that is free.

    Attributes
    ----------
    key : str
        What a page must know.
    port : int
    """

    def __init__(
        self,
        handler: Callable[[Message, Client], Awaitable[Any]],
        state: Callable[[], Mapping[str, Any]],
        greeting: Callable[[], Mapping[str, Any]],
        opened: Callable[[Path], Mapping[str, Any]],
        host: str = "127.0.0.1",
        port: int = 0,
    ) -> None:
        self.key = secrets.token_urlsafe(24)
        self.host, self.port = host, port
        self.clients: dict[Client, asyncio.Task[None]] = {}
        self._handler, self._state, self._greeting = handler, state, greeting
        self._tasks: set[asyncio.Task[None]] = set()
        self._opened = opened
        self._files = page_files()
        self._downloads: dict[str, tuple[str, bytes]] = {}
        self._loop = asyncio.new_event_loop()
        self._packets: asyncio.DatagramTransport | None = None
        app = web.Application(middlewares=[self._guard], client_max_size=LARGEST_MESSAGE)
        app.add_routes(
            [
                web.get("/", self._page),
                web.get("/socket", self._socket),
                web.get("/download/{token}", self._download),
                web.post("/open", self._open),
                web.get("/{name}", self._page),
            ]
        )
        self._runner = web.AppRunner(app, access_log=None, logger=LOG)
        self._thread = threading.Thread(target=self._loop.run_forever, name="facewrinkle studio server", daemon=True)

    @property
    def url(self) -> str:
        """Address of the page, with the key."""
        return f"http://{self._shown_host}:{self.port}/#{self.key}"

    @property
    def _shown_host(self) -> str:
        """The host as others name it; where all addresses of this computer are listened at, that of its network."""
        host = self.host
        if host in ("", "0.0.0.0", "::"):
            family, there = (socket.AF_INET6, "2001:db8::1") if host == "::" else (socket.AF_INET, "192.0.2.1")
            host = "localhost"
            with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as unused:
                unused.connect((there, 9))  # nothing is sent
                host = unused.getsockname()[0]
        return f"[{host}]" if ":" in host else host

    def start(self) -> None:
        """Listen.

        Raises
        ------
        ParameterError
            If the port is in use, or the address is not one of this computer.
        """
        self._thread.start()
        self._listening(self._start(), self.port)

    def listen(self, protocol: asyncio.DatagramProtocol, port: int) -> None:
        """Take packets that are sent to a UDP port, too.

        Raises
        ------
        ParameterError
            If the port is in use, or there is no such port.
        """
        packets = self._loop.create_datagram_endpoint(lambda: protocol, (self.host, port))
        self._packets, _ = self._listening(packets, port)

    def _listening(self, listen: Coroutine[Any, Any, Any], port: int) -> Any:
        try:
            return asyncio.run_coroutine_threadsafe(listen, self._loop).result(10.0)
        except (OSError, OverflowError) as error:
            self.close()
            raise ParameterError(
                f"cannot listen at {self.host}, port {port}: {error.args[-1]}. Choose another port, or 0 "
                "for any that is free."
            ) from None

    async def _start(self) -> None:
        await self._runner.setup()
        await web.TCPSite(self._runner, self.host, self.port).start()
        self.port = int(self._runner.addresses[0][1])

    def close(self) -> None:
        """Disconnect all pages, and stop listening."""
        if self._loop.is_running():
            asyncio.run_coroutine_threadsafe(self._end(), self._loop).result(10.0)
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(10.0)
        if not self._loop.is_closed():
            self._loop.close()

    async def _end(self) -> None:
        for task in list(self._tasks):
            task.cancel()
        for client in list(self.clients):
            await client.socket.close(code=1001, message=b"the studio was closed")
            await self._leave(client)
        if self._packets is not None:
            self._packets.close()
        await self._runner.cleanup()

    def wake(self) -> None:
        """Look for what pages can be sent; from any thread."""
        self._to_all(lambda client: client.wake.set())

    def tell_all(self, what: Callable[[], dict[str, Any]]) -> None:
        """Tell all pages something; from any thread. What tells of the document is made in turn with documents."""
        self._to_all(lambda client: client.tell(what()))

    def _to_all(self, act: Callable[[Client], None]) -> None:
        def acted() -> None:
            for client in self.clients:
                act(client)

        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(acted)

    def offer(self, name: str, data: bytes) -> str:
        """Return the address, good for one download, of data under a name."""
        token = secrets.token_urlsafe(24)
        self._downloads[token] = name, data
        return f"/download/{token}"

    def _is_key(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(errors="replace"), self.key.encode())

    # --- requests ------------------------------------------------------------------------------

    @web.middleware
    async def _guard(self, request: web.Request, handler: Any) -> web.StreamResponse:
        """Refuse requests to other hosts, as a foreign name that leads here, and from other origins."""
        assert request.transport is not None
        address = str(request.transport.get_extra_info("sockname")[0])  # at which it has come in
        own = {"localhost", self._shown_host, f"[{address}]" if ":" in address else address}
        if re.sub(r":\d+$", "", request.host) not in own:
            raise web.HTTPForbidden(text="unknown host: use the address that the studio printed")
        if request.headers.get("Origin", f"http://{request.host}") != f"http://{request.host}":
            raise web.HTTPForbidden(text="unknown origin")
        response: web.StreamResponse = await handler(request)
        return response

    def _headers(self, request: web.Request) -> dict[str, str]:
        return {
            "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
            f"connect-src 'self' ws://{request.host}; img-src 'self' blob: data:; "
            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cache-Control": "no-store",
        }

    async def _page(self, request: web.Request) -> web.Response:
        name = request.match_info.get("name", "index.html")
        if name not in self._files:
            raise web.HTTPNotFound(text="not found", headers=self._headers(request))
        kind, data = self._files[name]
        return web.Response(body=data, content_type=kind, charset="utf-8", headers=self._headers(request))

    async def _download(self, request: web.Request) -> web.Response:
        name, data = self._downloads.pop(request.match_info["token"], ("", b""))
        if not name:
            raise web.HTTPNotFound(text="not found", headers=self._headers(request))
        headers = {**self._headers(request), "Content-Disposition": f'attachment; filename="{name}"'}
        return web.Response(body=data, content_type="application/octet-stream", headers=headers)

    async def _open(self, request: web.Request) -> web.Response:
        """Take files into a new folder, have them read, and say what they were."""
        if request.headers.get("Origin") is None or not self._is_key(request.headers.get("X-Key", "")):
            raise web.HTTPForbidden(text="the key is needed")
        headers = self._headers(request)  # the page may have left when they are needed
        try:
            with tempfile.TemporaryDirectory(prefix="facewrinkle-") as folder:
                await received(request, Path(folder))
                answer = await asyncio.to_thread(self._opened, Path(folder))
            return web.json_response(answer, headers=headers)
        except FaceWrinkleError as error:
            text = " ".join(str(error).split())[:2000].replace(folder + "/", "")
            return web.json_response({"error": text}, status=400, headers=headers)

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if request.headers.get("Origin") is None:
            raise web.HTTPForbidden(text="an origin is needed")
        page = web.WebSocketResponse(max_msg_size=LARGEST_MESSAGE, heartbeat=20.0, compress=False)
        await page.prepare(request)
        first = None
        with suppress(TimeoutError):
            first = await page.receive(timeout=5.0)
        key = key_of(first.data) if first is not None and first.type is WSMsgType.TEXT else None
        if not self._is_key(key or ""):
            await page.close(code=1008, message=b"wrong key")
            return page
        client = self._welcome(Client(page))
        try:
            async for got in page:
                if got.type is not WSMsgType.TEXT:
                    await page.close(code=1003, message=b"text is needed")
                    break
                self._take(client, got.data)
        finally:
            await self._leave(client)
        return page

    def _welcome(self, client: Client) -> Client:
        client.tell({"is": "welcome", **self._greeting()})
        self.clients[client] = asyncio.create_task(self._send(client))
        return client

    # --- clients that are no pages -------------------------------------------------------------

    def attach(self, client: Client, before: Client | None = None) -> Client:
        """Let a client, such as a widget, take part from now on, in place of another; from any thread."""

        async def attached() -> None:
            if before is not None:
                await self._leave(before)
            self._welcome(client)

        asyncio.run_coroutine_threadsafe(attached(), self._loop)
        return client

    def detach(self, client: Client) -> None:
        """Let a client that was attached go; from any thread."""
        if self._loop.is_running():
            asyncio.run_coroutine_threadsafe(self._leave(client), self._loop)

    async def _leave(self, client: Client) -> None:
        if (sender := self.clients.pop(client, None)) is not None:
            sender.cancel()

    def receive(self, client: Client, text: str) -> None:
        """Take a message of a client that was attached; from any thread."""
        if self._loop.is_running():
            self._loop.call_soon_threadsafe(self._take, client, text)

    def _take(self, client: Client, text: str) -> None:
        """Do what a message asks for; meanwhile the page goes on."""
        task = asyncio.create_task(self._do(client, text))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _do(self, client: Client, text: str) -> None:
        number = 0
        try:
            message = parse(text)
            number = message.id
            if isinstance(message, Shown):
                client.drawn()
                return
            if isinstance(message, Change):
                client.change = message.id
            answer = await self._handler(message, client)
        except FaceWrinkleError as error:
            client.tell({"is": "error", "id": number, "text": " ".join(str(error).split())[:2000]})
        except Exception:
            traceback.print_exc()
            client.tell({"is": "error", "id": number, "text": "internal error; see the terminal."})
        else:
            if number:
                client.tell({"is": "answer", "id": number, "value": answer})

    async def _send(self, client: Client) -> None:
        """Send a page what it may be sent, as long as it is connected; one that stalls waits here, alone."""
        with suppress(ConnectionError, RuntimeError):
            while True:
                client.wake.clear()
                await client.send(self._state())
                await client.wake.wait()
