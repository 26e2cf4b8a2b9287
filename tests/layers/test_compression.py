"""Compression along muscles, by edges (Eqs. 8-9) and from the deformation gradient.

what                              checked against
turning and uniform scaling       c, exactly, by both methods on curved meshes
affine maps of a flat mesh        1 - |F m| of the map, for the gradient; the sums of Eq. 9 written out, for the edges
bending a sheet round a cylinder  its known stretch, with the order of convergence
the largest over all tangents     singular values of the map; a search over many tangents of a curved mesh

Activation of muscles on a recording, by the measured compression over each.

what                        checked against
uniform scaling             the smoothstep of its compression, for every muscle that folds skin
rest, stretching, turning   exactly or nearly 0
parts and whole             never more than 1, and more for more compression
two muscles, one fold       the one with the deeper wrinkles alone
a contracted skin, replayed the wrinkles that the contraction itself made
"""

import numpy as np
import pytest
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation
from small_meshes import square

import facewrinkle as fw
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.layers.compression import (
    FULL,
    SLACK,
    Activation,
    StrainField,
    along,
    compression_along,
    mixed,
    principal_compression,
    products,
    shortening,
)

TURN = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()


def gradient_compression(points, triangles, deformed, directions):
    """epsilon at the vertices of the base mesh, as the layer evaluates it."""
    field = StrainField(points, triangles)
    squares = products(directions, directions) / along(field.metric, directions)[:, None]
    return shortening((squares * field.strain(deformed)).sum(axis=1))


def edges_compression(points, triangles, deformed, directions):
    rings = fw.geometry.vertex_rings(triangles, len(points))
    return fw.geometry.EdgeWeights(points, rings, np.arange(len(points))).epsilon(deformed, directions)


METHODS = {"gradient": gradient_compression, "edges": edges_compression}


def flat_cloud(n=150, seed=2):
    """An irregular flat mesh."""
    plane = np.random.default_rng(seed).uniform(-10, 10, (n, 2))
    return np.c_[plane, np.zeros(n)], Delaunay(plane).simplices.astype(np.int32)


def bowl(seed=4):
    """An irregular, strongly curved mesh, and unit tangents in random directions."""
    points, triangles = flat_cloud(seed=seed)
    points[:, 2] = 0.06 * points[:, 0] ** 2 - 0.04 * points[:, 1] ** 2 + np.sin(points[:, 0])
    normals = vertex_normals(points, triangles)
    tangents = np.cross(normals, np.random.default_rng(seed).normal(size=points.shape))
    return points, triangles, tangents / np.linalg.norm(tangents, axis=1, keepdims=True)


# --- exact cases --------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("c", [0.0, 0.3, 0.999, 1.0, -0.4, 1e-6])
def test_uniform_scaling_gives_exactly_c(method, c):
    points, triangles, tangents = bowl()
    epsilon = METHODS[method](points, triangles, (1.0 - c) * points @ TURN.T + 5.0, tangents)
    # The gradient comes with |F m|^2, whose rounding the root magnifies where nothing is left of the skin.
    np.testing.assert_allclose((1.0 - epsilon) ** 2, (1.0 - c) ** 2, rtol=0, atol=1e-13)
    if c < 0.9 or method == "edges":
        np.testing.assert_allclose(epsilon, c, rtol=0, atol=1e-12)


def test_rest_gives_zero_to_the_last_bit():
    points, triangles, tangents = bowl()
    for method in METHODS.values():
        assert not method(points, triangles, points.copy(), tangents).any()
    field, normals = StrainField(points, triangles), vertex_normals(points, triangles)
    assert not principal_compression(field.strain(points), field.metric, normals)[0].any()


def test_gradient_is_the_stretch_of_any_affine_map():
    points, triangles = flat_cloud()
    rng = np.random.default_rng(8)
    f = TURN @ (np.eye(3) + 0.5 * rng.normal(size=(3, 3)))
    angles = rng.uniform(0, 2 * np.pi, len(points))
    m = np.c_[np.cos(angles), np.sin(angles), np.zeros(len(points))]
    epsilon = gradient_compression(points, triangles, points @ f.T + 3.0, m)
    np.testing.assert_allclose(epsilon, 1.0 - np.linalg.norm(m @ f.T, axis=1), rtol=0, atol=1e-11)


def test_edges_are_eq_9_written_out():
    points, triangles, tangents = bowl()
    deformed = points + 0.4 * np.random.default_rng(1).normal(size=points.shape)
    neighbors = [set() for _ in points]
    for a, b, c in triangles.tolist():
        neighbors[a] |= {b, c}
        neighbors[b] |= {a, c}
        neighbors[c] |= {a, b}
    expected = []
    for i, ring in enumerate(neighbors):
        weighted = total = 0.0
        for j in ring:
            length = np.linalg.norm(points[j] - points[i])
            now = np.linalg.norm(deformed[j] - deformed[i])
            tau = (length - now) / length
            cosine = abs((deformed[j] - deformed[i]) @ tangents[i]) / now
            weighted, total = weighted + tau * cosine, total + cosine
        expected.append(weighted / total)
    np.testing.assert_allclose(edges_compression(points, triangles, deformed, tangents), expected, rtol=0, atol=1e-12)


def test_edges_square_to_the_direction_say_nothing():
    points = np.array([[0.0, 0, 0], [0, 1, 0], [0, 2, 0.5]])
    triangles = np.array([[0, 1, 2]])
    assert not edges_compression(points, triangles, 0.5 * points, np.tile([1.0, 0, 0], (3, 1))).any()


# --- bending ------------------------------------------------------------------------------------


def bent_error(k, c=0.2, radius=2.0):
    """Largest error inside a regular sheet, k squares a side, that is squeezed by c and bent round a cylinder."""
    plane, triangles = square(k)
    x, y = 2.0 * plane.T - 1.0
    points = np.c_[x, y, np.zeros(len(x))]
    arc = (1.0 - c) * x / radius
    bent = np.c_[radius * np.sin(arc), y, radius * np.cos(arc)]
    inside = (abs(x) < 1.0 - 1e-9) & (abs(y) < 1.0 - 1e-9)
    m = np.tile([1.0, 0.0, 0.0], (len(x), 1))
    return np.abs(gradient_compression(points, triangles.astype(np.int32), bent, m)[inside] - c).max()


def test_gradient_converges_on_a_bent_sheet():
    errors = np.array([bent_error(k) for k in (8, 16, 32, 64)])
    assert (np.log2(errors[:-1] / errors[1:]) > 1.9).all()
    assert errors[-1] < 1e-4


def test_along_is_the_quadratic_form():
    rng = np.random.default_rng(0)
    t, m = rng.normal(size=(5, 6)), rng.normal(size=(5, 3))
    full = t[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]]
    np.testing.assert_allclose(along(t, m), np.einsum("ni,nij,nj->n", m, full, m), atol=1e-13)
    # One direction for all tensors, one pair alone, many directions of each.
    np.testing.assert_allclose(along(t, m[0]), np.einsum("i,nij,j->n", m[0], full, m[0]), atol=1e-13)
    np.testing.assert_allclose(along(t[1], m[1]), m[1] @ full[1] @ m[1], atol=1e-13)
    fan = rng.normal(size=(4, 5, 3))
    np.testing.assert_allclose(along(t, fan), np.einsum("kni,nij,knj->kn", fan, full, fan), atol=1e-13)
    np.testing.assert_allclose(mixed(t, m, fan[0]), np.einsum("ni,nij,nj->n", m, full, fan[0]), atol=1e-13)
    assert products(np.float32(m), m).dtype == np.float64
    assert np.array_equal(products(np.float32(m), m), products(np.float64(np.float32(m)), m))


def test_principal_compression_is_that_of_the_singular_values():
    rng = np.random.default_rng(8)
    points, triangles = flat_cloud()
    for _ in range(20):
        plane = np.eye(2) + rng.uniform(-0.45, 0.45, (2, 2))
        deformed = np.c_[points[:, :2] @ plane.T, np.zeros(len(points))] @ TURN.T + [5.0, -3.0, 8.0]
        field = StrainField(points @ TURN, triangles)
        normals = np.tile([0.0, 0.0, 1.0] @ TURN, (len(points), 1))
        most, tangents = principal_compression(field.strain(deformed), field.metric, normals)
        _, stretches, directions = np.linalg.svd(plane)
        np.testing.assert_allclose(most, 1.0 - stretches[1], atol=1e-12)
        expected = np.append(directions[1], 0.0) @ TURN
        np.testing.assert_allclose(np.abs(tangents @ expected), 1.0, atol=1e-9)


def test_no_tangent_is_compressed_more_than_the_principal_one():
    points, triangles, _ = bowl()
    deformed = points * [0.9, 1.05, 0.7] + 0.2 * np.sin(points[:, [1, 2, 0]])
    field, normals = StrainField(points, triangles), vertex_normals(points, triangles)
    state = field.strain(deformed), field.metric, normals
    most, tangents = principal_compression(*state)
    np.testing.assert_allclose((tangents * normals).sum(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(compression_along(*state, tangents), most, atol=1e-12)
    across = np.cross(normals, tangents)
    angles = np.linspace(0.0, np.pi, 181)
    every = [compression_along(*state, np.cos(a) * tangents + np.sin(a) * across) for a in angles]
    assert (np.max(every, axis=0) <= most + 1e-12).all()
    assert (np.min(every, axis=0) < most - 1e-3).all()


def test_only_the_part_of_a_direction_in_the_surface_counts():
    points, triangles, tangents = bowl()
    field, normals = StrainField(points, triangles), vertex_normals(points, triangles)
    state = field.strain(points * [0.8, 1.1, 1.0]), field.metric, normals
    slanted = 3.0 * tangents - 7.0 * normals
    np.testing.assert_allclose(compression_along(*state, slanted), compression_along(*state, tangents), atol=1e-12)
    assert not compression_along(*state, normals).any()
    lengths = np.geomspace(1e-12, 1e12, len(points))[:, None]
    np.testing.assert_allclose(
        compression_along(*state, lengths * tangents), compression_along(*state, tangents), atol=1e-12
    )
    assert not compression_along(*state, np.zeros_like(tangents)).any()
    one = compression_along(*state, np.array([1.0, 0.0, 0.0]))
    assert np.array_equal(one, compression_along(*state, np.tile([1.0, 0.0, 0.0], (len(points), 1))))


@pytest.fixture(scope="module")
def activation(face):
    return activation_of(face, [muscle.fold_pattern for muscle in face.muscles.values()])


def activation_of(face, muscles):
    """A function of positions of the base mesh."""
    field = StrainField(face.points, face.triangles)
    found = Activation(face, muscles, fw.anatomy.zones(muscles, face.points, face.triangles), field)
    return lambda positions: found.at(field.strain(positions))


def named(face, values):
    return dict(zip(face.muscles, values, strict=True))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 1.0, 2.0])
def test_uniform_compression_activates_all_muscles_alike(face, activation, share):
    found = named(face, activation((1.0 - (SLACK + share * (FULL - SLACK))) * face.points))
    t = min(share, 1.0)
    folding = {name for name, rate in found.items() if rate > 0.0}
    assert len(folding) >= 20
    assert not {name for name in folding if name.startswith(("jaw", "levator_palpebrae"))}
    for name in folding:
        assert found[name] == pytest.approx(t * t * (3.0 - 2.0 * t), abs=1e-9)


def test_rest_stretched_and_turned_skin_is_not_active(face, activation):
    turned = face.points @ Rotation.from_rotvec([0.4, -1.3, 0.8]).as_matrix().T + [100.0, 5.0, -40.0]
    for deformed in (face.points, 1.2 * face.points, turned, (1.0 - 0.9 * SLACK) * face.points):
        assert not activation(deformed).any()


def test_more_compression_is_never_less_activation(face, activation):
    before = np.zeros(len(face.muscles))
    for c in np.linspace(0.0, 0.4, 21):
        now = activation(face.points * [1.0, 1.0 - c, 1.0])
        assert (now >= before - 1e-12).all()
        assert now.max() <= 1.0
        before = now
    rates = named(face, before)
    assert rates["frontalis_inner_l"] == 1.0  # along y
    assert rates["corrugator_l"] < 0.2  # across it


def test_of_two_muscles_with_one_fold_the_deeper_acts(face):
    squeezed = 0.9 * face.points
    pattern = face.muscles["frontalis_inner_l"].fold_pattern
    deeper, shallower = pattern.replaced(depth=2.0), pattern.replaced(depth=0.7)
    other = face.muscles["frontalis_inner_r"].fold_pattern
    assert activation_of(face, [shallower, deeper, other])(squeezed).tolist() == [0.0, 1.0, 1.0]
    assert activation_of(face, [deeper, shallower, other])(squeezed).tolist() == [1.0, 0.0, 1.0]


def test_a_contraction_that_is_replayed_folds_the_same_wrinkles(papers, played):
    held = played("paper_surprise").held
    recorded = fw.Recorded.of_positions([papers.points, held.bare], times=[0.0, 0.4])
    sim = fw.Simulation(papers, motion=recorded, layers=[fw.MuscleWrinkles()])
    *_, frame = sim.run(40)
    n = papers.mesh.n_points
    np.testing.assert_allclose(sim.motion.step(), held.bare, atol=1e-12)
    making = [name for name, rate in held.rates.items() if rate > 0.0]
    rates = named(papers, sim.layers[0].rates)
    assert min(rates[name] for name in making) == 1.0
    ours = {name: sim.fields(name) for name in making}
    for name in making:
        np.testing.assert_allclose(ours[name]["epsilon"][:n], held.fields[name]["epsilon"][:n], atol=1e-9)
    # Other muscles become active where the moving skin is squeezed over them; elsewhere the wrinkles are the same.
    together = sum(own["W"] for own in ours.values())
    alone = (np.abs(frame["W"] - together) < 1e-12)[:n]
    replayed, made = together[:n][alone], sum(held.fields[name]["W"] / held.rates[name] for name in making)[:n][alone]
    assert np.ptp(replayed) > 0.5
    np.testing.assert_allclose(replayed, made, atol=1e-9)


def test_skin_folds_across_the_largest_compression(face, activation):
    """The forehead's muscles run upwards: what squeezes it from both sides folds it otherwise."""
    up = named(face, activation(face.points * [1.0, 0.9, 1.0]))
    both = named(face, activation(face.points * [0.6, 0.9, 1.0]))
    assert up["frontalis_inner_l"] == up["frontalis_major_r"] == 1.0
    assert both["frontalis_inner_l"] == both["frontalis_major_r"] == 0.0
