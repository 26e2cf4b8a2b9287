"""A page without a browser: what it sends and receives over a real socket."""

import asyncio
import json
import re
import struct
import time
from contextlib import closing, suppress
from urllib.parse import urlsplit

import aiohttp
import numpy as np

from facewrinkle.session.parts import point_of


def decoded(data):
    """Return the header of a message and the arrays in it, by the names of the parts."""
    length = struct.unpack_from("<I", data)[0]
    head = json.loads(data[4 : 4 + length])
    arrays = {
        part["name"]: {
            name: np.frombuffer(data, entry[0], entry[2], 4 + length + entry[1]).reshape(-1, entry[3])
            for name, entry in part["arrays"].items()
            if entry is not None
        }
        for part in head["parts"]
    }
    return head, arrays


def restored(numbers, box):
    """The points that whole numbers in the box of a frame, its low corner and its size, stand for."""
    return np.array(box[:3]) + np.asarray(numbers, float) * (box[3] / 65535)


class Page:
    """Keeps what it was sent, as a browser does, and acknowledges frames."""

    def __init__(self, studio, key=None, origin=None):
        self._runner = asyncio.Runner()
        self.arrays, self.head = {}, None
        self.texts, self.frames, self.bytes, self.photos, self.number = [], 0, [], {}, 0
        address, _, own = studio.url.partition("/#")
        self._session = self.run(_session())
        headers = {"Origin": address if origin is None else origin}
        try:
            self.socket = self.run(self._session.ws_connect(f"{address}/socket", headers=headers, max_msg_size=0))
        except BaseException:
            self.close()
            raise
        self.send("hello", key=own if key is None else key)

    def run(self, awaitable):
        async def awaited():
            return await awaitable

        return self._runner.run(awaited())

    def close(self):
        self.run(self._session.close())
        self._runner.close()

    def receive(self, timeout=20.0, shown=True):
        """The next message: its text as an object, the head of a frame, or None when the socket is closed."""
        got = self.run(asyncio.wait_for(self.socket.receive(), timeout))
        if got.type is aiohttp.WSMsgType.TEXT:
            self.texts.append(json.loads(got.data))
            return self.texts[-1]
        if got.type is not aiohttp.WSMsgType.BINARY:
            return None
        if got.data[:4] == b"PHOT":
            length = int.from_bytes(got.data[4:8], "little")
            self.photos[got.data[8 : 8 + length].decode()] = got.data[8 + length :]
            return {"is": "photo"}
        self.head, arrays = decoded(got.data)
        for name, values in arrays.items():
            self.arrays.setdefault(name, {}).update(values)
        self.frames += 1
        self.bytes.append(len(got.data))
        if shown:
            with suppress(aiohttp.ClientConnectionResetError):  # as in a browser, where the other end has closed
                self.send("shown")
        return self.head

    def send(self, do, **arguments):
        self.say(json.dumps({"do": do, **arguments}))

    def say(self, text):
        self.run(self.socket.send_str(text))

    def until(self, right, timeout=20.0):
        """Receive until a message is as wanted."""
        while True:
            got = self.receive(timeout)
            assert got is not None, f"closed: {self.socket.close_code}"
            if right(got):
                return got

    def heard(self, what):
        """Receive until a message is of a kind."""
        return self.until(lambda got: got.get("is") == what)

    def frame(self):
        """Receive until a frame comes."""
        return self.until(lambda got: "step" in got)

    def ask(self, do, **arguments):
        """Send a command, and return its answer."""
        self.number += 1
        self.send(do, id=self.number, **arguments)
        return self.until(lambda got: got.get("id") == self.number)

    def change(self, *path, gesture=""):
        """Change the document: the last of the arguments is the value."""
        return self.ask("change", patches=[[list(path[:-1]), path[-1]]], gesture=gesture)

    def settled(self, studio):
        """Receive until the newest frame of a studio at rest has come."""
        while True:
            while not studio.stage.settled or self.head is None:
                self.receive()
            if self.head["step"] == studio.stage.shown.step:
                return
            self.receive()


async def _session():
    return aiohttp.ClientSession()


def until(right, seconds=30.0):
    """Wait until something holds, and return it."""
    end = time.monotonic() + seconds
    while not (value := right()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return value


def head_files(face, folder):
    """Write the head as a scan with landmarks; return the names of the files."""
    mesh = face.mesh.copy()
    mesh.point_data.clear()
    mesh.save(folder / "head.ply")
    landmarks = {name: place.tolist() for name, place in face.landmarks.items()}
    (folder / "head.json").write_text(json.dumps(landmarks))
    return ["head.ply", "head.json"]


def root(studio):
    return studio.url.partition("/#")[0]


def port(studio):
    return urlsplit(studio.url).port


def pages(studio):
    """How many are connected, as the studio says."""
    return int(re.search(r"(\d+) pages", repr(studio))[1])


def page(studio, key=None, origin=None):
    """A page that is connected to a studio; with other keys and origins than it should have, on request."""
    return closing(Page(studio, key, origin))


def sent(studio, files, key=None, origin=None):
    """Send files as a form, with other keys and origins than it should have on request; return status and text."""

    async def answered():
        form = aiohttp.FormData()
        for name, content in files.items():
            form.add_field("file", content, filename=name, content_type="application/octet-stream")
        headers = {"X-Key": studio.url.partition("#")[2] if key is None else key}
        if origin != "":
            headers["Origin"] = origin or root(studio)
        async with (
            aiohttp.ClientSession() as session,
            session.post(f"{root(studio)}/open", data=form, headers=headers) as answer,
        ):
            return answer.status, await answer.text()

    return asyncio.run(answered())


def document(studio):
    """All that is set in a studio, as plain data, with coordinates on the face at rest for places on its skin."""
    session, face = studio.session, studio.face
    table = {name: value for name, value in session.table().items() if name not in ("time", "look")}
    for part in ("landmarks", "probes"):
        table[part] = {name: point_of(place, face) for name, place in getattr(session, part).items()}
    for name, pattern in session.patterns.items():
        table["patterns"][name]["center"] = point_of(pattern.center, face)
    for name, tear in session.tears.items():
        table["tears"][name]["start"] = point_of(tear.start, face)
    return table
