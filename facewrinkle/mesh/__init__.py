"""Meshes that users bring become plain arrays here, and plain arrays become PolyData again.

`read_surface` opens files and meshes of other libraries, `prepare` checks and repairs a surface until the algorithms
can rely on it, and `to_polydata` turns results into PolyData. Nothing else in the package converts meshes. The names
of the arrays of a frame are here, too.
"""

from .arrays import (
    ARRAYS,
    MUSCLES,
    POSE,
    UNIT,
    add_seams,
    closest_places,
    corner_texture,
    interpolated_point_data,
    joined,
    refilled,
    to_polydata,
    values_at,
    with_data,
    with_normals,
)
from .clean_surface import CleanSurface, prepare
from .formats.reading import MeshLike, read_surface, triangle_mesh
from .formats.textures import as_texture, merged_texture, outside_images, read_texture
from .seams import refine, refine_seams, split_at_seams

__all__ = [
    "ARRAYS",
    "MUSCLES",
    "POSE",
    "UNIT",
    "CleanSurface",
    "MeshLike",
    "add_seams",
    "as_texture",
    "closest_places",
    "corner_texture",
    "interpolated_point_data",
    "joined",
    "merged_texture",
    "outside_images",
    "prepare",
    "read_surface",
    "read_texture",
    "refilled",
    "refine",
    "refine_seams",
    "split_at_seams",
    "to_polydata",
    "triangle_mesh",
    "values_at",
    "with_data",
    "with_normals",
]
