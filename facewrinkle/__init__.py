"""Wrinkles that muscles fold into faces, on PyVista meshes.

Names are loaded when they are first used, so that importing the package costs nothing beyond PyVista.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "Compression": "layers.patterns_on_skin.strength",
    "Crease": "anatomy.muscles",
    "DrippingTear": "tears.drop",
    "Face": "anatomy.face",
    "FaceWrinkleError": "errors",
    "FaceWrinkleWarning": "errors",
    "Found": "anatomy.finding",
    "Identity": "anatomy.identity",
    "LinearMuscle": "anatomy.muscles",
    "Motion": "motion.base",
    "MuscleWrinkles": "layers.muscle_wrinkles",
    "PatternLayer": "layers.patterns_on_skin.layer",
    "Performer": "rigging",
    "Recorded": "motion.recorded",
    "Refinement": "simulation",
    "Region": "layers.patterns_on_skin.region",
    "Rig": "rigging",
    "SheddingTear": "tears.stream",
    "SheetMuscle": "anatomy.muscles",
    "Simulation": "simulation",
    "Skin": "motion.skin",
    "SkinMaterial": "motion.skin",
    "SphincterMuscle": "anatomy.muscles",
    "Still": "motion.base",
    "Take": "rigging",
    "TriangularMuscle": "anatomy.muscles",
    "WaveFolds": "layers.wave_folds",
    "Wrinkles": "anatomy.muscles",
    "bake_layers": "rigging",
    "bake_maps": "rigging",
    "compile_ahead": "commands.compile",
    "default_face": "anatomy.fitting",
    "find_landmarks": "anatomy.finding",
    "fit_face": "anatomy.fitting",
    "read_animation": "motion.animation",
    "read_atlas": "anatomy.atlas",
    "read_face": "anatomy.face_file",
    "read_surface": "mesh",
    "read_take": "rigging",
    "read_texture": "mesh",
    "refine": "mesh",
    "rig": "rigging",
    "studio": "live",
    "surface": "anatomy.fitting",
    "write_atlas": "anatomy.atlas_file",
    "write_face": "anatomy.face_file",
    "write_layers": "rigging",
    "write_maps": "rigging",
    "write_mesh": "export",
    "write_rig": "rigging",
}
_TABLES = {"MUSCLES": "muscles", "ACTION_UNITS": "action_units", "EXPRESSIONS": "expressions"}
_SUBPACKAGES = (
    "anatomy",
    "appearance",
    "dataset",
    "errors",
    "export",
    "geometry",
    "layers",
    "live",
    "mesh",
    "motion",
    "plotting",
    "rigging",
    "simulation",
    "tears",
)

__all__ = sorted([*_HOME, *_TABLES])


def __getattr__(name: str) -> Any:
    if name in _HOME:
        home = import_module(f".{_HOME[name]}", __name__)
        value = getattr(home, name)
    elif name in _TABLES:
        value = getattr(import_module(".anatomy.atlas", __name__).load_atlas(), _TABLES[name])
    elif name in _SUBPACKAGES:
        value = import_module(f".{name}", __name__)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__, *_SUBPACKAGES])
