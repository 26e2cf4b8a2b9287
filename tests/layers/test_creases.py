"""Creases of old skin: there at rest, once each, deeper in motion, and gone where the skin is stretched."""

import numpy as np
import pytest

import facewrinkle as fw
from analysis.realism import cuts
from facewrinkle.layers.compression import StrainField
from facewrinkle.layers.creases import PLACES, Gathered


def settled(face, age, what=None):
    sim = fw.Simulation(face, layers=[fw.Creases(age=age)])
    if what is not None:
        sim.express(what)
    return sim.settle()


def depth_near(frame, face, place, reach=12.0):
    """Depth of the deepest furrow, mm, near a place of the face at rest."""
    near = np.linalg.norm(np.asarray(frame["rest"]) - place, axis=1) * face.unit < reach
    return -float(np.asarray(frame["W"])[near].min())


@pytest.fixture(scope="module")
def places(face):
    marks = face.landmarks
    return {
        "nasolabial": 0.5 * (marks["ala_l"] + marks["mouth_l"]) + [6.0, 0.0, 0.0],
        "glabella": marks["glabella"],
        "below the corner": marks["mouth_l"] + [0.0, -9.0, 0.0],
    }


def test_young_skin_is_smooth_at_rest(face):
    assert (np.asarray(settled(face, 0.0)["W"]) == 0.0).all()


def test_creases_of_old_skin_are_as_deep_as_on_people(face, places):
    """Nasolabial folds of the last grade of Lemperle et al. (2001) are .8 mm deep."""
    old, middle = settled(face, 1.0), settled(face, 0.5)
    depths = {name: depth_near(old, face, place) for name, place in places.items()}
    assert 0.7 < depths["nasolabial"] < 1.2
    assert 0.2 < depths["glabella"] < depths["below the corner"] < depths["nasolabial"]  # the old are not cross
    half = {name: depth_near(middle, face, place) for name, place in places.items()}
    assert all(0.5 * depths[name] < half[name] < 0.7 * depths[name] for name in places)


def test_a_smile_deepens_an_old_fold(face, places):
    young, old = (depth_near(settled(face, age, "AU12"), face, places["nasolabial"]) for age in (0.0, 1.0))
    assert old > young + 0.3


def test_stretched_skin_loses_its_creases(face, places):
    """Captured puckers smooth the skin beside the mouth."""
    at_rest, puckered = (depth_near(settled(face, 1.0, what), face, places["nasolabial"]) for what in (None, "AU18"))
    assert puckered < 0.8 * at_rest


def test_the_age_is_that_of_the_face_unless_another_is_given():
    aged = fw.default_face({"age": 0.8})
    assert (settled(aged, None)["W"] == settled(aged, 0.8)["W"]).all()
    with pytest.raises(fw.errors.ParameterError, match=r"0 has no lines at rest"):
        fw.Creases(age=2.0)
    with pytest.raises(fw.errors.ParameterError, match=r"seed must lie in \[0"):
        fw.Creases(seed=-1)


# --- people -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def alike(face):
    """The face with uprights of a frown that are the same on both sides, and on everybody."""
    muscles = {name: face.muscles[name] for name in ("corrugator_l", "corrugator_r")}
    return face.with_muscles(
        {k: muscle.replaced(folds=muscle.folds.replaced(variety=0.0)) for k, muscle in muscles.items()}
    )


def of_person(face, seed, what):
    sim = fw.Simulation(face, layers=[fw.Creases(seed=seed)])
    sim.express(what)
    return sim.settle()


def frowns(face, people):
    """Heights on both sides, by the distance from the middle, on the five middle cuts across the frowns of people."""
    found, aside = [], np.linspace(0.0, 12.0, 40)
    for seed in range(people):
        middle = list(cuts(face, of_person(face, seed, "AU4"), "glabella"))[2:7]
        lines = [(distance - 0.5 * distance[-1], height) for distance, height in middle]
        found.append([[np.interp(side * aside, *line) for line in lines] for side in (-1.0, 1.0)])
    return np.array(found).reshape(people, 2, -1)


def test_uprights_of_a_frown_differ_from_side_to_side_and_from_person_to_person(face, alike):
    """On captured people those of the left do not correlate with those of the right."""
    same, people = frowns(alike, 1)[0], frowns(face, 8)
    assert np.corrcoef(*same)[0, 1] > 0.9
    assert np.mean([np.corrcoef(*sides)[0, 1] for sides in people]) < 0.3
    assert np.mean(np.corrcoef(people[:, 0])[np.triu_indices(8, 1)]) < 0.5
    relief = people.std(axis=2)
    assert relief.max() > 2.0 * relief.min()
    assert relief.mean() == pytest.approx(same.std(axis=1).mean(), rel=0.15)
    assert (people.min(axis=(1, 2)) < -0.12).all()  # of ten captured people, the least


def test_all_other_creases_are_the_same_on_everybody(face):
    first, second = (of_person(face, seed, "AU12") for seed in (0, 7))
    np.testing.assert_array_equal(first["W"], second["W"])


# --- compression, gathered over the width of a crease ---------------------------------------------


@pytest.fixture(scope="module")
def parts(face):
    muscles = [muscle.fold_pattern for muscle in face.muscles.values()]
    field = StrainField(face.points, face.triangles)
    return list(face.muscles), muscles, Gathered(face, muscles, face.zones, field.metric), field


@pytest.mark.parametrize("share", [0.1, 0.0, -0.2])
def test_a_face_that_shrinks_is_compressed_alike_everywhere(face, parts, share):
    *_, gathered, field = parts
    epsilon = gathered.epsilon(field.strain((1.0 - share) * face.points))
    assert epsilon.shape[1] == PLACES
    np.testing.assert_allclose(epsilon, share, atol=1e-12)


def test_the_compression_is_that_across_the_crease(face, parts):
    """A glabella that is pressed together from the sides: upright creases there take up nearly all of it."""
    names, muscles, gathered, field = parts
    index = names.index("corrugator_l")
    lam = np.linspace(0.2, 0.8, 5)
    entries = gathered.places(np.full(5, index, np.int32), lam)
    epsilon = gathered.at(field.strain(face.points * [0.9, 1.0, 1.0]), *entries)
    across = muscles[index].fold_direction(muscles[index].points_at(lam, 0.0 * lam))
    assert (epsilon > 0.06).all()
    assert (epsilon < 0.1).all()
    assert (np.abs(gathered.at(field.strain(face.points * [1.0, 0.9, 1.0]), *entries)) < 0.02).all()
    assert (np.abs(across[:, 0]) > 0.9).all()


def test_between_places_the_compression_is_interpolated_linearly(face, parts):
    names, _, gathered, field = parts
    strain = field.strain(face.points * [0.9, 0.8, 1.1])
    lam = np.array([0.0, 0.5 / (PLACES - 1), 1.0 / (PLACES - 1), 1.0])
    places = gathered.places(np.full(4, names.index("zygomaticus_major_r"), np.int32), lam)
    epsilon = gathered.at(strain, *places)
    row = gathered.epsilon(strain)
    assert [k for k in range(len(row)) if np.isclose(row[k, 0], epsilon[0]) and np.isclose(row[k, -1], epsilon[3])]
    assert epsilon[1] == pytest.approx(0.5 * (epsilon[0] + epsilon[2]))
