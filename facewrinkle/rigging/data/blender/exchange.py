"""The selected mesh as a file for the package: its vertices in their order, as they stand in the scene."""

import numpy as np

CHART = "facewrinkle"
"""Name of the UV map that is made for a mesh without any."""


class Refusal(Exception):
    """What cannot be done, as a sentence for the artist."""


def check(obj):
    """Raise a Refusal for a mesh that has no face of its own."""
    if not len(obj.data.polygons):
        raise Refusal(f"{obj.name} has no faces: select the mesh of the head.")
    if any(each.type == "MIRROR" and each.show_viewport for each in obj.modifiers):
        raise Refusal(f"Apply the Mirror modifier of {obj.name} first: the face needs both sides.")
    if abs(np.linalg.det(turn(obj))) < 1e-12:
        raise Refusal(f"{obj.name} is scaled to nothing in one direction: give it a size.")


def turn(obj):
    """Turn and scale (3, 3) of an object, without its place: far from the origin digits would be lost."""
    return np.array(obj.matrix_world.to_3x3())


def rest(obj):
    """Places (n, 3) of the vertices at rest, in the object's own axes: those of the key that others are relative to."""
    keys = obj.data.shape_keys
    return places(keys.reference_key.points if keys else obj.data.vertices)


def places(points):
    """Places (n, 3) of vertices, or of points of a key."""
    values = np.empty(3 * len(points), np.float32)
    points.foreach_get("co", values)
    return values.reshape(-1, 3).astype(np.float64)


def send(obj, path):
    """Write the mesh at rest as OBJ: vertices in their order, polygons, and the active UV map by corner."""
    mesh, uv = obj.data, obj.data.uv_layers.active
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*place) for place in rest(obj) @ turn(obj).T]
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    words = [str(vertex + 1) for vertex in corners]
    if uv is not None and uv.name != CHART:
        where = np.empty(2 * len(corners), np.float32)
        uv.data.foreach_get("uv", where)
        lines += ["vt {:.7g} {:.7g}".format(*place) for place in where.reshape(-1, 2)]
        words = [f"{word}/{corner + 1}" for corner, word in enumerate(words)]
    for polygon in mesh.polygons:
        first = polygon.loop_start
        lines.append("f " + " ".join(words[first : first + polygon.loop_total]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
