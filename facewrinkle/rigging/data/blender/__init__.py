"""facewrinkle in Blender: ARKit shape keys and wrinkle maps on the selected mesh, in place.

The work is done by the package, in a Python of its own; each call is a process with files in a temporary folder.
"""

import bpy

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.facewrinkle = bpy.props.PointerProperty(type=operators.Settings)


def unregister():
    del bpy.types.Scene.facewrinkle
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
