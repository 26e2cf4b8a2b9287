"""PYTHON blender.py FILE NPZ: imports a rig with separate wrinkles into Blender, and prints as JSON what it finds.

FILE is a .glb, NPZ holds the names, points and displacements of the skin that are expected.
"""

import json
import sys

import bpy
import numpy as np

path, expected = sys.argv[-2:]
expected = np.load(expected)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=path)
meshes = [thing for thing in bpy.data.objects if thing.type == "MESH"]
names = {thing.name: [key.name for key in thing.data.shape_keys.key_blocks][1:] for thing in meshes}
skin = bpy.data.objects["face"]
keys = skin.data.shape_keys.key_blocks


def places(key):
    values = np.empty(3 * len(skin.data.vertices), np.float32)
    key.data.foreach_get("co", values)
    x, z, y = values.reshape(-1, 3).T.astype(float)  # Blender turns +y up into +z up
    return np.stack([x, y, -z], axis=1)


rest = places(keys[0])
deltas = np.stack([places(key) - rest for key in keys[1:]])
found = {
    "names": names,
    "points": float(np.abs(rest - expected["points"]).max()),
    "deltas": float(np.abs(deltas - expected["deltas"]).max()),
    "drivers": {name: list(values) for name, values in skin.data.get("drivers", {}).items()},
}
action = skin.data.shape_keys.animation_data
if action is not None and action.action is not None:
    start, end = action.action.frame_range
    shown = []
    for frame in (start, 0.5 * (start + end)):
        bpy.context.scene.frame_set(int(frame), subframe=frame - int(frame))
        mesh = skin.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        values = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", values)
        shown.append(values.reshape(-1, 3))
    found["plays"] = float(np.linalg.norm(shown[1] - shown[0], axis=1).max())
print("found " + json.dumps(found))
