# Written by tools/write_stub.py.

from typing import Any

from . import anatomy as anatomy
from . import appearance as appearance
from . import dataset as dataset
from . import errors as errors
from . import export as export
from . import geometry as geometry
from . import layers as layers
from . import live as live
from . import mesh as mesh
from . import motion as motion
from . import plotting as plotting
from . import rigging as rigging
from . import simulation as simulation
from . import tears as tears
from .anatomy.atlas import read_atlas as read_atlas
from .anatomy.atlas_file import write_atlas as write_atlas
from .anatomy.face import Face as Face
from .anatomy.face_file import read_face as read_face
from .anatomy.face_file import write_face as write_face
from .anatomy.finding import Found as Found
from .anatomy.finding import find_landmarks as find_landmarks
from .anatomy.fitting import default_face as default_face
from .anatomy.fitting import fit_face as fit_face
from .anatomy.fitting import surface as surface
from .anatomy.identity import Identity as Identity
from .anatomy.muscles import Crease as Crease
from .anatomy.muscles import LinearMuscle as LinearMuscle
from .anatomy.muscles import SheetMuscle as SheetMuscle
from .anatomy.muscles import SphincterMuscle as SphincterMuscle
from .anatomy.muscles import TriangularMuscle as TriangularMuscle
from .anatomy.muscles import Wrinkles as Wrinkles
from .commands.compile import compile_ahead as compile_ahead
from .errors import FaceWrinkleError as FaceWrinkleError
from .errors import FaceWrinkleWarning as FaceWrinkleWarning
from .export import write_mesh as write_mesh
from .layers.muscle_wrinkles import MuscleWrinkles as MuscleWrinkles
from .layers.patterns_on_skin.layer import PatternLayer as PatternLayer
from .layers.patterns_on_skin.region import Region as Region
from .layers.patterns_on_skin.strength import Compression as Compression
from .layers.wave_folds import WaveFolds as WaveFolds
from .live import studio as studio
from .mesh import read_surface as read_surface
from .mesh import read_texture as read_texture
from .mesh import refine as refine
from .motion.animation import read_animation as read_animation
from .motion.base import Motion as Motion
from .motion.base import Still as Still
from .motion.recorded import Recorded as Recorded
from .motion.skin import Skin as Skin
from .motion.skin import SkinMaterial as SkinMaterial
from .rigging import Performer as Performer
from .rigging import Rig as Rig
from .rigging import Take as Take
from .rigging import bake_layers as bake_layers
from .rigging import bake_maps as bake_maps
from .rigging import read_take as read_take
from .rigging import rig as rig
from .rigging import write_layers as write_layers
from .rigging import write_maps as write_maps
from .rigging import write_rig as write_rig
from .simulation import Refinement as Refinement
from .simulation import Simulation as Simulation
from .tears.drop import DrippingTear as DrippingTear
from .tears.stream import SheddingTear as SheddingTear

__version__: str
__all__: list[str]

MUSCLES: dict[str, dict[str, Any]]
ACTION_UNITS: dict[str, dict[str, float]]
EXPRESSIONS: dict[str, dict[str, float]]
