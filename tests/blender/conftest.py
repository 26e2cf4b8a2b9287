"""The scenarios run in Blender, whose modules are nowhere else."""

collect_ignore = ["scene.py"]
