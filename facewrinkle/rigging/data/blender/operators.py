"""What an artist can do: each operator runs a command of the package and brings its result into the scene."""

import json
from contextlib import closing

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, StringProperty

from . import beside, exchange, keys, landmarks, material
from .exchange import Refusal
from .process import Run


class Settings(bpy.types.PropertyGroup):
    shapes: EnumProperty(
        name="Shapes",
        description="Shape keys to add; Shift chooses several sets",
        options={"ENUM_FLAG"},
        items=[
            ("arkit", "ARKit", "The 52 shapes that phones and trackers drive", 1),
            ("visemes", "Visemes", "The 15 shapes of lip sync", 2),
            ("aus", "FACS", "The action units of the Facial Action Coding System", 4),
            ("expressions", "Emotions", "Happiness, anger, doubt and other expressions", 8),
        ],
        default={"arkit"},
    )
    size: EnumProperty(
        name="Maps",
        description="Width of the wrinkle maps in pixels",
        items=[(str(n), f"{n} px", "") for n in (256, 512, 1024, 2048)],
        default="1024",
    )
    tears: EnumProperty(
        name="Tears",
        items=[
            ("one_tear", "One Tear", "One that runs down"),
            ("weeping", "Weeping", "Several that run down and drip"),
            ("dripping", "Dripping", "Drops that fall"),
            ("shedding", "Flowing", "Streams that run down"),
            ("joy", "Joy", "Tears of joy"),
        ],
    )
    seconds: FloatProperty(name="Seconds", description="For which tears run", default=4.0, min=0.5, max=60.0)


def python():
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences.python if addon is not None else ""


class OnMesh:
    """What can be done where a mesh is selected, and not being edited."""

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH" and context.mode == "OBJECT"


class Command(OnMesh):
    """A command of the package on the selected mesh: it blocks where a script calls it, and else runs beside."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - as Blender wants it

    def begin(self, context):
        obj, self.run, self.timer = context.object, None, None
        self.mesh = obj.name  # the object itself may be another after an undo
        exchange.check(obj)
        self.run = Run(python())
        self.head = self.run.folder / "head.obj"
        exchange.send(obj, self.head)
        marks = self.run.folder / "marks.json"
        given = ["--landmarks", marks] if landmarks.write(obj, marks) else []
        self.run.start(*self.arguments(context), *given, "--out", self.run.folder)

    def end(self, context):
        self.run.result()
        said = self.finish(context)
        for note in self.run.notes[:3]:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, said)

    @property
    def obj(self):
        found = bpy.data.objects.get(self.mesh)
        if found is None:
            raise Refusal(f"{self.mesh} was deleted or renamed while its face was at work: run it again.")
        return found

    def guarded(self, step, context):
        """Run a step; return False after what went wrong was told."""
        try:
            step(context)
        except Refusal as problem:
            self.report({"ERROR"}, str(problem))
            return False
        return True

    def close(self, context):
        if self.timer is not None:
            context.window_manager.event_timer_remove(self.timer)
            context.window_manager.progress_end()
            context.workspace.status_text_set(None)
        if self.run is not None:
            self.run.close()

    def execute(self, context):
        try:
            done = self.guarded(self.begin, context) and self.guarded(self.end, context)
            return {"FINISHED" if done else "CANCELLED"}
        finally:
            self.close(context)

    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        if not self.guarded(self.begin, context):
            self.close(context)
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0.0, 1.0)
        self.timer = manager.event_timer_add(0.2, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.close(context)
            self.report({"INFO"}, "Cancelled: nothing was changed.")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self.run.running:
            context.window_manager.progress_update(self.run.share)
            said = f"facewrinkle: {self.run.step} {100 * self.run.share:.0f} %   (Esc: cancel)"
            context.workspace.status_text_set(said)
            return {"PASS_THROUGH"}
        try:
            done = self.guarded(self.end, context)
        finally:
            self.close(context)
        return {"FINISHED" if done else "CANCELLED"}

    def cancel(self, context):
        """Called by Blender when it closes the window or the file."""
        self.close(context)


class FindFace(Command, bpy.types.Operator):
    """Find the face of the selected mesh; drag what is wrong, and the other commands go by it"""

    bl_idname, bl_label = "facewrinkle.find_face", "Find Face"

    def arguments(self, context):
        return ["fit", self.head]

    def finish(self, context):
        file = self.run.folder / "head.landmarks.json"
        estimated = landmarks.show(self.obj, json.loads(file.read_text(encoding="utf-8"))["landmarks"])
        return f"Landmarks found; {estimated} are estimated (crosses)."


class PlaceLandmarks(OnMesh, bpy.types.Operator):
    """Where no face is found: put landmarks on a head that looks along -Y, and drag each to its place"""

    bl_idname, bl_label, bl_options = "facewrinkle.place_landmarks", "Place Landmarks", {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            exchange.check(context.object)
        except Refusal as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        landmarks.show(context.object, landmarks.guessed(context.object))
        self.report({"INFO"}, "Drag each landmark to its place; Find Face then estimates the others.")
        return {"FINISHED"}


class Shapes(Command):
    """What adding shapes has in common; Blender loses classes of operators that others are made of."""

    def arguments(self, context):
        return ["rig", self.head, "--same-mesh", "--wrinkles", self.wrinkles, "--shapes", self.shapes(context)]

    def shapes(self, context):
        chosen = context.scene.facewrinkle.shapes
        if not chosen:
            raise Refusal("Choose which shapes to add: ARKit's, say.")
        return "+".join(sorted(chosen))

    def finish(self, context):
        with np.load(self.run.folder / "head.npz") as stored:
            return self.take(context, dict(stored))

    def take(self, context, stored):
        (count, hers), far = keys.add(self.obj, stored), int((~stored["reached"]).sum())
        kept = f" {hers} of your own with these names stay, and drive wrinkles." if hers else ""
        return f"{count} shape keys.{kept}" + (f" {far} vertices lie far from the face." if far else "")


class AddShapes(Shapes, bpy.types.Operator):
    """Add shape keys to the selected mesh; its vertices, other keys and modifiers stay"""

    bl_idname, bl_label, wrinkles = "facewrinkle.add_shapes", "Add Shapes", "none"


class Wrinkles(Shapes):
    """What adding wrinkle maps has in common."""

    wrinkles = "maps"

    def arguments(self, context):
        return [*super().arguments(context), "--map-size", context.scene.facewrinkle.size]

    def take(self, context, stored):
        said = super().take(context, stored)
        count = material.add(self.obj, self.run.folder, "head", stored)
        return f"{said} Wrinkles in {count} material{'' if count == 1 else 's'}."


class AddWrinkles(Wrinkles, bpy.types.Operator):
    """Add shape keys, and wrinkle maps to the material that they drive"""

    bl_idname, bl_label = "facewrinkle.add_wrinkles", "Add Shapes with Wrinkles"


class AddAge(Wrinkles, bpy.types.Operator):
    """Add a key for the lines that old skin has at rest, and maps of these to the material that it drives"""

    bl_idname, bl_label = "facewrinkle.add_age", "Age"

    def shapes(self, context):
        return "age"

    def take(self, context, stored):
        said = super().take(context, stored)
        if "age" in keys.ours(self.obj):
            self.obj.data.shape_keys.key_blocks["age"].value = 1.0
        return said


class FineCopy(Command, bpy.types.Operator):
    """Make a fine copy with wrinkles in its mesh beside the selected one, whose keys it follows"""

    bl_idname, bl_label = "facewrinkle.fine_copy", "Fine Copy"

    def arguments(self, context):
        names = keys.followed(context.object)
        if not names:
            raise Refusal(f"{context.object.name} has no keys for a copy to follow: add shapes first.")
        return ["rig", self.head, "--shapes", "+".join(names)]

    def finish(self, context):
        return f"A fine copy follows {beside.add_copy(self.obj, self.run.folder / 'head.glb')} shape keys."


class AddTears(Command, bpy.types.Operator):
    """Add tears as a mesh with an animation; they follow the skin as it moves"""

    bl_idname, bl_label = "facewrinkle.add_tears", "Add Tears"

    def arguments(self, context):
        chosen, render = context.scene.facewrinkle, context.scene.render
        timing = ["--seconds", chosen.seconds, "--fps", render.fps / render.fps_base]
        files = ["--no-movie", "--size", 64, "--save-animation", self.run.folder / "cry.pc2"]
        return ["tear", chosen.tears, "--face", self.head, "--intensity", 0, *timing, *files]

    def finish(self, context):
        return f"Tears run from the start of the scene: {beside.add_tears(self.obj, self.run.folder)}."


class LoadTake(OnMesh, bpy.types.Operator):
    """Load a take of Live Link Face, MediaPipe or another tracker as keyframes of the shape keys"""

    bl_idname, bl_label, bl_options = "facewrinkle.load_take", "Load Performance", {"REGISTER", "UNDO"}
    filepath: StringProperty(subtype="FILE_PATH")
    filter_glob: StringProperty(default="*.csv;*.json;*.tsv;*.txt", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.object.data.shape_keys is not None

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        try:
            with closing(Run(python())) as run:
                table, path = run.folder / "take.csv", bpy.path.abspath(self.filepath)
                run.start("take", path, "--out", table)
                run.result()
                count, last = keys.perform(context.object, table, bpy.path.display_name_from_filepath(path))
        except Refusal as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{count} shape keys move until frame {last}.")
        return {"FINISHED"}


class Clear(OnMesh, bpy.types.Operator):
    """Remove the shape keys, wrinkles, tears, copy and landmarks that were added here"""

    bl_idname, bl_label, bl_options = "facewrinkle.clear", "Clear", {"REGISTER", "UNDO"}

    def execute(self, context):
        for each in (beside, material, keys, landmarks):
            each.remove(context.object)
        return {"FINISHED"}


class Test(bpy.types.Operator):
    """Start this Python and see if it has facewrinkle"""

    bl_idname, bl_label = "facewrinkle.test", "Test"

    def execute(self, context):
        try:
            with closing(Run(python())) as run:
                run.start("rig", "--help")
                run.result()
            self.report({"INFO"}, "facewrinkle is there.")
        except Refusal as problem:
            self.report({"ERROR"}, str(problem))
        return {"FINISHED"}


CLASSES = (
    Settings, FindFace, PlaceLandmarks, AddShapes, AddWrinkles, AddAge, FineCopy, AddTears, LoadTake, Clear, Test,
)  # fmt: skip
