"""Compressed parts of glTF files: Draco (KHR_draco_mesh_compression) and meshopt (EXT_meshopt_compression)."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import missing_package

DRACO = "KHR_draco_mesh_compression"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
COMPRESSED = {DRACO: "DracoPy", **dict.fromkeys(MESHOPT, "meshoptimizer")}
"""Extensions, and the packages that decode them."""

MOST_BYTES = 2**30
"""A part that would be larger, when it is decoded, is taken for damaged."""


def decoder(extension: str, who: str) -> ModuleType:
    """Return the package that decodes an extension.

    Raises
    ------
    MissingPackageError
        If it is not installed.

    Examples
    --------
    >>> from unittest import mock
    >>> with mock.patch.dict("sys.modules", {"DracoPy": None}):
    ...     decoder(DRACO, "head.glb")
    Traceback (most recent call last):
    facewrinkle.errors.MissingPackageError: head.glb is compressed (KHR_draco_mesh_compression) and needs ...
    """
    name = COMPRESSED[extension]
    try:
        return import_module(name)
    except ImportError:
        otherwise = " Or export it without compression, or as OBJ or PLY."
        raise missing_package(f"{who} is compressed ({extension}) and needs", name, "gltf", otherwise) from None


def draco_arrays(draco: ModuleType, data: bytes, attributes: Mapping[str, int]) -> dict[str, npt.NDArray[Any]]:
    """Return the attributes (n, width) of a primitive that Draco compressed, by name, and its "indices" (m, 1).

    Parameters
    ----------
    draco : module
    data : bytes
    attributes : mapping of str to int
        Names of attributes, and their numbers in the data.

    Raises
    ------
    ValueError
        If the data are damaged or lack an attribute.
    """
    mesh = draco.decode(data)
    found = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
    if lacking := [name for name, number in attributes.items() if number not in found]:
        raise ValueError(f"{lacking[0]} is missing")
    out = {name: found[number].reshape(len(found[number]), -1) for name, number in attributes.items()}
    return {**out, "indices": np.asarray(mesh.faces, np.uint32).reshape(-1, 1)}


def meshopt_bytes(meshopt: ModuleType, data: bytes, how: Mapping[str, Any]) -> bytes:
    """Return the bytes of a buffer view that meshopt compressed.

    Parameters
    ----------
    meshopt : module
    data : bytes
    how : mapping
        The extension of the view: "count", "byteStride", "mode" and "filter".

    Raises
    ------
    ValueError, RuntimeError
        If the data are damaged.
    """
    count, stride, mode = int(how["count"]), int(how["byteStride"]), how["mode"]
    if not 0 < count * stride <= MOST_BYTES:
        raise ValueError(f"{count} entries of {stride} bytes are announced")
    if mode != "ATTRIBUTES":
        decode = {"TRIANGLES": meshopt.decode_index_buffer, "INDICES": meshopt.decode_index_sequence}[mode]
        return bytes(decode(count, stride, data).view(np.uint8)[: count * stride])
    values = meshopt.decode_vertex_buffer(count, stride, data, dtype=np.dtype((np.void, stride)))
    if (name := how.get("filter", "NONE")) != "NONE":
        short = {"OCTAHEDRAL": "oct", "QUATERNION": "quat", "EXPONENTIAL": "exp"}[name]
        values = getattr(meshopt, f"decode_filter_{short}")(values, count, stride)
    return bytes(values.tobytes())
