"""``mesh.facewrinkle``: patterns, tears and expressions on meshes of PyVista, as filters like PyVista's own.

PyVista finds this module through the entry point group ``pyvista.accessors`` and imports it when ``mesh.facewrinkle``
is first used; importing it by hand does the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from .anatomy import Face, Mixture, fit_face, surface
from .anatomy.attachments import combined_mesh
from .anatomy.fitting import unit_by_size
from .errors import ParameterError, check_range, check_whole, warn
from .geometry import closest_point, components
from .layers.patterns_on_skin.layer import PatternLayer
from .layers.patterns_on_skin.presets import names, table
from .layers.patterns_on_skin.region import Compression
from .mesh import PART, PARTS, add_seams, corner_texture, joined_texture, surface_in
from .motion.base import Still
from .simulation import FINEST, Refinement, Simulation
from .tears.presets import grouped
from .tears.stream import Film, Flow, Route, SheddingTear


@pv.register_dataset_accessor("facewrinkle", pv.DataObject)
class FaceWrinkleAccessor:
    """The namespace ``mesh.facewrinkle``. Each method returns a new mesh and leaves `mesh` as it is.

    Parameters
    ----------
    mesh : PolyData, or a multi-block of several

    Examples
    --------
    >>> import facewrinkle.accessor
    >>> import pyvista as pv
    >>> ball = pv.Icosphere(radius=40.0, nsub=5)
    >>> dented = ball.facewrinkle.pattern("dimple", center=(0, 0, 40), size=30.0, depth=3.0)
    >>> round(float(dented["W"].min()), 1)
    -3.0
    """

    def __init__(self, mesh: pv.DataSet | pv.MultiBlock) -> None:
        self._mesh = mesh

    def __repr__(self) -> str:
        return f"facewrinkle on a {type(self._mesh).__name__}: pattern(...), tear(...), fit(...), express(...)"

    def fit(self, landmarks: Mapping[str, npt.ArrayLike] | str | Path | None = None, **options: Any) -> Face:
        """Return the face on the mesh, with skull, eyes and muscles; see :func:`facewrinkle.fit_face`.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> head = fw.default_face()
        >>> head.mesh.facewrinkle.fit(head.landmarks)
        Face(4517 triangles, 33 landmarks, 48 muscles)
        """
        return fit_face(self._mesh, landmarks, **options)

    def express(self, what: Mixture, intensity: float = 1.0, **options: Any) -> pv.PolyData:
        """Return the face on the mesh with an expression, at rest; see :meth:`facewrinkle.Simulation.settle`.

        Parameters
        ----------
        what, intensity :
            See :meth:`facewrinkle.Simulation.express`.
        **options
            Those of :meth:`fit`. For several expressions of one mesh, fit it once.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> head = fw.default_face()
        >>> smile = head.mesh.facewrinkle.express("happiness", landmarks=head.landmarks)
        >>> bool(smile["W"].min() < -0.2)
        True
        """
        simulation = Simulation(self.fit(**options))
        simulation.express(what, intensity)
        return simulation.settle()

    def pattern(
        self,
        pattern: Any,
        center: npt.ArrayLike | None = None,
        *,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        size: float | tuple[float, float] | None = None,
        landmarks: Mapping[str, npt.ArrayLike] | str | Path | None = None,
        time: float = 0.0,
        units: str | float | None = None,
        max_level: int = 6,
        **words: Any,
    ) -> pv.PolyData:
        """Lay a pattern on the mesh.

        Parameters
        ----------
        pattern : str, Pattern, callable f(x, y, t), or sequence of these
            See :class:`facewrinkle.PatternLayer`. With `landmarks`, the name of a preset
            (:func:`facewrinkle.layers.patterns_on_skin.presets.names`), on both sides if the name has no side.
        center, up, size :
            See :class:`facewrinkle.Region`; in the coordinates and unit of the mesh. If the mesh has
            several connected parts, the pattern is laid on the one nearest to the center.
        landmarks : mapping or path, optional
            Landmarks of a face; see :func:`facewrinkle.fit_face`.
        time : float
            Seconds: the time at which patterns that tremble, or are functions of time, are evaluated.
        units : {"um", "mm", "cm", "dm", "m", "in"} or float, optional
            Unit of the mesh, or millimeters per unit. Default: by the size of the face; without landmarks by that of
            the mesh (:func:`facewrinkle.anatomy.fitting.unit_by_size`).
        max_level : int
            The most times that a triangle is split.
        **words
            Options of the layer, the pattern and the region.

        Returns
        -------
        PolyData
            The mesh with the pattern, refined where the pattern needs triangles, with the point data of the mesh,
            "Normals", "W" (mm) and the other arrays of a frame.

        Raises
        ------
        ParameterError
            If the mesh is much too coarse for the pattern with `max_level`, or the strength is set by compression.

        Warns
        -----
        FaceWrinkleWarning
            If the mesh is too coarse with `max_level`, or by its size taken to be in cm or m.
        """
        check_range("time", time, -1e9, 1e9)
        check_whole("max_level", max_level, 0, FINEST, "Each level has four times as many triangles.")
        if isinstance(words.get("strength"), Compression | str):
            raise ParameterError("nothing compresses a mesh that keeps still; give a number or a function as strength.")
        if "begin" in words:
            raise ParameterError(
                f"the time to evaluate a pattern at is `time`; leave out begin, received {words['begin']!r}."
            )
        words["begin"] = time
        if landmarks is not None:
            face = fit_face(self._mesh, landmarks, units=units)
            chosen: dict[str, Any] = {} if np.array_equal(np.asarray(up), (0.0, 1.0, 0.0)) else {"up": up}
            chosen |= {name: value for name, value in (("center", center), ("size", size)) if value is not None}
            layers = PatternLayer.presets(pattern, face, **chosen, **words)
            return _combined(patterned(face, layers, max_level), face.parts_at(face.mesh))
        if isinstance(pattern, str) and pattern in names() and pattern not in table():
            raise ParameterError(f"the preset {pattern!r} is placed by landmarks: give those of the face.")
        face, rest = _nearest_part(self._mesh, center, _units(self._mesh, units))
        layers = [PatternLayer(pattern, center, up=up, size=size, **words)]
        frame = patterned(face, layers, max_level)
        if rest is None:
            return frame
        whole = _combined(frame, {"rest": rest})
        del whole.point_data[PART], whole.field_data[PARTS]  # all of the mesh is one thing
        return whole

    def tear(
        self,
        path: npt.ArrayLike | None = None,
        *,
        start: npt.ArrayLike | None = None,
        t: float | None = None,
        units: str | float | None = None,
        **options: Any,
    ) -> pv.PolyData:
        """Return water that runs down the mesh, along a path or from a start: a closed surface of its own.

        Parameters
        ----------
        path, start :
            See :class:`facewrinkle.SheddingTear`; in the coordinates of the mesh.
        t : float, optional
            Seconds. Default: the end, when the water has run all the way.
        units : {"um", "mm", "cm", "dm", "m", "in"} or float, optional
            See :meth:`pattern`.
        **options
            Options of :class:`facewrinkle.SheddingTear` and, by their own names, of its groups, such as
            ``roughness=0.0``.

        Returns
        -------
        PolyData

        Examples
        --------
        >>> import facewrinkle.accessor
        >>> import pyvista as pv
        >>> ball = pv.Icosphere(radius=40.0, nsub=4)
        >>> water = ball.facewrinkle.tear(start=(15.0, 37.0, 0.0), width=4.0)
        >>> water.n_open_edges
        0
        """
        options |= {"units": _units(self._mesh, units)}
        stream = SheddingTear(self._mesh, path, start=start, **grouped(options, film=Film, flow=Flow, route=Route))
        return stream.surface(stream.end if t is None else t)


def patterned(face: Face, layers: list[PatternLayer], max_level: int) -> pv.PolyData:
    """Return a face that does not move with layers on it, refined as they need it."""
    needed = max(layer.level_needed(face) for layer in layers)
    simulation = Simulation(face, Refinement(max_level=min(needed, max_level)), layers=layers, motion=Still(face, 1e-9))
    frame, cells = simulation.step(), -1
    while frame.n_cells != cells:
        frame, cells = simulation.step(), frame.n_cells
    return frame


def _units(mesh: pv.DataSet | pv.MultiBlock, units: str | float | None) -> str | float:
    """The unit that was given, or the one that goes with the size of the mesh."""
    if units is not None:
        return units
    size = float(np.linalg.norm(np.ptp(surface_in(mesh).points, axis=0)))
    if not 0.0 < size < np.inf:
        return "mm"
    unit = unit_by_size(size)
    if unit != "mm":
        warn(
            f"the mesh is {size:.3g} from corner to corner: its unit is taken to be {unit}. Give units to say another."
        )
    return unit


def _nearest_part(
    mesh: pv.DataSet | pv.MultiBlock, center: npt.ArrayLike | None, units: str | float
) -> tuple[Face, pv.PolyData | None]:
    """Return the connected part nearest to a point as a face, and the other parts."""
    source = surface_in(mesh)
    triangles = source.triangles.astype(np.int32)
    label = components(triangles)
    if center is None or np.shape(center) != (3,) or label.max() == 0:
        return surface(source, units), None
    own = label == label[closest_point(source.points, triangles, center).triangle]
    rest = source.only(~own).mesh.compute_normals(cell_normals=False, split_vertices=False)
    return surface(source.only(own), units), rest


def _combined(mesh: pv.PolyData, parts: Mapping[str, pv.PolyData]) -> pv.PolyData:
    """Return a mesh and others, which keep still, as one; arrays that these lack are 0 at their points."""
    if not parts:
        return mesh
    for part in parts.values():
        part.point_data["rest"] = np.asarray(part.points)
    whole, pieces = combined_mesh(mesh, parts), [mesh, *parts.values()]
    corners = joined_texture([corner_texture(piece) for piece in pieces], [piece.n_cells for piece in pieces])
    if corners is not None and whole.active_texture_coordinates is not None:
        add_seams(whole, corners)
    return whole
