"""The edge: what users bring becomes plain arrays here, and plain arrays become PolyData again.

`read_surface` opens files and foreign objects, `prepare` checks and mends a surface until the algorithms can rely on
it, and `to_polydata` turns results into PolyData. No other room converts; this one also names the arrays of a frame.
"""

from .arrays import (
    ARRAYS,
    MUSCLES,
    POSE,
    UNIT,
    array_of,
    carried_point_data,
    of_own_arrays,
    points_and_triangles,
    refilled,
    to_polydata,
    with_data,
    with_normals,
)
from .checks import Surface, prepare
from .collage import laid_image
from .reading import read_surface
from .refining import refine
from .seams import add_seams, corner_texture, refine_seams, split_at_seams
from .texture import as_texture, read_texture

__all__ = [
    "ARRAYS",
    "MUSCLES",
    "POSE",
    "UNIT",
    "Surface",
    "add_seams",
    "array_of",
    "as_texture",
    "carried_point_data",
    "corner_texture",
    "laid_image",
    "of_own_arrays",
    "points_and_triangles",
    "prepare",
    "read_surface",
    "read_texture",
    "refilled",
    "refine",
    "refine_seams",
    "split_at_seams",
    "to_polydata",
    "with_data",
    "with_normals",
]
