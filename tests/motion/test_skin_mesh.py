"""The mesh of the skin.

what                                  checked against
faces of few vertices                 themselves: the same object, the same bytes
the number of vertices                the one that was asked for
what is known of a vertex             that of the whole face
lids, lips, loops                     those of the whole face
motion on a fine face                 the skin simulated whole
gaps of lids and lips                 those of the skin simulated whole
rest, release, settling               rest
cost of a fine face                   its vertices only follow: the simulated mesh does not grow
"""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from skins import held

import facewrinkle as fw
from facewrinkle.geometry.topology import euler_characteristic, unique_edges
from facewrinkle.geometry.untangling import LEAST
from facewrinkle.motion.skin_mesh import SKIN_VERTICES, WORTHWHILE, ReducedFace, SkinMesh

RMS, MOST = 0.15, 0.5
"""Distance, mm, from the skin simulated whole: root mean square, and that of 95 %."""


def split(face, level):
    forest = fw.geometry.RedGreenForest(face.triangles, level, len(face.points))
    for _ in range(level):
        forest.split(np.ones(len(forest.triangles), bool))
    points = fw.geometry.interpolated(face.points, forest.corners, forest.barycentric)
    return fw.fit_face(fw.mesh.to_polydata(points, forest.triangles), face.landmarks, units=face.unit)


@pytest.fixture(scope="module")
def fine(face):
    """The built-in head with all triangles split once: 18 thousand."""
    return split(face, 1)


@pytest.fixture(scope="module")
def mesh(fine):
    return SkinMesh(fine)


def test_a_face_of_few_vertices_is_its_own_mesh(face):
    own = SkinMesh(face)
    moved = np.ones_like(face.points)
    assert own.face is face
    assert own.follow(moved) is moved
    assert SkinMesh(face, None).face is face
    few = int(face.mesh.n_points / WORTHWHILE) + 1
    assert SkinMesh(face, few).face is face
    assert SkinMesh(face, few - 50).face is not face


@pytest.mark.parametrize("count", [1500, 3000, SKIN_VERTICES])
def test_the_mesh_has_about_as_many_vertices_as_were_asked_for(fine, count):
    assert 0.85 < len(SkinMesh(fine, count).vertices) / count < 1.15


@pytest.mark.parametrize("count", [-3, 4.5, "many", 0])
def test_numbers_of_vertices_that_make_no_sense(face, count):
    with pytest.raises(fw.errors.ParameterError, match="vertices"):
        SkinMesh(face, count)


@pytest.mark.slow
def test_a_finer_face_has_no_larger_mesh(face, mesh):
    assert len(SkinMesh(split(face, 2)).vertices) < 1.1 * len(mesh.vertices)


def test_what_is_known_of_a_vertex_is_that_of_the_whole_face(fine, mesh):
    coarse, vertices = mesh.face, mesh.vertices
    assert isinstance(coarse, ReducedFace)
    assert np.array_equal(coarse.points, fine.points[vertices])
    assert (np.diff(vertices) > 0).all()
    for name in ("depth", "stiffness", "normals", "anchors"):
        assert np.array_equal(getattr(coarse.tissue, name), getattr(fine.tissue, name)[vertices])
    assert np.array_equal(coarse.lining.vertices, fine.lining.vertices[vertices])
    assert coarse.joint_weights.keys() == fine.joint_weights.keys()
    for name, joint in coarse.joint_weights.items():
        whole = fine.joint_weights[name]
        angles = np.zeros(len(fine.points))
        angles[whole.vertices] = whole.angles
        assert np.array_equal(joint.angles, angles[vertices[joint.vertices]])
        assert np.isin(whole.vertices, vertices).sum() == len(joint.vertices)


def test_topology_lids_and_holes_are_those_of_the_face(fine, mesh):
    coarse = mesh.face
    assert euler_characteristic(coarse.triangles) == euler_characteristic(fine.triangles)
    assert len(coarse.boundary_loops) == len(fine.boundary_loops)
    edges = {tuple(sorted(edge)) for edge in unique_edges(coarse.triangles)[0].tolist()}
    for side, opening in coarse.eyelid_openings.items():
        for margin, whole in zip(
            (opening.upper, opening.lower),
            (fine.eyelid_openings[side].upper, fine.eyelid_openings[side].lower),
            strict=True,
        ):
            assert np.isin(mesh.vertices[margin], whole).all()
            assert all(tuple(sorted(pair)) in edges for pair in zip(margin.tolist(), margin[1:].tolist(), strict=False))
            assert len(margin) >= 8


@pytest.fixture(scope="module")
def both(fine):
    """The skin of the fine head, on a mesh of its own and whole."""
    return fw.Skin(fine, time_step=0.05), fw.Skin(fine, time_step=0.05, vertices=None)


def settled(skins, rates, steps=25):
    for skin in skins:
        skin.reset()
    return [held(skin, rates, steps) for skin in skins]


@pytest.mark.parametrize(
    "name",
    ["happiness", *(pytest.param(name, marks=pytest.mark.slow) for name in ("kiss", "fear", "anger", "pain"))],
)
def test_the_skin_moves_as_if_simulated_whole(both, name):
    own, whole = settled(both, fw.EXPRESSIONS[name])
    apart = np.linalg.norm(own - whole, axis=1)
    assert np.linalg.norm(whole, axis=1).max() > 5.0
    assert np.sqrt((apart**2).mean()) < RMS
    assert np.percentile(apart, 95) < MOST


def test_lids_shut_as_if_simulated_whole(fine, both):
    moved = settled(both, fine.atlas.contractions("AU43", 1.0))
    for opening in fine.eyelid_openings.values():
        gaps = []
        for u in moved:
            points = both[0].points + u
            lower = cKDTree(points[opening.lower])
            middle = opening.upper[len(opening.upper) // 4 : -len(opening.upper) // 4]
            gaps.append(lower.query(points[middle])[0])
        assert cKDTree(fine.points[opening.lower]).query(fine.points[opening.upper])[0].max() > 8.0
        assert np.abs(gaps[0] - gaps[1]).max() < 0.3


@pytest.mark.slow
def test_lips_part_and_close_as_if_simulated_whole(fine, both):
    up = fine.frame.axes[1]
    lips = [fine.mesh.find_closest_point(fine.landmarks[f"{lip}_lip_mid"]) for lip in ("upper", "lower")]
    for name, least in (("AU26", 5.0), ("AU24", -5.0)):
        apart = [((u[lips[0]] - u[lips[1]]) @ up) for u in settled(both, fine.atlas.contractions(name, 1.0))]
        assert apart[1] > least
        assert abs(apart[0] - apart[1]) < 0.3


def test_rest_is_rest(fine):
    skin = fw.Skin(fine)
    assert len(skin.mesh.vertices) < len(fine.points)
    for _ in range(3):
        assert np.array_equal(skin.step(), skin.points)
    assert skin.points.shape == fine.points.shape
    skin.contract({"frontalis_inner_l": 1.0})
    skin.step()
    assert skin.displacement.shape == fine.points.shape
    assert skin.displacement.any()
    skin.reset()
    assert np.array_equal(skin.step(), skin.points)


def test_a_displacement_that_is_set_is_that_of_the_vertices(fine):
    skin = fw.Skin(fine)
    given = 5.0 * np.sin(fine.points / 60.0)
    skin.displacement = given
    vertices = skin.mesh.vertices
    np.testing.assert_allclose(skin.displacement[vertices], given[vertices], atol=0.05)


def test_vertices_that_follow_go_along_with_the_lids_exactly(face):
    """If the skin of the mesh does no more than turn with shutting lids, all vertices of the face turn with them.

    Without elasticity this crushes a few triangles at the corners of the eyes, whose vertices make room: to give such a
    triangle the least share of its area, a corner moves by no more than this share of its longest edge.
    """
    skin, whole = fw.Skin(face, vertices=1200), fw.Skin(face, vertices=None)
    rates = np.array([name in ("orbicularis_oculi_l", "orbicularis_oculi_r") for name in skin.names], float)
    assert rates.sum() == 2.0
    skin.set_rates(rates)
    skin.step()
    skin.displacement = wanted = whole.joints.shift(rates)
    assert np.linalg.norm(wanted, axis=1).max() > 5.0
    away = np.linalg.norm(skin.displacement - wanted, axis=1)
    edges, _ = unique_edges(face.triangles)
    longest = np.zeros(len(away))
    for end in edges.T:
        np.maximum.at(longest, end, np.linalg.norm(np.diff(face.points[edges], axis=1)[:, 0], axis=1) * face.unit)
    assert (away > 1e-9).mean() < 0.01
    assert (away <= LEAST * longest + 1e-9).all()
    np.testing.assert_allclose(skin.displacement, skin.mesh.untangled(wanted), rtol=0.0, atol=1e-9)


def test_a_fine_face_that_has_settled_is_at_rest(fine):
    sim = fw.Simulation(fine, layers=[])
    sim.express("happiness")
    frame = sim.settle()
    moved = np.abs(sim.step().points[: fine.n_points] - frame.points[: fine.n_points]).max() * fine.unit
    assert 0.0 < moved < 0.012
