"""Activation of muscles on a recording, by the measured compression over each.

what                        checked against
uniform scaling             the smoothstep of its compression, for every muscle that folds skin
rest, stretching, turning   exactly or nearly 0
parts and whole             never more than 1, and more for more compression
two muscles, one fold       the one with the deeper wrinkles alone
a contracted skin, replayed the wrinkles that the contraction itself made
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.muscles import zones
from facewrinkle.layers.compression import FULL, SLACK, Activation, StrainField


@pytest.fixture(scope="module")
def activation(face):
    return activation_of(face, [muscle.fold_pattern for muscle in face.muscles.values()])


def activation_of(face, muscles):
    """A function of positions of the base mesh."""
    field = StrainField(face.points, face.triangles)
    found = Activation(face, muscles, zones(muscles, face.points, face.triangles), field)
    return lambda positions: found.at(field.strain(positions))


def named(face, values):
    return dict(zip(face.muscles, values, strict=True))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 1.0, 2.0])
def test_uniform_compression_activates_all_muscles_alike(face, activation, share):
    c = SLACK + share * (FULL - SLACK)
    found = named(face, activation((1.0 - c) * face.points))
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
