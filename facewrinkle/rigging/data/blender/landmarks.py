"""Landmarks as empties that can be dragged, and back as the file that the package reads."""

import json

import bpy
import numpy as np

from .exchange import rest, turn

ENTRY = "facewrinkle"
"""Custom property of an empty: what the package wrote about the landmark, as JSON, and where it was put."""


def empties(obj):
    """Empties of a mesh by the name of their landmark."""
    return {json.loads(each[ENTRY])["name"]: each for each in obj.children if each.type == "EMPTY" and ENTRY in each}


def guessed(obj):
    """Return landmarks about where they are on a head that looks along -Y, with Z up, to be dragged into place."""
    points = rest(obj) @ turn(obj).T
    behind, above = (points[:, k] - points[:, k].min() for k in (1, 2))
    height = max(above.max(), 1e-12)
    upper = points[above >= 0.5 * above.max(), 0]
    x = (points[:, 0] - 0.5 * (upper.min() + upper.max())) / max(np.ptp(upper), 1e-12)
    y, z = behind / height, above / height
    # Those that others are estimated from: about where they are, from the middle to a side and from below upwards, in
    # shares of the width of a head without its shoulders, and of its height.
    needed = {
        "eye_{}_inner": (0.11, 0.64), "eye_{}_outer": (0.27, 0.64), "brow_{}_mid": (0.22, 0.73),
        "mouth_{}": (0.15, 0.42), "nose_tip": (0.0, 0.54), "upper_lip_mid": (0.0, 0.45), "lower_lip_mid": (0.0, 0.39),
    }  # fmt: skip
    marks = {}
    for name, (aside, up) in needed.items():
        for side, sign in {"l": 1.0, "r": -1.0}.items():
            off = np.hypot(x - sign * aside, z - up)
            marks[name.format(side)] = {"xyz": points[np.argmin(10.0 * off + y)].tolist()}
    return marks


def show(obj, marks):
    """Make empties of landmarks, in a collection of their own; return how many were estimated."""
    remove(obj)
    collection = bpy.data.collections.new(f"{obj.name} landmarks")
    obj.users_collection[0].children.link(collection)
    to_local = np.linalg.inv(turn(obj)).T
    size = 0.03 * np.linalg.norm(np.subtract(marks["eye_l_outer"]["xyz"], marks["eye_r_outer"]["xyz"]))
    for name, entry in marks.items():
        empty = bpy.data.objects.new(f"{name} of {obj.name}", None)
        empty.parent = obj
        empty.empty_display_type = "PLAIN_AXES" if entry.get("estimated") else "SPHERE"
        empty.empty_display_size = size
        empty.show_in_front = True
        empty.location = np.array(entry["xyz"]) @ to_local
        empty.scale = [1.0 / length for length in obj.matrix_world.to_scale()]
        empty[ENTRY] = json.dumps({"name": name, "put": list(empty.location), **entry})
        collection.objects.link(empty)
    return sum(bool(entry.get("estimated")) for entry in marks.values())


def write(obj, path):
    """Write the landmarks, those that were dragged at their new places; return False if there are none."""
    found = {}
    for empty in empties(obj).values():
        entry = json.loads(empty[ENTRY])
        place, put = np.array(empty.location), entry.pop("put")
        if not np.allclose(place, put, rtol=1e-5, atol=1e-7):
            entry["xyz"] = (place @ turn(obj).T).tolist()
        found[entry.pop("name")] = entry
    path.write_text(json.dumps({"landmarks": found}), encoding="utf-8")
    return bool(found)


def remove(obj):
    for empty in empties(obj).values():
        holders = empty.users_collection
        bpy.data.objects.remove(empty)
        for holder in holders:
            if not holder.objects and not holder.children:
                bpy.data.collections.remove(holder)
