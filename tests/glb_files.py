"""Binary glTF files put together by tests."""

import json
import struct

import numpy as np

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


KINDS = {"f4": 5126, "u2": 5123, "u4": 5125, "u1": 5121, "i1": 5120, "i2": 5122}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class GltfFile:
    """A glTF file in the making: arrays become accessors, the rest is `content`."""

    def __init__(self):
        self.blob = bytearray()
        self.content = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
            "meshes": [],
            "nodes": [],
            "scenes": [{"nodes": [0]}],
            "scene": 0,
        }

    def view(self, data, **more):
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.content["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), **more})
        self.blob += data
        return len(self.content["bufferViews"]) - 1

    def array(self, values, kind="f4", view=None, **more):
        values = np.atleast_1d(np.asarray(values))
        values = values.reshape(len(values), -1)
        index = self.view(values.astype("<" + kind).tobytes()) if view is None else view
        accessor = {"componentType": KINDS[kind], "count": len(values), "type": TYPES[values.shape[1]], **more}
        if index is not False:
            accessor["bufferView"] = index
        self.content["accessors"].append(accessor)
        return len(self.content["accessors"]) - 1

    def mesh(self, points, triangles, shapes=(), names=None, texture=None, name=None, **more):
        attributes = {"POSITION": self.array(points)}
        if texture is not None:
            attributes["TEXCOORD_0"] = self.array(texture)
        primitive = {"attributes": attributes, "indices": self.array(np.ravel(triangles), "u2"), **more}
        if len(shapes):
            primitive["targets"] = [{"POSITION": self.array(shape)} for shape in shapes]
        mesh = {"name": name or f"mesh{len(self.content['meshes'])}", "primitives": [primitive]}
        if names:
            mesh["extras"] = {"targetNames": names}
        self.content["meshes"].append(mesh)
        return len(self.content["meshes"]) - 1

    def node(self, **what):
        self.content["nodes"].append(what)
        return len(self.content["nodes"]) - 1

    def animate(self, *channels, name=None):
        """Channels of (node, path, times, values) or (..., interpolation)."""
        animation = {"samplers": [], "channels": []} | ({"name": name} if name else {})
        for node, path, times, values, *kind in channels:
            flat = np.asarray(values, float)
            flat = flat.reshape(-1, 1) if path == "weights" else flat.reshape(-1, 4 if path == "rotation" else 3)
            sampler = {"input": self.array(times), "output": self.array(flat)}
            animation["samplers"].append(sampler | ({"interpolation": kind[0]} if kind else {}))
            target = {"node": node, "path": path}
            animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})
        self.content.setdefault("animations", []).append(animation)

    def glb(self, path):
        return write_glb(path, self.content | {"buffers": [{"byteLength": len(self.blob)}]}, self.blob)

    def gltf(self, path, uri):
        self.content["buffers"] = [{"byteLength": len(self.blob), "uri": uri}]
        path.write_text(json.dumps(self.content))
        return path
