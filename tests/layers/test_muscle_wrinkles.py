"""The layer of muscle wrinkles.

what                            checked against
W                               the sum over the muscles of depth c H At sin(pi epsilon / 2), evaluated afresh at the
                                rest positions of all vertices, epsilon from the metric in numpy; where they ask
                                for more than 2 L sqrt(epsilon) / pi from bulge to furrow, in proportion less
the bound                       bulges and furrows measured on the relief itself, however deep they are asked for
without the bound               the paper's sum
zeros                           exact: at rest, where epsilon <= 0, outside the regions
dominant muscle, lambda, gamma  the largest |H At| over all muscles; its coordinates
muscles with the same folds     each evaluated by itself
leveled heights                as much above as below where that can be had; the greatest shares where it cannot; the
                                same heights where both sides hold as much
linings                         exactly 0 there, on a head with a mouth's bag and sockets
"""

import numpy as np
import pytest
from expressions import PAPER, after
from hypothesis import given
from hypothesis import strategies as st
from synthetic_faces import head_with

import facewrinkle as fw
from facewrinkle.layers.compression import StrainField, along
from facewrinkle.layers.entries import LEVELLED, RAISED, STEPS, level_shares
from facewrinkle.layers.muscle_wrinkles import MuscleWrinkles, outer_skin


def seen_share(face, held):
    """Share of its wrinkles that each vertex has: none in the lining of lips and lids."""
    return (held.barycentric * outer_skin(face)[held.corners]).sum(axis=1)


def evaluated(face, held):
    """Per muscle (H At, epsilon) at all vertices, afresh from the rest positions and the deformed base mesh."""
    seen = seen_share(face, held)
    x, normal = held.vertices.points, held.vertices.normals
    field = StrainField(face.points, face.triangles)
    at = [np.einsum("nc,nck->nk", held.barycentric, t[held.corners]) for t in (field.metric, field.strain(held.bare))]
    out = {}
    for name, muscle in face.muscles.items():
        m = muscle.fold_pattern.fold_direction(x)
        m = m - (m * normal).sum(1, keepdims=True) * normal
        length = np.linalg.norm(m, axis=1, keepdims=True)
        m = np.divide(m, length, out=np.zeros_like(m), where=length > 0)
        rest, change = along(at[0], m), along(at[1], m)
        ratio = np.divide(change, rest, out=np.zeros_like(rest), where=rest > 1e-6)
        out[name] = seen * muscle.fold_pattern.unit_amplitude(x), 1.0 - np.sqrt(np.maximum(1.0 + ratio, 0.0))
    return out


@pytest.mark.parametrize("name", PAPER)
def test_w_is_the_sum_over_the_muscles_evaluated_at_rest(papers, played, name):
    play = played(name)
    x, seen = play.held.vertices.points, seen_share(papers, play.held)
    total, asked, own_of = np.zeros(play.top.n_points), np.zeros(play.top.n_points), {}
    for muscle, (unit, epsilon) in evaluated(papers, play.held).items():
        pattern = papers.muscles[muscle].fold_pattern
        depth = pattern.wrinkles.depth * play.held.rates[muscle] * np.sin(0.5 * np.pi * np.clip(epsilon, 0.0, 1.0))
        own_of[muscle] = depth * unit, epsilon
        deep = depth * 2.0**pattern.wrinkles.alpha * pattern.envelope(x) * seen
        some = deep > 0.0
        asked[some] += deep[some] / fw.geometry.deepest(2.0 * pattern.half_cycles(x[some]), epsilon[some])
    for muscle, (wanted, epsilon) in own_of.items():
        own = wanted / np.maximum(asked, 1.0)
        fields = play.held.fields[muscle]
        np.testing.assert_allclose(fields["W"], own, rtol=0, atol=1e-9)
        inside = fields["region"]
        envelope = papers.muscles[muscle].fold_pattern.envelope(play.held.vertices.points)
        assert np.array_equal(inside & (seen > 0.0), (envelope > 0.0) & (seen > 0.0))
        np.testing.assert_allclose(fields["epsilon"][inside], epsilon[inside], rtol=0, atol=1e-9)
        assert not fields["epsilon"][~inside].any()
        total += own
    np.testing.assert_allclose(play.top["W"], total, rtol=0, atol=1e-9)
    assert np.abs(total).max() > 0.1


def deepest_share(sim, frame):
    """The relief of each contracting muscle, from its lowest to its highest point within a wavelength along the fold
    direction, as a share of what the largest compression there allows: the largest of all, and how many were measured.
    """
    rest, shares = frame["rest"], [0.0]
    for index in np.flatnonzero(sim.skin.rates):
        pattern, fields = sim.face.muscles[sim.muscles[index]].fold_pattern, sim.fields(sim.muscles[index])
        for centre in np.flatnonzero(fields["region"] & (np.abs(fields["W"]) > 0.2))[::10]:
            here = rest[centre : centre + 1]
            wavelength, offset = 2.0 * pattern.half_cycles(here)[0], rest - here
            along = np.abs(offset @ pattern.fold_direction(here)[0])
            near = (np.linalg.norm(offset, axis=1) < 0.55 * wavelength) & (along < 0.5 * wavelength)
            bound = fw.geometry.deepest(2.0 * pattern.half_cycles(rest[near]).max(), fields["epsilon"][near].max())
            shares.append(np.ptp(fields["W"][near]) / bound)
    return max(shares), len(shares)


@pytest.mark.parametrize(
    "name", ["paper_surprise", *(pytest.param(name, marks=pytest.mark.slow) for name in ("frowning", "closing_eye"))]
)
@pytest.mark.parametrize("inextensible", [True, False])
def test_however_deep_wrinkles_are_asked_for_skin_sets_the_bound(papers, name, inextensible):
    sim = fw.Simulation(papers, layers=[MuscleWrinkles(depth=8.0, inextensible=inextensible)])
    share, _ = deepest_share(sim, after(sim, name, 30))
    assert (share <= 1.0) == inextensible


def test_the_bound_can_be_left_out(papers):
    frames = []
    for inextensible in (True, False):
        sim = fw.Simulation(papers, layers=[MuscleWrinkles(depth=3.0, inextensible=inextensible)])
        frame = after(sim, "paper_surprise", 25)
        frames.append((frame, sim.layers[0].fields()["W"], {m: sim.fields(m) for m in sim.muscles}))
    (_, held, _), (free, heights, fields) = frames
    paper = np.zeros(free.n_points)
    for name, muscle in papers.muscles.items():
        wrinkles, epsilon = muscle.fold_pattern.wrinkles, fields[name]["epsilon"]
        share = np.sin(0.5 * np.pi * np.clip(epsilon, 0.0, 1.0))
        rate = fw.EXPRESSIONS["paper_surprise"].get(name, 0.0)
        paper += 3.0 * wrinkles.depth * rate * muscle.fold_pattern.unit_amplitude(free["rest"]) * share
    np.testing.assert_allclose(heights, paper, rtol=0, atol=1e-9)
    assert np.ptp(heights) > 1.5 * np.ptp(held)


@pytest.mark.parametrize("name", PAPER)
def test_w_is_exactly_zero_where_no_muscle_makes_it(played, name):
    play = played(name)
    w, fields = play.top["W"], play.held.fields
    making = [m for m, rate in play.held.rates.items() if rate > 0.0]
    folded = np.zeros(len(w), bool)
    for muscle in making:
        folded |= fields[muscle]["region"] & (fields[muscle]["epsilon"] > 0.0)
    assert (w[~folded] == 0.0).all()
    assert (~folded).sum() > 1000
    assert (w[folded] != 0.0).mean() > 0.9
    stretched = np.logical_and.reduce([fields[m]["region"] & (fields[m]["epsilon"] <= 0.0) for m in making[:1]])
    if len(making) == 1:
        assert (w[stretched] == 0.0).all()


def test_the_dominant_muscle_is_that_of_the_largest_amplitude(papers, played):
    play = played("paper_fear")
    x, names = play.top["rest"], list(papers.muscles)
    contracting = [name for name in names if play.held.rates[name] > 0.0]
    assert 0 < len(contracting) < len(names)
    units = np.abs([papers.muscles[n].fold_pattern.unit_amplitude(x) for n in names])
    inside = np.array([papers.muscles[n].fold_pattern.envelope(x) > 0.0 for n in names])
    muscle = play.top["muscle"]
    idle = [name not in contracting for name in names]
    units[idle], inside[idle] = 0.0, False
    seen = seen_share(papers, play.held) > 0.0
    assert np.array_equal((muscle == -1)[seen], ~inside.any(axis=0)[seen])
    some = np.flatnonzero((muscle >= 0) & seen)
    np.testing.assert_allclose(units[muscle[some], some], units[:, some].max(axis=0), rtol=0, atol=1e-12)
    assert inside[muscle[some], some].all()
    for k, name in enumerate(names):
        mine = muscle == k
        first, second = papers.muscles[name].fold_pattern.coordinates(x[mine])
        np.testing.assert_allclose(play.top["lambda"][mine], first, atol=1e-10)
        np.testing.assert_allclose(play.top["gamma"][mine], second, atol=1e-10)
        assert np.array_equal(play.top["epsilon"][mine], play.held.fields[name]["epsilon"][mine])
    for array in ("lambda", "gamma", "epsilon"):
        assert not play.top[array][muscle == -1].any()


# --- a single muscle on a flat sheet of skin ----------------------------------------------------


def test_folds_of_every_kind_of_muscle_can_be_laid_on_a_face(face):
    """Muscles that are put on the face by hand wrinkle it, and in their regions only."""
    where = face.landmarks["malar_l"]
    up, out = np.array([0.0, 1.0, 0.0]), face.frame.axes[2]
    style, ringed = fw.Wrinkles(count=2, start=0.1, depth=1.0), fw.Wrinkles(count=2, depth=1.0)
    muscles = {
        "linear": fw.LinearMuscle(where - 25.0 * up, where + 10.0 * up, 0.5, 40.0, wrinkles=style, strength=2.0),
        "ring": fw.SphincterMuscle(
            where, 30.0, 25.0, out, face.frame.axes[0], wrinkles=ringed, inner=0.2, strength=2.0
        ),
    }
    sim = fw.Simulation(face.with_muscles(muscles), folds="paper")
    for name in muscles:
        sim.reset()
        sim.contract({name: 1.0})
        frame = list(sim.run(20))[-1]
        outside = ~muscles[name].wrinkling_region(frame["rest"])
        assert np.abs(frame["W"]).max() > 0.05
        assert not frame["W"][outside].any()


@pytest.mark.parametrize("value", ["x", None, [1], -1, np.nan, 1e300])
def test_what_is_no_number_of_use_is_refused(value):
    with pytest.raises(fw.errors.ParameterError, match="depth must"):
        MuscleWrinkles(depth=value)


# --- no net volume, and no folds behind lips and lids ----------------------------------------------


@given(st.floats(0.2, 5.0), st.integers(0, 99))
def test_heights_are_leveled_as_far_as_the_bounds_allow(ratio, seed):
    rng = np.random.default_rng(seed)
    areas = rng.uniform(0.5, 2.0, 40)
    height = np.append(rng.uniform(0.1, 0.4, 20), -rng.uniform(0.2, 1.0, 20))
    above, below = (areas * height)[:20].sum(), -(areas * height)[20:].sum()
    height[:20] *= ratio * below / above
    above = ratio * below
    shares = level_shares(height, areas)
    assert np.ptp(shares[:20]) < 1e-9
    assert np.ptp(shares[20:]) < 1e-9
    bulges, furrows = float(shares[0]), float(shares[-1])
    least, most = sorted((bulges, furrows))
    assert least >= LEVELLED - 1e-9
    assert most <= RAISED + 1e-9
    assert most <= 1.0 + 1e-9 or least == pytest.approx(LEVELLED)
    net = bulges * above - furrows * below
    if least > LEVELLED + 1e-9 or most < RAISED - 1e-9:
        assert abs(net) <= max(above, below) / STEPS
    else:
        assert net * np.sign(above - below) > -max(above, below) / STEPS  # the larger side stays so, but for a step
        assert abs(net) < abs(above - below)


def test_balanced_heights_stay():
    assert (level_shares(np.array([0.5, 0.5, -1.0, 0.0]), np.ones(4)) == 1.0).all()


def heights(face, layer):
    """Heights at the base vertices in a kiss with raised cheeks."""
    sim = fw.Simulation(face, layers=[layer])
    sim.express({"AU18": 1.0, "AU6": 1.0})
    for _ in range(3):
        frame = sim.step()
    return np.asarray(frame["W"])[: len(face.points)]


def test_folds_of_muscles_lie_on_the_skin_that_is_seen(face):
    other = head_with("sockets", "bag")
    outer, n = outer_skin(other), len(face.points)
    assert set(np.unique(outer)) == {0.0, 1.0}
    assert (outer[:n] == outer_skin(face)).mean() > 0.97
    assert outer[n:].mean() < 0.1
    for layer in (fw.MuscleWrinkles(), fw.Creases()):
        found = heights(other, layer)
        assert not found[outer == 0.0].any()
        assert np.ptp(found) > 0.1
