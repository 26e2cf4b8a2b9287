"""Shape keys: the package's displacements on the vertices of a mesh, and phone takes as keyframes."""

import csv
import re

import bpy
import numpy as np

from .exchange import Refusal, rest, turn

OURS = "facewrinkle"
"""Custom property of shape keys: the names of those that were made here."""

RATE = 60.0
"""Rows per second of takes of Live Link Face."""


def ours(obj):
    """Names of the keys of a mesh that were made here."""
    keys = obj.data.shape_keys
    return [name for name in keys.get(OURS, "").split("\n") if name in keys.key_blocks] if keys else []


def add(obj, stored, replace=False):
    """Add shape keys; return their number. Keys made here before are made anew; others only if `replace` is true."""
    if stored["deltas"].shape[1] != len(obj.data.vertices):
        raise Refusal(f"{obj.name} was edited while its keys were made: run it again.")
    names, keys = [str(name) for name in stored["names"]], obj.data.shape_keys
    foreign = [name for name in names if keys and name in keys.key_blocks and name not in ours(obj)]
    if foreign and not replace:
        raise Refusal(f"{obj.name} has {len(foreign)} shape keys of these names, such as {foreign[0]}: tick Replace.")
    if keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
        keys = obj.data.shape_keys
    places, back = rest(obj), np.linalg.inv(turn(obj)).T
    shown, active = obj.show_only_shape_key, obj.active_shape_key_index
    for name, deltas in zip(names, stored["deltas"]):  # noqa: B905 - in pairs, as they were stored
        key = keys.key_blocks.get(name) or obj.shape_key_add(name=name, from_mix=False)
        key.points.foreach_set("co", (places + deltas @ back).astype(np.float32).ravel())
        key.relative_key, key.slider_min, key.slider_max = keys.reference_key, 0.0, 1.0
        if name not in foreign:
            key.value = 0.0
    keys[OURS] = "\n".join(dict.fromkeys([*ours(obj), *names]))
    obj.show_only_shape_key, obj.active_shape_key_index = shown, active
    obj.data.update()
    return len(names)


def remove(obj):
    """Remove the keys that were made here, and a basis that has nothing left to be the basis of."""
    keys, names = obj.data.shape_keys, ours(obj)
    for name in names:
        obj.shape_key_remove(keys.key_blocks[name])
    if names and len(keys.key_blocks) == 1:
        obj.shape_key_remove(keys.key_blocks[0])
    elif keys is not None and OURS in keys:
        del keys[OURS]


# --- takes ----------------------------------------------------------------------------------------------


def read_take(path):
    """Return times (f) in seconds and weights (f) by name of a take of Live Link Face."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = [row for row in csv.DictReader(file) if row.get("Timecode")]
    except (OSError, UnicodeDecodeError, csv.Error):
        raise Refusal(f"{path} cannot be read: choose the CSV file of a take of Live Link Face.") from None
    if not rows:
        raise Refusal(f"{path} is no take of Live Link Face: it needs a column Timecode, and rows.")
    codes = [[float(part) for part in re.split("[:;]", row["Timecode"])] for row in rows]
    times = np.array([np.dot(code, [3600.0, 60.0, 1.0, 1.0 / RATE]) for code in codes])
    weights = {}
    for column in rows[0]:
        try:
            weights[column[0].lower() + column[1:]] = np.array([float(row[column]) for row in rows])
        except (TypeError, ValueError, IndexError):
            continue
    return times - times[0], weights


def perform(obj, path):
    """Add a take as a new action of the shape keys, from the start of the scene; return how many keys it moves."""
    times, weights = read_take(path)
    keys, scene = obj.data.shape_keys, bpy.context.scene
    names = [name for name in weights if keys and name in keys.key_blocks]
    if not names:
        raise Refusal(f"{obj.name} has no shape keys that the take names: add ARKit shapes first.")
    data = keys.animation_data or keys.animation_data_create()
    if data.action is not None:
        data.action.use_fake_user = True  # the action so far stays in the file
    data.action = bpy.data.actions.new(f"{obj.name} {bpy.path.display_name_from_filepath(str(path))}")
    frames = scene.frame_start + times * scene.render.fps / scene.render.fps_base
    for name in names:
        keys.key_blocks[name].keyframe_insert("value", frame=frames[0])
    for curve in _curves(data):
        name = curve.data_path.split('"')[1]
        curve.keyframe_points.add(len(frames) - 1)
        curve.keyframe_points.foreach_set("co", np.stack([frames, weights[name]], axis=1).astype(np.float32).ravel())
        curve.update()
    return len(names)


def _curves(data):
    """Curves of the action of shape keys, in old and new versions of Blender."""
    if hasattr(data.action, "fcurves"):
        return data.action.fcurves
    return data.action.layers[0].strips[0].channelbag(data.action_slot).fcurves
