"""Wrinkles that muscles fold into faces, on PyVista meshes.

Names are loaded when first used, so that importing the package costs nothing beyond PyVista.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "Face": "anatomy.face",
    "default_face": "anatomy.fitting",
    "fit_face": "anatomy.fitting",
    "find_landmarks": "anatomy.finding",
    "Found": "anatomy.finding",
    "read_face": "anatomy.face_file",
    "write_face": "anatomy.face_file",
    "Identity": "anatomy.identity",
    "surface": "anatomy.fitting",
    "LinearMuscle": "anatomy.muscles",
    "SheetMuscle": "anatomy.muscles",
    "SphincterMuscle": "anatomy.muscles",
    "Wrinkles": "anatomy.muscles",
    "read_atlas": "anatomy.atlas",
    "Motion": "motion.base",
    "Still": "motion.base",
    "Recorded": "motion.recorded",
    "read_animation": "animation",
    "Skin": "motion.skin",
    "SkinMaterial": "motion.skin",
    "MuscleWrinkles": "layers.muscle_wrinkles",
    "DrippingTear": "tears.drop",
    "SheddingTear": "tears.stream",
    "PatternLayer": "layers.pattern_layer",
    "Region": "layers.region",
    "Compression": "layers.pattern_layer",
    "Simulation": "simulation",
    "Refinement": "simulation",
    "refine": "mesh",
    "read_surface": "mesh",
    "FaceWrinkleError": "errors",
    "FaceWrinkleWarning": "errors",
}
_TABLES = {"MUSCLES": "muscles", "ACTION_UNITS": "action_units", "EXPRESSIONS": "expressions"}
_ROOMS = (
    "anatomy",
    "geometry",
    "layers",
    "motion",
    "tears",
    "errors",
    "mesh",
    "simulation",
    "plotting",
    "wet",
    "export",
)

__all__ = sorted([*_HOME, *_TABLES])


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    elif name in _TABLES:
        value = getattr(import_module(".anatomy.atlas", __name__).load_atlas(), _TABLES[name])
    elif name in _ROOMS:
        value = import_module(f".{name}", __name__)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__, *_ROOMS])
