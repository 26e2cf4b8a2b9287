"""Small meshes for tests, comparisons of meshes, squares in the plane and lines on spheres."""

import numpy as np
import pyvista as pv
from scipy.spatial import Delaunay

import facewrinkle as fw
from facewrinkle.geometry.topology import boundary_loops, euler_characteristic, is_oriented


def mesh_of(points: np.ndarray, triangles: np.ndarray, **point_data: np.ndarray) -> pv.PolyData:
    mesh = pv.PolyData.from_regular_faces(np.array(points, dtype=float), np.asarray(triangles))
    for name, values in point_data.items():
        mesh.point_data[name] = values
    return mesh


def cap(resolution: int = 12) -> pv.PolyData:
    """A round mask that bulges along +z, with an identity for every point."""
    plane, triangles = square(resolution - 1)
    u, v = 2.0 * plane.T - 1.0
    points = np.column_stack([u, v, 1.0 - 0.4 * (u**2 + v**2)])
    return mesh_of(points, triangles, identity=np.arange(len(points)), color=np.abs(points))


def sphere(centre: tuple[float, float, float], radius: float, resolution: int = 8) -> pv.PolyData:
    ball = pv.Sphere(radius=radius, center=centre, theta_resolution=resolution, phi_resolution=resolution)
    return mesh_of(ball.points, ball.regular_faces)


def arrays(mesh: pv.PolyData) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in double precision, and triangles (m, 3)."""
    return np.array(mesh.points, np.float64), np.array(mesh.regular_faces, np.int32)


def side_by_side(*meshes: pv.PolyData) -> pv.PolyData:
    """The meshes side by side, points and triangles in this order."""
    shifts = np.cumsum([0] + [mesh.n_points for mesh in meshes[:-1]])
    return mesh_of(
        np.vstack([mesh.points for mesh in meshes]),
        np.vstack([mesh.regular_faces + shift for mesh, shift in zip(meshes, shifts, strict=True)]),
    )


def delaunay(points: np.ndarray) -> np.ndarray:
    """Triangles between points (n, 2), counter-clockwise."""
    triangles = Delaunay(points).simplices
    u, v = points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    return np.where((u[:, :1] * v[:, 1:] < u[:, 1:] * v[:, :1]), triangles[:, [0, 2, 1]], triangles)


def same_triangles(one: np.ndarray, other: np.ndarray) -> bool:
    """Return True for the same triangles with the same orientation, in any order and from any corner."""

    def turned(triangles: np.ndarray) -> set[tuple[int, ...]]:
        return {tuple(np.roll(t, -int(np.argmin(t))).tolist()) for t in np.asarray(triangles)}

    return len(one) == len(other) and turned(one) == turned(other)


def smallest_angles(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The smallest angle of each triangle, degrees."""
    p = points[triangles]
    u, v = np.roll(p, -1, axis=-2) - p, np.roll(p, 1, axis=-2) - p
    sine = np.linalg.norm(np.cross(u, v), axis=-1)
    return np.degrees(np.arctan2(sine, (u * v).sum(axis=-1)).min(axis=-1))


def area_vectors(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Normals (m, 3) of triangles, of twice the length of their areas."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return np.cross(b - a, c - a)


def enclosed_volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Volume that a closed surface holds, negative where it faces in."""
    return float(np.linalg.det(points[triangles]).sum() / 6.0)


def signed_distances(points: np.ndarray, skin: pv.PolyData) -> np.ndarray:
    """Distances of points (n, 3) from a mesh, negative on the side that its normals point away from."""
    vertices, triangles = np.asarray(skin.points, dtype=float), np.asarray(skin.regular_faces)
    cells, near = fw.mesh.closest_places(skin, points)
    corners = triangles[cells]
    normals = fw.geometry.interpolated(
        fw.geometry.vertex_normals(vertices, triangles), corners, fw.geometry.barycentric(near, vertices[corners])
    )
    away = np.asarray(points, dtype=float) - near
    return np.copysign(np.linalg.norm(away, axis=1), (away * normals).sum(axis=1))


# --- unit squares of triangles, and sheets that are pressed together -------------------------------


def grid(n: int) -> np.ndarray:
    """Quads of an n x n grid of cells, vertex (i, j) at i (n + 1) + j."""
    i, j = np.divmod(np.arange(n * n), n)
    first = i * (n + 1) + j
    return np.stack([first, first + n + 1, first + n + 2, first + 1], axis=1)


def square(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit square of n x n cells: points (k, 2) and triangles."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    quads = grid(n)
    return np.stack([x.ravel(), y.ravel()], axis=1), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def signed_areas(plane: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(plane[triangles], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def pressed(sheet: fw.Face, shares: list[tuple[float, float]]) -> fw.Recorded:
    """A recording of a sheet that is pressed together by shares of its width and height, every 0.02 s by the next."""
    return fw.Recorded.of_positions([sheet.points * [1.0 - x, 1.0 - y, 1.0] for x, y in [(0.0, 0.0), *shares]], fps=50)


# --- spheres, for the tests of tears ---------------------------------------------------------------


def meridian(azimuth: float, radius: float = 50.0) -> np.ndarray:
    """Points down a sphere about the origin, from near its top to near its bottom."""
    polar = np.linspace(0.3, 2.8, 30)
    x, y = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return radius * np.stack([x, np.cos(polar), y], axis=1)


def assert_ball(mesh):
    """It is closed, of genus 0, turned outwards, and has no vertices to spare."""
    triangles = np.asarray(mesh.regular_faces)
    assert not boundary_loops(triangles)
    assert euler_characteristic(triangles) == 2
    assert is_oriented(triangles)
    assert len(np.unique(triangles)) == mesh.n_points
    assert mesh.volume > 0.0
