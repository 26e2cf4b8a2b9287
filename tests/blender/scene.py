"""PYTHON scene.py SCENARIO FOLDER: plays a scenario with the extension in Blender, and prints what came of it as JSON.

FOLDER holds `python`, which the extension runs in place of a Python with facewrinkle.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

import bpy  # first: it brings the others

# isort: split
import addon_utils
import bmesh
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from mathutils.geometry import barycentric_transform

sys.path.insert(0, str(Path(__file__).parents[2] / "facewrinkle" / "rigging" / "data"))
folder = Path(sys.argv[2])


def begin():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("blender", default_set=True)
    bpy.context.preferences.addons["blender"].preferences.python = str(folder / "python")


def head(path, doubled=False):
    """An artist's head: turned, scaled and moved, n-gons, two UV maps, a modifier, a key and materials of her own.

    Maybe its vertices are doubled along the middle.
    """
    bpy.ops.wm.obj_import(filepath=str(path))
    (obj,) = bpy.context.selected_objects
    bpy.context.view_layer.objects.active = obj
    obj.name, mesh = "Änne's head", obj.data
    work = bmesh.new()
    work.from_mesh(mesh)
    work.faces.ensure_lookup_table()
    back = sorted(work.faces, key=lambda face: face.calc_center_median().z)[:40]  # away from the face
    bmesh.ops.dissolve_faces(work, faces=back[:2] if back[0].edges[0] in back[1].edges else [back[0]])
    if doubled:
        middle = [edge for edge in work.edges if all(abs(vertex.co.x) < 1e-5 for vertex in edge.verts)]
        bmesh.ops.split_edges(work, edges=middle)
    work.to_mesh(mesh)
    work.free()
    mesh.uv_layers.new(name="second", do_init=True)
    mesh.uv_layers.active_index = 0
    obj.rotation_euler, obj.scale, obj.location = (1.2, 0.3, 0.4), (0.1, 0.1, 0.1), (3.0, -2.0, 5.0)
    skin, other = (bpy.data.materials.new(name) for name in ("skin", "other"))
    skin.use_nodes = other.use_nodes = True
    tree = skin.node_tree
    bump = tree.nodes.new("ShaderNodeBump")
    tree.links.new(bump.outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
    mesh.materials.clear()
    mesh.materials.append(skin)
    mesh.materials.append(other)
    obj.modifiers.new("Subdivision", "SUBSURF")
    obj.shape_key_add(name="Basis")
    mine = obj.shape_key_add(name="mine")
    for point in mine.points:
        point.co *= 1.03
    mine.value = 0.25
    bpy.context.view_layer.update()
    return obj


def places(points):
    values = np.empty(3 * len(points), np.float32)
    points.foreach_get("co", values)
    return values.reshape(-1, 3).astype(float)


KINDS = ("images", "node_groups", "objects", "meshes", "materials", "actions", "collections", "shape_keys")


def state(obj):
    """All that must not change."""
    keys, trees = obj.data.shape_keys, [each.node_tree for each in obj.data.materials if each and each.node_tree]
    return {
        "vertices": places(obj.data.vertices).tolist(),
        "faces": [list(face.vertices) for face in obj.data.polygons],
        "keys": {key.name: [key.value, places(key.points).tolist()] for key in keys.key_blocks} if keys else None,
        "uv": [layer.name for layer in obj.data.uv_layers],
        "modifiers": [each.name for each in obj.modifiers],
        "materials": [each.name for each in obj.data.materials],
        "links": [sorted(f"{x.from_node.name} {x.to_node.name} {x.to_socket.name}" for x in t.links) for t in trees],
        "place": [list(row) for row in obj.matrix_world],
        "counts": {kind: len(getattr(bpy.data, kind)) for kind in KINDS},
    }


def told(operator, **options):
    """Return the sentence with which an operator refuses; "" if it does what it should."""
    try:
        operator(**options)
    except RuntimeError as problem:
        return str(problem).strip()
    return ""


def changed(one, other):
    """Names of what is not the same in two states."""
    return [f"{name}: {one[name]}, {other[name]}"[:300] for name in one if one[name] != other[name]]


def stray():
    """What runs must not leave: open files, and temporary folders."""
    return len(os.listdir("/proc/self/fd")), len([*Path(tempfile.gettempdir()).glob("facewrinkle_*")])


def evaluated(obj):
    return places(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices)


def off_the_skin(obj, tears):
    """The largest distance of tears from where the nearest skin takes them in a pose, in the unit of the mesh."""
    obj.modifiers["Subdivision"].show_viewport = False
    blocks = obj.data.shape_keys.key_blocks
    blocks["mine"].value = blocks["age"].value = 0.0
    bpy.context.scene.frame_set(50)
    before = evaluated(tears)
    blocks["jawOpen"].value = blocks["mouthSmileLeft"].value = 0.5
    bpy.context.view_layer.update()
    after = evaluated(tears)
    rest, mixed = (places(obj.data.vertices), evaluated(obj))
    obj.data.calc_loop_triangles()
    triangles = [tuple(triangle.vertices) for triangle in obj.data.loop_triangles]
    tree, worst = BVHTree.FromPolygons(rest.tolist(), triangles), 0.0
    for number in range(0, len(before), 97):
        near, _, at, _ = tree.find_nearest(before[number])
        corners = list(triangles[at])
        there = barycentric_transform(near, *(Vector(p) for p in rest[corners]), *(Vector(p) for p in mixed[corners]))
        worst = max(worst, np.linalg.norm(np.subtract(there, near) - (after[number] - before[number])))
    moved = float(np.linalg.norm(after - before, axis=1).max())
    blocks["jawOpen"].value = blocks["mouthSmileLeft"].value = 0.0
    blocks["mine"].value = 0.25
    obj.modifiers["Subdivision"].show_viewport = True
    return [worst, moved]


def everything(path):
    """All operators on a head; then save, open again, and clear."""
    from blender import exchange, landmarks

    obj = head(path, doubled=True)
    bpy.ops.mesh.primitive_cube_add()
    other = bpy.context.object
    other.shape_key_add(name="Basis")
    other.shape_key_add(name="jawOpen").points[0].co.x += 1.0
    other.data.materials.append(bpy.data.materials.new("hers"))
    bpy.context.view_layer.objects.active = obj
    before, apart, found, open_before = state(obj), state(other), {}, stray()
    bpy.context.scene.facewrinkle.size = "256"
    found["find"] = told(bpy.ops.facewrinkle.find_face)
    found["landmarks"] = len(obj.children)
    exchange.send(obj, folder / "sent.obj")
    landmarks.write(obj, folder / "marks.json")
    found["add"] = told(bpy.ops.facewrinkle.add_wrinkles)
    after = state(obj)
    names = [name for name in after["keys"] if name not in before["keys"]]
    turn = np.array(obj.matrix_world.to_3x3())
    rest = places(obj.data.shape_keys.reference_key.points)
    deltas = np.array([places(obj.data.shape_keys.key_blocks[name].points) - rest for name in names])
    np.savez(folder / "keys.npz", names=names, deltas=deltas @ turn.T)
    found["kept"] = all(after["keys"][name] == before["keys"][name] for name in before["keys"]) and all(
        after[name] == before[name] for name in ("vertices", "faces", "uv", "modifiers", "materials", "place")
    )
    (group,) = bpy.data.node_groups
    found["drivers"] = len(group.animation_data.drivers)
    found["images"] = len(bpy.data.images)
    key = obj.data.shape_keys.key_blocks["browInnerUp"]
    key.value = 0.5
    bpy.context.view_layer.update()
    tree = group.evaluated_get(bpy.context.evaluated_depsgraph_get())
    found["driven"] = tree.nodes["browInnerUp"].outputs[0].default_value
    key.value = 0.0
    settings = bpy.context.scene.facewrinkle
    found["age"] = told(bpy.ops.facewrinkle.add_age)
    settings.shapes = {"aus", "expressions"}
    found["expressions"] = told(bpy.ops.facewrinkle.add_shapes)
    found["keys"] = [key.name for key in obj.data.shape_keys.key_blocks]
    found["groups"] = len(bpy.data.node_groups)
    settings.shapes = {"arkit"}
    found["wrinkles again"] = told(bpy.ops.facewrinkle.add_wrinkles)
    found["groups again"] = len(bpy.data.node_groups)
    found["copy"] = told(bpy.ops.facewrinkle.fine_copy)
    settings.tears, settings.seconds = "one_tear", 2.5
    found["tears"] = told(bpy.ops.facewrinkle.add_tears)
    assert not found["tears"], found["tears"]
    (tears,) = [each for each in obj.children if each.type == "MESH"]
    found["off the skin"] = off_the_skin(obj, tears)
    (root,) = [each for each in obj.children if each.type == "EMPTY" and each.children]
    (skin,) = [each for each in root.children if each.name.startswith(f"{root.name} face")]
    obj.data.shape_keys.key_blocks["mouthSmileLeft"].value = 0.5
    bpy.context.view_layer.update()
    mixed = skin.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.shape_keys.key_blocks
    found["followed"] = mixed["mouthSmileLeft"].value
    obj.data.shape_keys.key_blocks["mouthSmileLeft"].value = 0.0
    rest = places(obj.data.vertices)
    tree = BVHTree.FromPolygons(places(skin.data.vertices).tolist(), [[*f.vertices] for f in skin.data.polygons])
    found["copy lies off"] = float(np.median([tree.find_nearest(place)[3] for place in rest])) / np.ptp(rest)
    found["changed beside"] = changed(apart, state(other) | {"counts": apart["counts"]})
    found["left open"] = stray() == open_before
    after = state(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "ä b.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "ä b.blend"))
    obj = bpy.context.object
    found["changed by opening"] = changed(after, state(obj))
    found["packed"] = all(each.packed_file and each.size[0] in (256, 1024) for each in bpy.data.images)
    found["clear"] = told(bpy.ops.facewrinkle.clear)
    found["left"] = changed(before, state(obj))
    return found


def own_keys(path):
    """A head with keys of its own for all shapes: its keys drive the wrinkle maps, and are there after Clear."""
    obj, found = head(path), {}
    for number, name in enumerate(json.loads((folder / "names.json").read_text())):
        key = obj.shape_key_add(name=name)
        key.points[number].co.x += 1.0
        key.value = 0.0
    bpy.context.scene.facewrinkle.size = "256"
    before = state(obj)
    obj.data.uv_layers.active.data[0].uv.x += 2.0
    found["tiles"] = told(bpy.ops.facewrinkle.add_wrinkles)
    obj.data.uv_layers.active.data[0].uv.x -= 2.0
    found["add"] = told(bpy.ops.facewrinkle.add_wrinkles)
    after = state(obj)
    found["keys"], found["changed"] = len(before["keys"]), changed(after["keys"], before["keys"])
    (group,) = bpy.data.node_groups
    found["drivers"] = len(group.animation_data.drivers)
    obj.data.shape_keys.key_blocks["browInnerUp"].value = 0.5
    bpy.context.view_layer.update()
    tree = group.evaluated_get(bpy.context.evaluated_depsgraph_get())
    found["driven"] = tree.nodes["browInnerUp"].outputs[0].default_value
    obj.data.shape_keys.key_blocks["browInnerUp"].value = 0.0
    found["clear"] = told(bpy.ops.facewrinkle.clear)
    found["lost"] = changed(before, state(obj))
    return found


def prepared(path):
    """Keys that are ready: undo, foreign keys, a take; and all that is refused."""
    obj, found = head(path), {}
    before = state(obj)
    bpy.ops.ed.undo_push(message="before")
    found["add"] = told(bpy.ops.facewrinkle.add_shapes)
    found["count"] = len(obj.data.shape_keys.key_blocks)
    bpy.ops.ed.undo_push(message="keys")
    bpy.ops.ed.undo()
    obj = bpy.context.object
    found["after undo"] = changed(before, state(obj))
    foreign = obj.shape_key_add(name="jawOpen")
    foreign.value = 0.5
    hers = places(foreign.points)
    found["foreign"] = told(bpy.ops.facewrinkle.add_shapes)
    found["untouched"] = foreign.value == 0.5 and len(obj.data.shape_keys.key_blocks) == 4
    found["places"] = bool((places(obj.data.shape_keys.key_blocks["jawOpen"].points) == hers).all())
    bpy.context.scene.frame_end = 2
    found["again"] = told(bpy.ops.facewrinkle.add_shapes)
    action = bpy.data.actions.new("hers")
    obj.data.shape_keys.animation_data_create().action = action
    values = []
    for name in ("take.csv", "take.json"):
        found[name] = told(bpy.ops.facewrinkle.load_take, filepath=str(folder / name))
        for frame in (1, 2):
            bpy.context.scene.frame_set(frame)
            values.append(obj.data.shape_keys.key_blocks["jawOpen"].value)
    found["values"], found["hers"] = values, action.use_fake_user
    found["end"] = bpy.context.scene.frame_end
    found["cleared"] = told(bpy.ops.facewrinkle.clear)
    found["left"] = [key.name for key in obj.data.shape_keys.key_blocks]
    found["no take"] = told(bpy.ops.facewrinkle.load_take, filepath=str(folder / "python"))
    (folder / "keys.npz").rename(folder / "other.npz")
    found["no result"] = told(bpy.ops.facewrinkle.add_shapes)
    found["killed"] = told(bpy.ops.facewrinkle.find_face)
    found["old"] = told(bpy.ops.facewrinkle.add_tears)
    bpy.context.scene.facewrinkle.shapes = set()
    found["none chosen"] = told(bpy.ops.facewrinkle.add_shapes)
    bpy.context.scene.facewrinkle.shapes = {"arkit"}
    bpy.context.preferences.addons["blender"].preferences.python = str(folder / "nobody")
    found["missing"] = told(bpy.ops.facewrinkle.add_shapes)
    bpy.context.preferences.addons["blender"].preferences.python = sys.executable
    found["without"] = told(bpy.ops.facewrinkle.add_shapes)
    obj.modifiers.new("Mirror", "MIRROR")
    found["mirror"] = told(bpy.ops.facewrinkle.add_shapes)
    obj.data.clear_geometry()
    found["empty"] = told(bpy.ops.facewrinkle.add_shapes)
    return found


def cancelled(path):
    """A run that is cancelled: its process ends, and its folder goes."""
    from blender import process

    run = process.Run(str(folder / "python"))
    run.start("wait")
    while run.share == 0.0:
        pass
    seen = run.step, run.share, run.running
    run.close()
    return {"seen": seen, "running": run.running, "folder": run.folder.exists()}


def no_face(path):
    bpy.ops.mesh.primitive_monkey_add()
    before = state(bpy.context.object)
    found = {"suzanne": told(bpy.ops.facewrinkle.add_shapes)}
    return found | {"as before": state(bpy.context.object) == before}


def placed(path):
    """Landmarks on a head as it is imported, with Y up turned to Z up."""
    from blender import landmarks

    bpy.ops.wm.obj_import(filepath=str(path))
    obj = bpy.context.view_layer.objects.active = bpy.context.selected_objects[0]
    before, found = state(obj), {"placed": told(bpy.ops.facewrinkle.place_landmarks)}
    found["marks"] = {name: list(obj.matrix_world @ each.location) for name, each in landmarks.empties(obj).items()}
    found["found"] = told(bpy.ops.facewrinkle.find_face)
    found["all"] = len(landmarks.empties(obj))
    found["cleared"] = told(bpy.ops.facewrinkle.clear)
    return found | {"as before": state(obj) == before}


begin()
print("found " + json.dumps(globals()[sys.argv[1]](*sys.argv[3:4] or [None])))
