"""Texture seams of meshes that are read, mended, refined and wrinkled.

The oracle is a ball whose texture coordinates are longitude and latitude: at the meridian where the longitude jumps,
every point has two. On each triangle of the base mesh they are linear.
"""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.mesh import add_seams, corner_texture, prepare, split_at_seams, to_polydata


def ball():
    """A ball of 40 mm; the texture wraps around it and has a seam at the back, along edges near x = 0."""
    mesh = pv.Icosphere(radius=40.0, nsub=3)
    ball = to_polydata(mesh.points, mesh.regular_faces)
    corners = np.asarray(mesh.points, float)[mesh.regular_faces]
    u = np.arctan2(corners[..., 0], corners[..., 2]) / (2.0 * np.pi) + 0.5
    u = np.where(np.ptp(u, axis=1, keepdims=True) > 0.5, np.where(u < 0.5, u + 1.0, u), u)  # around the back
    v = np.arcsin(corners[..., 1] / 40.0) / np.pi + 0.5
    texture = np.stack([u, v], axis=-1)
    ball.point_data["Texture Coordinates"] = np.zeros((ball.n_points, 2))
    ball.point_data["Texture Coordinates"][mesh.regular_faces.ravel()[::-1]] = texture.reshape(-1, 2)[::-1]
    ball.point_data.active_texture_coordinates_name = "Texture Coordinates"
    add_seams(ball, texture)
    return ball


@pytest.fixture(scope="module")
def moved():
    """The ball, and a simulation of it whose pattern lies across the seam."""
    mesh = ball()
    layer = fw.PatternLayer("forehead", (0.0, 0.0, -40.0), size=(50.0, 30.0), depth=2.0)
    simulation = fw.Simulation(mesh, fw.Refinement(max_level=3), layers=[layer])
    *_, frame = simulation.run(6)
    return mesh, simulation, frame


def test_every_corner_of_a_refined_mesh_lies_in_the_texture_where_its_base_triangle_has_it(moved):
    mesh, simulation, frame = moved
    assert frame.n_cells > 3 * mesh.n_cells
    assert simulation.forest.level.max() == 3
    # Independently: barycentric coordinates of the rest positions in the plane of the base triangle.
    roots = simulation.forest.root
    a, b, c = (np.asarray(mesh.points)[mesh.regular_faces[roots, k]][:, None] for k in range(3))
    p = np.asarray(frame["rest"])[frame.regular_faces]
    normal = np.cross(b - a, c - a)
    square = (normal**2).sum(axis=-1)
    second = (np.cross(p - a, c - a) * normal).sum(axis=-1) / square
    third = (np.cross(b - a, p - a) * normal).sum(axis=-1) / square
    weights = np.stack([1.0 - second - third, second, third], axis=-1)
    np.testing.assert_allclose(corner_texture(frame), weights @ corner_texture(mesh)[roots], atol=1e-12)


def test_the_skin_is_split_at_the_seam_and_does_not_tear_open(moved):
    mesh, _, frame = moved
    assert np.abs(frame["W"]).max() > 0.5
    assert frame.n_open_edges == 0  # what moves is whole
    apart = split_at_seams(frame)
    n = frame.n_points
    assert apart.n_points > n
    in_file = corner_texture(frame).astype(np.float32)  # as VTK stores them
    np.testing.assert_array_equal(apart.active_texture_coordinates[apart.regular_faces], in_file)
    np.testing.assert_array_equal(apart.points[apart.regular_faces], frame.points[frame.regular_faces])
    np.testing.assert_array_equal(apart["Normals"][apart.regular_faces], frame["Normals"][frame.regular_faces])
    for name in ("W", "rest", "level"):
        np.testing.assert_array_equal(apart[name][:n], frame[name])
    # Welded again it is the frame: no vertex of one side lies within an edge of the other.
    _, number = np.unique(apart.points, axis=0, return_inverse=True)
    again = to_polydata(np.unique(apart.points, axis=0), number.ravel()[apart.regular_faces])
    assert (again.n_points, again.n_open_edges) == (n, 0)
    # The border runs along the seam alone: but for its two ends, all points on it are twins.
    rim = apart.extract_feature_edges(feature_edges=False, non_manifold_edges=False, manifold_edges=False)
    on_rim, twins = ({tuple(point) for point in points.tolist()} for points in (rim.points, apart.points[n:]))
    assert twins < on_rim
    assert len(on_rim - twins) == 2
    assert (split_at_seams(mesh).n_points - mesh.n_points) < apart.n_points - n  # refined along it too


def test_seams_are_kept_when_a_mesh_is_mended(fingerprint):
    mesh = ball()
    triangles = mesh.regular_faces.copy()
    flipped = to_polydata(np.vstack([mesh.points, mesh.points[0] + 100.0]), np.vstack([triangles, triangles[:1]]))
    flipped.cell_data["Texture Corners"] = np.vstack([mesh.cell_data["Texture Corners"]] * 2)[: len(triangles) + 1]
    inward = flipped.copy()
    inward.faces = pv.PolyData.from_regular_faces(flipped.points, flipped.regular_faces[:, ::-1]).faces
    inward.cell_data["Texture Corners"] = corner_texture(flipped)[:, ::-1].reshape(-1, 6)
    before = fingerprint(inward)
    with pytest.warns(fw.FaceWrinkleWarning):
        clean = prepare(inward).mesh
    assert fingerprint(inward) == before

    def laid(mesh):
        corners = np.concatenate([mesh.points[mesh.regular_faces], corner_texture(mesh)], axis=2)
        return {tuple(sorted(map(tuple, triangle))) for triangle in corners.tolist()}

    assert clean.n_cells == mesh.n_cells
    assert laid(clean) == laid(mesh)


def test_a_mesh_without_seams_is_not_split(face):
    assert split_at_seams(face.mesh) is face.mesh
    plain = to_polydata(np.eye(3), np.array([[0, 1, 2]]))
    assert corner_texture(plain) is None
    assert split_at_seams(plain) is plain


def test_refine_carries_seams():
    mesh = ball()
    fine = fw.refine(mesh, np.ones(mesh.n_cells, bool))
    middle = corner_texture(mesh).mean(axis=1)
    np.testing.assert_allclose(corner_texture(fine).reshape(-1, 4, 3, 2).mean(axis=(1, 2)), middle, atol=1e-14)


def test_patterns_on_one_part_of_several_keep_the_seams_of_all(fingerprint):
    import facewrinkle.accessor  # noqa: F401

    one, other = ball(), ball()
    n = one.n_points
    both = to_polydata(
        np.vstack([one.points, np.add(other.points, [200.0, 0.0, 0.0])]),
        np.vstack([one.regular_faces, one.regular_faces + n]),
    )
    both.point_data["Texture Coordinates"] = np.vstack([one.active_texture_coordinates] * 2)
    both.point_data.active_texture_coordinates_name = "Texture Coordinates"
    add_seams(both, np.concatenate([corner_texture(one)] * 2))
    before = fingerprint(both)
    laid = both.facewrinkle.pattern("dimple", center=(0, 0, -40), size=30.0, depth=3.0)
    assert fingerprint(both) == before
    far = np.asarray(laid.points)[laid.regular_faces][:, 0, 0] > 100.0
    np.testing.assert_array_equal(corner_texture(laid)[far], corner_texture(other))
    assert split_at_seams(laid).n_points - laid.n_points > 2 * (split_at_seams(one).n_points - n)
