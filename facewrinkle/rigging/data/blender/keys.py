"""Shape keys: the package's displacements on the vertices of a mesh, and takes as keyframes."""

import math

import bpy
import numpy as np

from .exchange import Refusal, rest, turn

OURS = "facewrinkle"
"""Custom property of shape keys: the names of those that were made here."""


HERS = "facewrinkle hers"
"""Custom property of shape keys: the names of the artist's own that wrinkles and the copy go by."""


def _listed(obj, entry):
    keys = obj.data.shape_keys
    return [name for name in keys.get(entry, "").split("\n") if name in keys.key_blocks] if keys else []


def ours(obj):
    """Names of the keys of a mesh that were made here."""
    return _listed(obj, OURS)


def followed(obj):
    """Names of the keys that wrinkles and the copy go by: made here, or the artist's own of the same names."""
    return [*_listed(obj, OURS), *_listed(obj, HERS)]


def add(obj, stored):
    """Add shape keys, and make those anew that were made here before; the artist's own of such names stay.

    Returns the number of the former, and of the latter.
    """
    if stored["deltas"].shape[1] != len(obj.data.vertices):
        raise Refusal(f"{obj.name} was edited while its keys were made: run it again.")
    names, keys = [str(name) for name in stored["names"]], obj.data.shape_keys
    hers = [name for name in names if keys and name in keys.key_blocks and name not in ours(obj)]
    if keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
        keys = obj.data.shape_keys
    places, back = rest(obj), np.linalg.inv(turn(obj)).T
    shown, active = obj.show_only_shape_key, obj.active_shape_key_index
    for name, deltas in zip(names, stored["deltas"]):  # noqa: B905 - in pairs, as they were stored
        if name in hers:
            continue
        key = keys.key_blocks.get(name) or obj.shape_key_add(name=name, from_mix=False)
        key.points.foreach_set("co", (places + deltas @ back).astype(np.float32).ravel())
        key.relative_key, key.slider_min, key.slider_max = keys.reference_key, 0.0, 1.0
        key.value = 0.0
    keys[OURS] = "\n".join(dict.fromkeys([*ours(obj), *(name for name in names if name not in hers)]))
    keys[HERS] = "\n".join(dict.fromkeys([*_listed(obj, HERS), *hers]))
    obj.show_only_shape_key, obj.active_shape_key_index = shown, active
    obj.data.update()
    return len(names) - len(hers), len(hers)


def remove(obj):
    """Remove the keys that were made here, and a basis that has nothing left to be the basis of."""
    keys, names = obj.data.shape_keys, ours(obj)
    for name in names:
        obj.shape_key_remove(keys.key_blocks[name])
    if names and len(keys.key_blocks) == 1:
        obj.shape_key_remove(keys.key_blocks[0])
    elif keys is not None and OURS in keys:
        del keys[OURS], keys[HERS]


# --- takes ----------------------------------------------------------------------------------------------


def perform(obj, path, name):
    """Add a take, as the package writes it, as a new action of the keys from the start of the scene.

    The scene becomes as long as the take, if it is shorter. Returns how many keys it moves, and its last frame.
    """
    take = np.genfromtxt(path, delimiter=",", names=True, ndmin=1)
    keys, scene = obj.data.shape_keys, bpy.context.scene
    names = [each for each in take.dtype.names if keys and each in keys.key_blocks]
    if not names:
        raise Refusal(f"{obj.name} has no shape keys that the take names: add shapes first.")
    data = keys.animation_data or keys.animation_data_create()
    if data.action is not None:
        data.action.use_fake_user = True  # the action so far stays in the file
    data.action = bpy.data.actions.new(f"{obj.name} {name}")
    frames = scene.frame_start + take["time"] * scene.render.fps / scene.render.fps_base
    for each in names:
        keys.key_blocks[each].keyframe_insert("value", frame=frames[0])
    for curve in curves(data):
        each = curve.data_path.split('"')[1]
        curve.keyframe_points.add(len(frames) - 1)
        curve.keyframe_points.foreach_set("co", np.stack([frames, take[each]], axis=1).astype(np.float32).ravel())
        curve.update()
    last = math.ceil(frames[-1])
    scene.frame_end = max(scene.frame_end, last)
    return len(names), last


def curves(data):
    """Curves of the action of shape keys, in old and new versions of Blender."""
    if hasattr(data.action, "fcurves"):
        return data.action.fcurves
    return data.action.layers[0].strips[0].channelbag(data.action_slot).fcurves
