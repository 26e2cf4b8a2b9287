"""A phone or a tracker that drives the face: packets of face capture, as they come in over UDP.

Live Link Face (Epic Games), in its mode *Live Link (ARKit)*, sends a packet a frame, with all numbers big-endian: the
version 6 (1 byte), the names of the device and of the subject (a length of 4 bytes each, and so many bytes of UTF-8),
the time (16 bytes), the number 61 (1 byte), and 61 values of 4 bytes: the weights of ARKit's 52 shapes, and nine angles
of the head and the eyes. So it is read and written by github.com/JimWest/PyLiveLinkFace, too.

The Virtual Motion Capture protocol (protocol.vmc.info) sends messages of Open Sound Control: each
``/VMC/Ext/Blend/Val`` has the name of a shape and its weight, and ``/VMC/Ext/Blend/Apply`` ends a frame. A message is
its address, the types of its arguments (``,sf``) and these, in multiples of four bytes; a bundle is ``#bundle``, a time
and messages or bundles, each behind its length (opensoundcontrol.stanford.edu).
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Iterator, Mapping

SHAPES = (
    "eyeBlinkLeft", "eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeSquintLeft",
    "eyeWideLeft", "eyeBlinkRight", "eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight",
    "eyeSquintRight", "eyeWideRight", "jawForward", "jawLeft", "jawRight", "jawOpen", "mouthClose", "mouthFunnel",
    "mouthPucker", "mouthLeft", "mouthRight", "mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft", "mouthFrownRight",
    "mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight", "mouthRollLower", "mouthRollUpper",
    "mouthShrugLower", "mouthShrugUpper", "mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft",
    "mouthLowerDownRight", "mouthUpperUpLeft", "mouthUpperUpRight", "browDownLeft", "browDownRight", "browInnerUp",
    "browOuterUpLeft", "browOuterUpRight", "cheekPuff", "cheekSquintLeft", "cheekSquintRight", "noseSneerLeft",
    "noseSneerRight", "tongueOut",
)  # fmt: skip
"""ARKit's shapes in the order of a packet of Live Link Face."""


def of_live_link(data: bytes) -> dict[str, float]:
    """Return the weights of shapes of a packet of Live Link Face.

    Raises
    ------
    ValueError, struct.error
        If it is none.

    Examples
    --------
    >>> weights = of_live_link(bytes([6]) + b"names and time" + struct.pack(">B61f", 61, 0.25, *[0.0] * 60))
    >>> weights["eyeBlinkLeft"], len(weights)
    (0.25, 52)
    """
    form = ">B61f"  # at the end of a packet are its values, after their number
    count, *values = struct.unpack(form, data[-struct.calcsize(form) :])
    if (data[0], count) != (6, 61):
        raise ValueError("this is no packet of Live Link Face")
    return dict(zip(SHAPES, values, strict=False))


def blends_of_vmc(data: bytes) -> Iterator[tuple[str, float] | None]:
    """Yield the name and the weight of each shape of a packet, and None where a frame ends.

    Raises
    ------
    ValueError, struct.error
        If it is none.

    Examples
    --------
    >>> list(blends_of_vmc(b"/VMC/Ext/Blend/Val\\0\\0,sf\\0Joy\\0" + struct.pack(">f", 0.5)))
    [('Joy', 0.5)]
    """
    if data.startswith(b"#bundle\0"):
        rest = data[16:]
        while rest:
            size = 4 + struct.unpack_from(">I", rest)[0]
            if size > len(rest):
                raise ValueError("a part of the bundle is missing")
            yield from blends_of_vmc(rest[4:size])
            rest = rest[size:]
        return
    address, types = _text_of(data, 0)
    if address == "/VMC/Ext/Blend/Apply":
        yield None
    elif address == "/VMC/Ext/Blend/Val" and data[types : types + 4] == b",sf\0":
        shape, at = _text_of(data, types + 4)
        yield shape, *struct.unpack_from(">f", data, at)


def _text_of(data: bytes, start: int) -> tuple[str, int]:
    """Return the text at a place of a message, and where the next argument begins."""
    end = data.index(b"\0", start)
    return data[start:end].decode(), 4 * (end // 4 + 1)


class Capture(asyncio.DatagramProtocol):
    """Drives a face by packets, until none comes any more; bad ones are left out.

    Parameters
    ----------
    show : callable
        Called with the weights of a frame by shape; with none once the sender has fallen silent.
    tell : callable
        Called with the name of a sender that begins; "" once it has fallen silent.
    """

    def __init__(self, show: Callable[[Mapping[str, float]], None], tell: Callable[[str], None]) -> None:
        self._show, self._tell = show, tell
        self._values: dict[str, float] = {}
        self._end: asyncio.TimerHandle | None = None

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """See :class:`asyncio.DatagramProtocol`."""
        try:
            name, weights = self._read(data)
            if not weights:
                return
            self._show({shape: min(1.0, max(0.0, value)) for shape, value in weights.items()})  # NaN becomes 0
        except Exception:  # everybody can send anything
            return
        if self._end is None:
            self._tell(name)
        else:
            self._end.cancel()
        self._end = asyncio.get_running_loop().call_later(1.0, self._silent)  # a second of silence

    def _read(self, data: bytes) -> tuple[str, Mapping[str, float]]:
        """Return the name of a sender, and weights, if the packet completes a frame."""
        if not data.startswith((b"/", b"#")):
            return "Live Link Face", of_live_link(data)
        frame: Mapping[str, float] = {}
        for blend in list(blends_of_vmc(data)):
            if blend is None:
                frame, self._values = self._values, {}
            elif len(self._values) < 256:  # no sender has more shapes
                self._values[blend[0]] = blend[1]
        return "VMC", frame

    def _silent(self) -> None:
        self._end, self._values = None, {}
        self._show({})
        self._tell("")
