"""Meshes beside the artist's own: a fine copy that her keys drive, and tears that run down her skin."""

import math

import bpy
import numpy as np
from mathutils import Matrix

from .exchange import Refusal, rest, turn
from .keys import curves, followed
from .material import Nodes, groups, unwire

KIND = "facewrinkle kind"
"""Custom property of an object that was made here: COPY or TEAR."""

COPY, TEAR = "copy", "tear"


def add_copy(obj, path):
    """Bring in a rig as glTF, with keys that follow those of a mesh of the same name; return how many do."""
    remove(obj, COPY)
    known, keys = set(bpy.data.objects), obj.data.shape_keys
    bpy.ops.import_scene.gltf(filepath=str(path))
    parts = [each for each in bpy.data.objects if each not in known]
    root = bpy.data.objects.new(f"{obj.name} fine", None)
    root.parent, root[KIND] = obj, COPY
    root.location.x = 1.1 * np.ptp(rest(obj)[:, 0])
    obj.users_collection[0].objects.link(root)
    upright = Matrix.Rotation(-0.5 * math.pi, 4, "X")  # the importer has turned y up to z up
    following = set()
    for part in parts:
        part.data.transform(Matrix(np.linalg.inv(turn(obj))).to_4x4() @ upright, shape_keys=True)
        part.parent, part.matrix_basis = root, Matrix()
        part.matrix_parent_inverse = Matrix()
        blocks = part.data.shape_keys.key_blocks if part.data.shape_keys else ()
        for block in [block for block in blocks if block.name in followed(obj)]:
            driver = block.driver_add("value").driver
            driver.type, variable = "SUM", driver.variables.new()
            target = variable.targets[0]
            target.id_type, target.id, target.data_path = "KEY", keys, f'key_blocks["{block.name}"].value'
            following.add(block.name)
    _dress(obj, next(part for part in parts if part.name.startswith("face")))
    for part in parts:
        part.name = f"{root.name} {part.name}"
        part.select_set(False)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    return len(following)


def _dress(obj, skin):
    """Give the skin of a copy the material of most of the mesh, without wrinkles in maps, if they share UVs."""
    layer, numbers = obj.data.uv_layers.active, [polygon.material_index for polygon in obj.data.polygons]
    slots = obj.material_slots
    own = slots[np.bincount(numbers).argmax()].material if slots else None
    if layer is None or own is None or not skin.data.uv_layers:
        return
    skin.data.uv_layers[0].name = layer.name
    worn = own.copy()
    for group in groups(obj):
        unwire(worn, group)
    came = list(skin.data.materials)
    skin.data.materials.clear()
    skin.data.materials.append(worn)
    _discard(*came)


def add_tears(obj, folder):
    """Make one mesh of the point caches of tears, which run from the start of the scene; return their number."""
    remove(obj, TEAR)
    clouds, faces, count = [], [], 0
    for cache in sorted(folder.glob("*_tears_*.pc2")):
        size, frames = np.fromfile(cache, np.int32, 8)[[4, 7]]
        clouds.append(np.fromfile(cache, np.float32, offset=32).reshape(frames, size, 3))
        lines = cache.with_suffix(".obj").read_text(encoding="utf-8").splitlines()
        corners = [line.split()[1:] for line in lines if line.startswith("f ")]
        faces += [[count + int(corner.split("/")[0]) - 1 for corner in face] for face in corners]
        count += size
    if not clouds:
        raise Refusal(f"No tear leaves the eyes of {obj.name} in this time: give it more seconds.")
    points = np.concatenate(clouds, axis=1) @ np.linalg.inv(turn(obj)).T
    mesh = bpy.data.meshes.new(f"{obj.name} tears")
    mesh.from_pydata(points[0], [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    mesh.materials.append(_water(mesh.name))
    tears = bpy.data.objects.new(mesh.name, mesh)
    tears.parent, tears[KIND] = obj, TEAR
    obj.users_collection[0].objects.link(tears)
    for frame in points:
        key = tears.shape_key_add(name="frame", from_mix=False)
        key.points.foreach_set("co", frame.astype(np.float32).ravel())
        key.interpolation = "KEY_LINEAR"
    keys = mesh.shape_keys
    keys.use_relative = False  # one key after the other, as time passes
    for number in (0, len(points) - 1):
        keys.eval_time = keys.key_blocks[number].frame
        keys.keyframe_insert("eval_time", frame=bpy.context.scene.frame_start + number)
    for point in curves(keys.animation_data)[0].keyframe_points:
        point.interpolation = "LINEAR"
    obj.add_rest_position_attribute = True
    tears.modifiers.new("Follow the skin", "NODES").node_group = _following(obj, mesh.name)
    return len(clouds)


def _water(name):
    """Return a material that mirrors as water does; a film so thin refracts nothing, and glass would shade the skin."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.node_tree.nodes.clear()
    make = Nodes(material.node_tree)
    mirror = make.node("ShaderNodeBsdfAnisotropic")
    make.fill(mirror, Roughness=0.02)
    outside = make.math("SUBTRACT", 1.0, make.node("ShaderNodeNewGeometry").outputs["Backfacing"])
    share = make.math("MULTIPLY", make.node("ShaderNodeFresnel", 1.33).outputs[0], outside)
    clear = make.node("ShaderNodeBsdfTransparent").outputs[0]
    surface = make.node("ShaderNodeMixShader", share, clear, mirror.outputs[0]).outputs[0]
    make.node("ShaderNodeOutputMaterial", surface)
    return material


def _following(obj, name):
    """Return nodes that move a mesh as the nearest skin moves by keys and modifiers."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    make = Nodes(group)

    def attribute(name):
        return make.node("GeometryNodeInputNamedAttribute", name, data_type="FLOAT_VECTOR").outputs["Attribute"]

    skin = make.node("GeometryNodeObjectInfo", obj, transform_space="RELATIVE").outputs["Geometry"]
    here, still = make.node("GeometryNodeInputPosition").outputs[0], attribute("rest_position")
    kept = make.node("GeometryNodeStoreNamedAttribute", data_type="FLOAT_VECTOR")
    make.fill(kept, Geometry=skin, Name=name, Value=make.vector("SUBTRACT", here, still))
    at_rest = make.node("GeometryNodeSetPosition")
    make.fill(at_rest, Geometry=kept.outputs[0], Position=still)
    moved = make.node("GeometryNodeSampleNearestSurface", data_type="FLOAT_VECTOR")
    make.fill(moved, Mesh=at_rest.outputs[0], Value=attribute(name))
    placed = make.node("GeometryNodeSetPosition")
    make.fill(placed, Geometry=make.node("NodeGroupInput").outputs[0], Offset=moved.outputs[0])
    make.node("NodeGroupOutput", placed.outputs[0])
    return group


def remove(obj, kind=None):
    """Remove what was made beside a mesh, or what is of a kind, with all that nothing else uses."""
    for root in [each for each in obj.children if each.get(KIND) in ((kind,) if kind else (COPY, TEAR))]:
        if root[KIND] == TEAR:
            obj.add_rest_position_attribute = False
        for each in [*root.children, root]:
            mesh, trees = each.data, [modifier.node_group for modifier in each.modifiers]
            materials = [slot.material for slot in each.material_slots]
            motion = mesh.shape_keys.animation_data if mesh is not None and mesh.shape_keys else None
            action = None if motion is None else motion.action
            bpy.data.objects.remove(each)
            _discard(mesh, action, *trees, *materials)


def _discard(*blocks):
    """Remove what nothing uses, and then the pictures of materials."""
    for block in dict.fromkeys(blocks):
        if block is not None and not block.users:
            nodes = block.node_tree.nodes if isinstance(block, bpy.types.Material) and block.node_tree else ()
            images = [node.image for node in nodes if node.type == "TEX_IMAGE"]
            bpy.data.batch_remove([block])
            _discard(*images)
