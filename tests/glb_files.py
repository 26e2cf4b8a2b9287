"""Binary glTF files put together by tests."""

import json
import struct

HEADER, CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")


def write_glb(path, content, blob):
    """Write JSON and its one buffer (described where the JSON does not) as a GLB file; returns its path."""
    text = json.dumps({"buffers": [{"byteLength": len(blob)}]} | content).encode()
    text += b" " * (-len(text) % 4)
    blob = bytes(blob) + b"\0" * (-len(blob) % 4)
    chunks = CHUNK.pack(len(text), b"JSON") + text + CHUNK.pack(len(blob), b"BIN\0") + blob
    path.write_bytes(HEADER.pack(b"glTF", 2, HEADER.size + len(chunks)) + chunks)
    return path


def read_glb(path):
    """JSON without the buffer (dict), and what is in the buffer (bytearray), of a GLB file."""
    data = path.read_bytes()
    start = HEADER.size + CHUNK.size
    length, _ = CHUNK.unpack_from(data, HEADER.size)
    content = json.loads(data[start : start + length])
    del content["buffers"]
    return content, bytearray(data[start + length + CHUNK.size :])
