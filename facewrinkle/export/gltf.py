"""The meshes of a moment as glTF 2.0."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from ..errors import MissingPackageError
from .model import Model

WATER, CLEAR = 1.33, 0.3
"""Refractive index of tears, and how opaque they are where nothing is refracted."""
FLOAT, SHORT, INT = 5126, 5123, 5125
VERTICES, INDICES = 34962, 34963
SKIN = [0.72, 0.41, 0.27, 1.0]
"""Linear colour where there is neither texture nor colours."""
ROUGH = {"eye": 0.05, "upper": 0.25, "lower": 0.25, "mouth": 1.0, "tears": 0.0}
"""Of eyes, teeth and tears, which are wet, and of the dark behind the lips."""


def gltf(models: dict[str, Model], unit: float, turn: npt.NDArray[np.float64] | None = None, *, binary: bool) -> bytes:
    """A .glb file, or a .gltf file with everything in it.

    Parameters
    ----------
    models : dict of str to Model
        What becomes a mesh and a node of this name.
    unit : float
        Millimetres per unit: points are kept as they are, and the nodes scale them to metres.
    turn : (3, 3) float, optional
        A rotation by which the nodes make +y up and +z the front, as the format asks.
    binary : bool
    """
    try:
        import pygltflib
    except ImportError:
        raise MissingPackageError(
            "to write glTF needs the package pygltflib, which is not installed. pip install 'facewrinkle[export]'. OBJ "
            "and PLY are written without it."
        ) from None
    file = _File(pygltflib)
    for name, model in models.items():
        file.mesh(name, model, unit / 1000.0, turn)
    return file.written(binary=binary)


class _File:
    """A glTF file in the making."""

    def __init__(self, pygltflib: Any) -> None:
        self.lib = pygltflib
        self.blob = bytearray()
        self.content = pygltflib.GLTF2(asset=pygltflib.Asset(generator="facewrinkle"), scene=0)

    def view(self, data: bytes, target: int | None = None) -> int:
        """The number of a buffer view that holds bytes."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        view = self.lib.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=len(data), target=target)
        self.blob += data
        self.content.bufferViews.append(view)
        return len(self.content.bufferViews) - 1

    def array(
        self,
        values: np.ndarray,
        component: int,
        kind: str,
        *,
        target: int = VERTICES,
        normalized: bool = False,
        bounded: bool = False,
    ) -> int:
        """The number of an accessor that holds rows of numbers."""
        limits = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()} if bounded else {}
        view = self.view(values.tobytes(), target)
        self.content.accessors.append(
            self.lib.Accessor(
                bufferView=view,
                byteOffset=0,
                componentType=component,
                count=len(values),
                type=kind,
                normalized=normalized,
                **limits,
            )
        )
        return len(self.content.accessors) - 1

    def image(self, png: bytes) -> int:
        """The number of a texture."""
        lib, content = self.lib, self.content
        content.images.append(lib.Image(bufferView=self.view(png), mimeType="image/png"))
        content.samplers.append(lib.Sampler(magFilter=lib.LINEAR, minFilter=lib.LINEAR_MIPMAP_LINEAR))
        content.textures.append(lib.Texture(source=len(content.images) - 1, sampler=len(content.samplers) - 1))
        return len(content.textures) - 1

    def mesh(self, name: str, model: Model, scale: float, turn: npt.NDArray[np.float64] | None) -> None:
        """Add a mesh in a node of its own, with a material."""
        lib, content = self.lib, self.content
        attributes = {
            "POSITION": self.array(model.points.astype("<f4"), FLOAT, "VEC3", bounded=True),
            "NORMAL": self.array(_unit(model.normals).astype("<f4"), FLOAT, "VEC3"),
        }
        if model.uv is not None:
            attributes["TEXCOORD_0"] = self.array((model.uv * [1.0, -1.0] + [0.0, 1.0]).astype("<f4"), FLOAT, "VEC2")
        look: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": ROUGH.get(name.split("_")[0], 0.55)}
        if model.png is not None:
            look["baseColorTexture"] = lib.TextureInfo(index=self.image(model.png))
        elif model.colours is not None:  # they would multiply the texture
            attributes["COLOR_0"] = self.array(_linear(model.colours), SHORT, "VEC4", normalized=True)
        else:
            look["baseColorFactor"] = [1.0, 1.0, 1.0, CLEAR] if model.clear else SKIN
        indices = self.array(model.triangles.astype("<u4").reshape(-1, 1), INT, "SCALAR", target=INDICES)
        shape = lib.Primitive(attributes=lib.Attributes(**attributes), indices=indices, material=len(content.materials))
        surface = lib.PbrMetallicRoughness(**look)
        alpha = lib.BLEND if model.clear else lib.MASK if model.cutout else lib.OPAQUE
        material = lib.Material(name=name, doubleSided=True, pbrMetallicRoughness=surface, alphaMode=alpha)
        if model.clear:
            material.extensions = {"KHR_materials_ior": {"ior": WATER}}
            content.extensionsUsed = ["KHR_materials_ior"]
        content.materials.append(material)
        rotation = None if turn is None else Rotation.from_matrix(turn).as_quat().tolist()
        content.nodes.append(lib.Node(name=name, mesh=len(content.meshes), scale=[scale] * 3, rotation=rotation))
        content.meshes.append(lib.Mesh(name=name, primitives=[shape]))

    def written(self, *, binary: bool) -> bytes:
        """All as bytes, in one scene."""
        lib, content = self.lib, self.content
        content.scenes.append(lib.Scene(nodes=list(range(len(content.nodes)))))
        self.blob += b"\0" * (-len(self.blob) % 4)
        buffer = lib.Buffer(byteLength=len(self.blob))
        content.buffers.append(buffer)
        if binary:
            content.set_binary_blob(bytes(self.blob))
            return b"".join(content.save_to_bytes())
        buffer.uri = "data:application/octet-stream;base64," + base64.b64encode(self.blob).decode()
        return str(content.to_json(indent=None)).encode()


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length 1, as the format asks; upwards where there is none."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0.0, vectors / np.maximum(lengths, 1e-300), [0.0, 1.0, 0.0])


def _linear(colours: np.ndarray) -> np.ndarray:
    """Linear light (n, 4) in 65,535ths, opaque, of sRGB colours (n, 3) in 255ths."""
    share = colours / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(65535.0 * np.hstack([light, np.ones((len(light), 1))])).astype("<u2")
