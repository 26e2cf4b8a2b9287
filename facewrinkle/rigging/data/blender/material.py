"""Wrinkle maps in the artist's materials: a group of nodes behind her own normal map, which the shape keys drive."""

import json

import bpy
import numpy as np

from .exchange import CHART, Refusal, places, rest
from .keys import followed

MESH = "facewrinkle"
"""Custom property of a group of nodes: name of the object whose keys drive it."""

SLOT = "facewrinkle made the slot"
"""Custom property of a material that is made for a mesh without any: true if its slot was made, too."""


def name_of(obj):
    """Name of what is made for a mesh."""
    return f"facewrinkle {obj.name}"


def groups(obj):
    """Groups of nodes that the keys of a mesh drive."""
    return [group for group in bpy.data.node_groups if group.get(MESH) == obj.name]


def add(obj, folder, stem, stored):
    """Wire the maps in a folder into the materials of the skin; return the number of these.

    They take the place of those that any of the same keys drive, and come on top of others.
    """
    facts = json.loads((folder / f"{stem}_wrinkles.json").read_text(encoding="utf-8"))
    remove(obj, facts["shapes"])
    layer = obj.data.uv_layers.active if "chart" not in stored else _chart(obj, stored["chart"])
    if layer is None:
        raise Refusal(f"{obj.name} has no UV map for the wrinkles: unwrap it, or remove the last one to get a chart.")
    group = _group(obj, folder, facts, layer.name)
    materials = _of_skin(obj)
    for material in materials:
        _wire(material, group)
    return len(materials)


def _chart(obj, chart):
    """Return a UV map with places by vertex."""
    layer = obj.data.uv_layers.get(CHART) or obj.data.uv_layers.new(name=CHART)
    corners = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("vertex_index", corners)
    layer.data.foreach_set("uv", chart[corners].astype(np.float32).ravel())
    return layer


def _of_skin(obj):
    """Return the materials of what the keys of the maps move, or all if that is nothing; a new one if there is none."""
    if not any(slot.material for slot in obj.material_slots):
        made, slots = bpy.data.materials.new(name_of(obj)), obj.data.materials
        made[SLOT] = not slots
        if slots:
            slots[0] = made
        else:
            slots.append(made)
    materials = [slot.material for slot in obj.material_slots]
    names = followed(obj)
    at_rest, moved = rest(obj), np.zeros(len(obj.data.vertices), bool)
    # Eyes and teeth stay.
    most = ("mouthSmileLeft", "mouthSmileRight", "browInnerUp", "noseSneerLeft", "noseSneerRight")
    for name in [name for name in most if name in names] or names:
        moved |= (places(obj.data.shape_keys.key_blocks[name].points) != at_rest).any(axis=1)
    counts = np.zeros(len(materials))
    for polygon in obj.data.polygons:
        counts[polygon.material_index] += moved[list(polygon.vertices)].any()
    used = np.flatnonzero(counts >= 0.05 * counts.sum())  # what has fewer of the moved polygons is no skin
    return list(dict.fromkeys(materials[k] for k in used if materials[k] is not None))


class Nodes:
    """Makes nodes of a tree, and links what they are given."""

    def __init__(self, tree):
        self.tree = tree

    def node(self, kind, *values, **settings):
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, value in zip(node.inputs, values):  # noqa: B905 - the first few
            self._give(socket, value)
        return node

    def fill(self, node, **values):
        """Give inputs by their names, of which nodes have some for each type of data."""
        for name, value in values.items():
            self._give(next(each for each in node.inputs if each.name == name and each.enabled), value)

    def _give(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation, *values):
        return self.node("ShaderNodeMath", *values, operation=operation).outputs[0]

    def vector(self, operation, *values):
        return self.node("ShaderNodeVectorMath", *values, operation=operation).outputs[0]

    def scaled(self, vector, factor):
        node = self.node("ShaderNodeVectorMath", vector, operation="SCALE")
        self.tree.links.new(factor, node.inputs["Scale"])
        return node.outputs[0]


def _group(obj, folder, facts, uv):
    """Return the group: masks times squares of weights, the layers' slopes by these, and the normal behind its own."""
    group = bpy.data.node_groups.new(name_of(obj), "ShaderNodeTree")
    group[MESH] = obj.name
    sockets = group.interface
    sockets.new_socket("Normal", in_out="INPUT", socket_type="NodeSocketVector").hide_value = True
    strength = sockets.new_socket("Strength", in_out="INPUT", socket_type="NodeSocketFloat")
    strength.default_value, strength.min_value, strength.max_value = 1.0, 0.0, 3.0
    sockets.new_socket("Normal", in_out="OUTPUT", socket_type="NodeSocketVector")
    make = Nodes(group)
    given, uv_map = make.node("NodeGroupInput"), make.node("ShaderNodeUVMap", uv_map=uv)

    def picture(name):
        image = bpy.data.images.load(str(folder / name))
        image.colorspace_settings.name = "Non-Color"
        image.pack()  # the folder is temporary
        return image

    channels, sums = _masks(make, picture(facts["masks"]["picture"]), uv_map.outputs[0], facts), {}
    for shape, row in facts["shapes"].items():
        share = make.math("MULTIPLY", channels[row["tile"], row["channel"]], _weight(make, obj, shape))
        k = row["layer"] - 1
        sums[k] = make.math("ADD", sums[k], share) if k in sums else share
    slope = (0.0, 0.0, 0.0)
    for k, share in sums.items():
        image = picture(facts["layers"][k]["normal"])
        normal = make.node("ShaderNodeTexImage", uv_map.outputs[0], image=image).outputs["Color"]
        own = make.vector("SUBTRACT", normal, (0.5, 0.5, 1.0))
        slope = make.vector("ADD", slope, make.scaled(own, make.math("MINIMUM", share, 1.0)))
    color = make.vector("ADD", make.scaled(slope, given.outputs["Strength"]), (0.5, 0.5, 1.0))
    folded = make.node("ShaderNodeNormalMap", uv_map=uv)
    group.links.new(color, folded.inputs["Color"])
    smooth = make.node("ShaderNodeNewGeometry").outputs["Normal"]
    # A material without a normal map gives none: that of the mesh takes its place.
    length = make.node("ShaderNodeVectorMath", given.outputs["Normal"], operation="LENGTH").outputs["Value"]
    before = make.vector("ADD", given.outputs["Normal"], make.scaled(smooth, make.math("LESS_THAN", length, 0.5)))
    turned = make.vector("ADD", before, make.vector("SUBTRACT", folded.outputs[0], smooth))
    make.node("NodeGroupOutput", make.vector("NORMALIZE", turned))
    return group


def _masks(make, image, place, facts):
    """Return the outputs with the masks in the tiles of an image, by tile, from the uppermost left, and channel.

    Cards take some 16 images in a material; this is one, however many shapes there are.
    """
    columns, rows = facts["masks"]["columns"], facts["masks"]["rows"]
    border = (0.5 * columns / image.size[0], 0.5 * rows / image.size[1], 0.0)  # beyond lies the next tile
    inside = make.vector("MAXIMUM", place, border)
    inside = make.vector("MINIMUM", inside, (1.0 - border[0], 1.0 - border[1], 0.0))
    found = {}
    for tile in sorted({row["tile"] for row in facts["shapes"].values()}):
        corner = (tile % columns, rows - 1 - tile // columns, 0.0)
        at = make.vector("DIVIDE", make.vector("ADD", inside, corner), (columns, rows, 1.0))
        apart = make.node("ShaderNodeSeparateColor", make.node("ShaderNodeTexImage", at, image=image).outputs["Color"])
        found.update({(tile, channel): apart.outputs[k] for k, channel in enumerate("rgb")})
    return found


def _weight(make, obj, shape):
    """Return the square of a key's value: skin folds with it."""
    node = make.node("ShaderNodeValue", name=shape, label=shape)
    driver = node.outputs[0].driver_add("default_value").driver
    variable = driver.variables.new()
    variable.name, target = "w", variable.targets[0]
    target.id_type, target.id, target.data_path = "KEY", obj.data.shape_keys, f'key_blocks["{shape}"].value'
    driver.expression = "w * w"
    return node.outputs[0]


def _wire(material, group):
    """Put the group before the normal of each Principled BSDF of a material, behind what is linked there."""
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    for shader in [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"]:
        normal, node = shader.inputs["Normal"], tree.nodes.new("ShaderNodeGroup")
        node.node_tree, node.location = group, (shader.location.x - 220, shader.location.y - 320)
        if normal.is_linked:
            tree.links.new(normal.links[0].from_socket, node.inputs["Normal"])
        tree.links.new(node.outputs[0], normal)


def unwire(material, group):
    """Take a group out of a material: what lies behind it is linked as before."""
    tree = material.node_tree
    for node in [each for each in tree.nodes if getattr(each, "node_tree", None) == group] if tree else ():
        before = node.inputs["Normal"].links
        for link in list(node.outputs[0].links):
            target = link.to_socket
            if before:
                tree.links.new(before[0].from_socket, target)
        tree.nodes.remove(node)


def remove(obj, names=None):
    """Take groups out of all materials: all, with the chart and a material made for them, or those of certain keys."""
    for group in groups(obj):
        if names is not None and not any(node.name in names for node in group.nodes):
            continue
        images = {node.image for node in group.nodes if node.type == "TEX_IMAGE"}
        for material in bpy.data.materials:
            unwire(material, group)
        bpy.data.node_groups.remove(group)
        for image in images:
            if image is not None and not image.users:
                bpy.data.images.remove(image)
    if names is not None:
        return
    if (chart := obj.data.uv_layers.get(CHART)) is not None:
        obj.data.uv_layers.remove(chart)
    if (own := bpy.data.materials.get(name_of(obj))) is not None:
        slots, number = obj.data.materials, obj.data.materials.find(own.name)
        if number >= 0 and own[SLOT]:
            slots.pop(index=number)
        elif number >= 0:
            slots[number] = None
        bpy.data.materials.remove(own)
