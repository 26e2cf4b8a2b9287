"""Frames: their arrays, and that they are nobody's to change.

what                    checked against
arrays of a frame       the names and shapes that the architecture promises; field data
points                  the interpolated skin plus W along the interpolated normals
point data of the mesh  affine functions of the rest position, to 1e-12; nearest vertices for labels
frames over time        their fingerprints, later; a second simulation
"""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista as pv
from expressions import PAPER, after

import facewrinkle as fw


@pytest.mark.parametrize("name", PAPER)
def test_frames_carry_what_they_promise(face, played, name):
    frame, n = played(name).top, played(name).top.n_points
    assert set(fw.mesh.ARRAYS) == {
        "lambda",
        "gamma",
        "epsilon",
        "W",
        "split_gamma",
        "muscle",
        "level",
        "rest",
        "host",
        "theta",
        "family",
    }
    for array in ("lambda", "gamma", "epsilon", "W", "split_gamma"):
        assert frame[array].shape == (n,)
        assert frame[array].dtype == np.float64
        assert np.isfinite(frame[array]).all()
    assert frame["rest"].shape == (n, 3)
    assert frame["muscle"].dtype.kind == frame["level"].dtype.kind == "i"
    assert frame["muscle"].min() == -1
    assert frame["muscle"].max() < len(face.muscles)
    assert list(frame.field_data[fw.mesh.MUSCLES]) == list(face.muscles)
    np.testing.assert_allclose(np.linalg.norm(frame["Normals"], axis=1), 1.0, atol=1e-12)
    assert frame.point_data.active_normals_name == "Normals"
    assert frame.points.dtype == np.float64
    assert frame.is_all_triangles
    assert set(face.mesh.point_data) <= set(frame.point_data)
    assert frame.active_texture_coordinates.shape == (n, 2)
    # The vertices of the mesh come first, where they were at rest, to the last bit.
    base = face.mesh.n_points
    assert np.array_equal(frame["rest"][:base], face.points)
    assert (frame["level"][:base] == 0).all()
    assert (frame["level"][base:] >= 1).all()
    hosts = face.points[face.triangles[frame["host"]]]
    flat = np.cross(hosts[:, 1] - hosts[:, 0], hosts[:, 2] - hosts[:, 0])
    assert np.abs(((frame["rest"] - hosts[:, 0]) * flat).sum(axis=1)).max() < 1e-6
    assert np.isfinite(frame.points).all()


@pytest.mark.parametrize("name", PAPER)
def test_points_are_the_skin_and_w_along_its_normals(face, played, name):
    held, frame = played(name).held, played(name).top

    def interpolated(values):
        return np.einsum("nc,nck->nk", held.barycentric, values[held.corners])

    normals = fw.geometry.unit(interpolated(fw.geometry.vertex_normals(held.bare, face.triangles)))
    np.testing.assert_allclose(
        frame.points, interpolated(held.bare) + frame["W"][:, None] * normals, rtol=0, atol=1e-10
    )
    np.testing.assert_allclose(frame["rest"], interpolated(face.points), rtol=0, atol=1e-11)
    assert np.array_equal(frame.regular_faces, held.triangles)


@pytest.fixture(scope="module")
def labeled(face):
    """The built-in face with point data of all kinds."""
    mesh, x = face.mesh.copy(), face.points
    n = len(x)
    mesh.point_data["affine"] = x @ np.array([0.3, -1.0, 2.0]) + 5.0
    mesh.point_data["vectors"] = x[:, [1, 2, 0]] * 2.0 - 7.0
    mesh.point_data["single"] = x[:, 0].astype(np.float32)
    mesh.point_data["number"] = np.arange(n)
    mesh.point_data["small"] = np.arange(n, dtype=np.int16) * 3
    mesh.point_data["tiny"] = (np.arange(n) % 251).astype(np.uint8)
    mesh.point_data["flag"] = x[:, 0] > 0.0
    mesh.point_data["W"] = np.full(n, 7.0)
    mesh.cell_data["of each triangle"] = np.arange(mesh.n_cells)
    return dataclasses.replace(face, mesh=mesh)


def test_point_data_goes_through_refinement(labeled, fingerprint):
    before = fingerprint(labeled.mesh)
    sim = fw.Simulation(labeled)
    frame = after(sim, "paper_surprise", 25)
    rest, n0 = np.asarray(frame["rest"]), labeled.mesh.n_points
    assert frame.n_points > n0 + 500
    np.testing.assert_allclose(frame["affine"], rest @ np.array([0.3, -1.0, 2.0]) + 5.0, rtol=0, atol=1e-12 * 400)
    np.testing.assert_allclose(frame["vectors"], rest[:, [1, 2, 0]] * 2.0 - 7.0, rtol=0, atol=1e-12 * 400)
    assert frame["single"].dtype == np.float32
    np.testing.assert_allclose(frame["single"], rest[:, 0], rtol=0, atol=2e-5)
    for name in ("number", "small", "tiny", "flag"):
        assert np.asarray(frame[name]).dtype == np.asarray(labeled.mesh[name]).dtype
        assert np.array_equal(frame[name][:n0], labeled.mesh[name])
    # Labels are those of a vertex of the base triangle that the point lies in, the heaviest.
    corners, weights = sim.forest.corners, sim.forest.barycentric
    heaviest = weights[np.arange(len(weights)), np.argmax(weights, axis=1)]
    own = np.where(corners == np.asarray(frame["number"])[:, None], weights, 0.0).max(axis=1)
    np.testing.assert_allclose(own, heaviest, atol=1e-15)
    assert np.array_equal(frame["tiny"], np.asarray(frame["number"]) % 251)
    uv = np.einsum("nc,nck->nk", weights, np.asarray(labeled.mesh.active_texture_coordinates)[corners])
    np.testing.assert_allclose(frame.active_texture_coordinates, uv, atol=1e-12)
    color = np.einsum("nc,nck->nk", weights, np.asarray(labeled.mesh["Colors"], dtype=float)[corners])
    assert frame["Colors"].dtype == np.uint8
    np.testing.assert_allclose(frame["Colors"], color, atol=0.5 + 1e-9)
    # The simulation's own arrays win over the input's of the same name, and the input keeps its own.
    assert frame["W"].max() < 7.0
    assert fingerprint(labeled.mesh) == before


def test_frames_do_not_change_after_they_were_handed_out(face, fingerprint):
    sim = fw.Simulation(face)
    sim.express("paper_fear")
    frames, marks = [], []
    for frame in sim.run(30):
        frames.append(frame)
        marks.append(fingerprint(frame))
    sim.relax()
    for _ in sim.run(30):
        pass
    assert [fingerprint(frame) for frame in frames] == marks
    assert len(set(marks)) == len(marks)


def test_frames_with_any_texture_coordinates_can_be_saved(tmp_path):
    """VTK's writer of PLY files reads texture coordinates in single precision, whatever they are."""
    sheet = pv.Plane(i_resolution=4, j_resolution=4).triangulate()
    sheet.active_texture_coordinates = np.random.default_rng(0).uniform(size=(sheet.n_points, 2))
    trimesh = SimpleNamespace(
        vertices=sheet.points, faces=sheet.regular_faces, visual=SimpleNamespace(uv=sheet.active_texture_coordinates)
    )
    face = fw.surface(sheet)
    path = fw.write_mesh(face.mesh, tmp_path / "sheet.obj", fw.surface(sheet, texture=np.zeros((4, 4, 3), np.uint8)))
    frame = fw.Simulation(face).step()
    fine = fw.refine(face.mesh, np.ones(face.mesh.n_cells, bool))
    for mesh in (frame, face.mesh, fine, *map(fw.read_surface, (sheet, path, trimesh))):
        assert mesh.active_texture_coordinates.dtype == np.float32
        mesh.save(tmp_path / "saved.ply")
        saved = pv.read(tmp_path / "saved.ply")
        np.testing.assert_array_equal(saved.active_texture_coordinates, mesh.active_texture_coordinates)
