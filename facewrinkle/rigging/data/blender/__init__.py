"""facewrinkle in Blender: ARKit shape keys and wrinkle maps on the selected mesh, in place.

The work is done by the package, in a Python of its own; each call is a process with files in a temporary folder.
"""

import bpy

from . import landmarks, operators


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    python: bpy.props.StringProperty(
        name="Python",
        description="The Python that has facewrinkle; empty: the facewrinkle that the system finds",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        self.layout.prop(self, "python")
        self.layout.operator(operators.Test.bl_idname)


class FacePanel(bpy.types.Panel):
    bl_idname, bl_label = "VIEW3D_PT_facewrinkle", "facewrinkle"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Face"

    def draw(self, context):
        layout, obj, settings = self.layout, context.object, context.scene.facewrinkle
        if obj is None or obj.type != "MESH":
            layout.label(text="Select the mesh of a head.")
            return
        column = layout.column(align=True)
        column.operator(operators.FindFace.bl_idname)
        column.operator(operators.PlaceLandmarks.bl_idname)
        if found := landmarks.empties(obj):
            layout.label(text=f"{len(found)} landmarks: drag what is wrong.")
        column = layout.column(align=True)
        column.row(align=True).prop(settings, "shapes")
        column.operator(operators.AddShapes.bl_idname)
        column = layout.column(align=True)
        column.prop(settings, "size")
        column.operator(operators.AddWrinkles.bl_idname)
        column.operator(operators.AddAge.bl_idname)
        layout.operator(operators.FineCopy.bl_idname)
        column = layout.column(align=True)
        column.prop(settings, "tears")
        column.prop(settings, "seconds")
        column.operator(operators.AddTears.bl_idname)
        layout.operator(operators.LoadTake.bl_idname)
        layout.operator(operators.Clear.bl_idname)


CLASSES = (*operators.CLASSES, Preferences, FacePanel)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.facewrinkle = bpy.props.PointerProperty(type=operators.Settings)


def unregister():
    del bpy.types.Scene.facewrinkle
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
