"""Radiance HDR pictures (.hdr) as arrays.

A file is a header of lines, an empty line, a line with the size (``-Y 1024 +X 2048``), and rows of pixels: red, green,
blue and a common exponent, a byte each. In most files each of the four is packed by itself, as runs of one value and
as values one by one (Ward, Real Pixels, in Graphics Gems II, 1991; Radiance's color.h). VTK's reader ends the
interpreter, or gives what was in its memory, if a file is damaged.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from ...array_types import Array
from ...errors import MeshError


def radiance_of(data: bytes, name: str) -> Array:
    """Return the radiance (h, w, 3) of the bytes of a Radiance file, the uppermost row first.

    Raises
    ------
    MeshError
        If they are of another format, packed in the way of before 1991, turned, too large, cut off or damaged.

    Examples
    --------
    A red pixel beside a darker one:

    >>> header = b"#?RADIANCE\\nFORMAT=32-bit_rle_rgbe\\n\\n-Y 1 +X 2\\n"
    >>> radiance_of(header + bytes([128, 0, 0, 129, 128, 128, 128, 127]), "two.hdr").tolist()
    [[[1.0, 0.0, 0.0], [0.25, 0.25, 0.25]]]
    """
    header, _, rest = data.partition(b"\n\n")
    size = re.match(rb"-Y (\d{1,9}) \+X (\d{1,9})\n", rest)
    if not header.startswith((b"#?RADIANCE", b"#?RGBE")) or b"32-bit_rle_xyze" in header or size is None:
        raise _unread(name, "it has no header of a picture in RGBE whose first row is the uppermost")
    height, width = int(size[1]), int(size[2])
    most = 2**25  # pixels: 8,192 x 4,096
    if not 0 < height * width <= most:
        raise _unread(name, f"it has {width} x {height} pixels, and at most {most} are read")
    body = rest[size.end() :]
    packed = 8 <= width < 2**15 and body[:4] == b"\2\2" + width.to_bytes(2, "big")
    try:
        pixels = _unpacked(body, height, width) if packed else _flat(body, height, width)
    except (IndexError, ValueError):
        raise _unread(name, f"its data do not hold the {width} x {height} pixels that it announces") from None
    return np.asarray(np.ldexp(pixels[..., :3].astype(np.float64), pixels[..., 3:].astype(np.int32) - 136))


def _unread(name: str, reason: str) -> MeshError:
    return MeshError(f"{name} cannot be read as Radiance HDR: {reason}. Save it again, without cutting it off.")


def _flat(body: bytes, height: int, width: int) -> npt.NDArray[np.uint8]:
    """Return pixels (h, w, 4) that are stored one by one; a ValueError if they are not there."""
    pixels = np.frombuffer(body, np.uint8, 4 * height * width).reshape(height, width, 4)
    if ((pixels[..., :3] == 1).all(axis=2) & (pixels[..., 3] != 0)).any():  # runs of whole pixels, as none has
        raise ValueError
    return pixels


def _unpacked(body: bytes, height: int, width: int) -> npt.NDArray[np.uint8]:
    """Return pixels (h, w, 4) of packed rows; an IndexError or a ValueError if they are damaged."""
    begin, at = body[:4], 0
    shortest = height * (4 + 8 * -(-width // 127))
    if shortest > len(body):
        raise ValueError
    out = np.empty((height, 4 * width), np.uint8)
    for row in out:
        if body[at : at + 4] != begin:
            raise ValueError
        at += 4
        values = bytearray()
        while len(values) < 4 * width:
            count = body[at]
            run, until = count > 128, len(values) % width + (count - 128 if count > 128 else count)
            if count == 0 or until > width:
                raise ValueError
            values += body[at + 1 : at + 2] * (count - 128) if run else body[at + 1 : at + 1 + count]
            at += 2 if run else 1 + count
            if at > len(body):
                raise ValueError
        row[:] = np.frombuffer(values, np.uint8)
    return out.reshape(height, 4, width).transpose(0, 2, 1)
