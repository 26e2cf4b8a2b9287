"""The oracle of the skin against failures that are made.

each kind of fault         | a skin that has it and nothing else, and one just short of it
ways                       | states of rest that explain them, and what lies beyond
the cheap tests            | the exact ones on all triangles; a naive loop over all of the arch
sequences                  | what they are to hold; the spec alone decides
"""

import copy

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from small_meshes import square

from analysis import subjects
from facewrinkle.anatomy.teeth import teeth_of
from facewrinkle.geometry import closest_rotations, vertex_rings
from tools.trials import soundness
from tools.trials.oracle import Findings, Oracle, off_the_way
from tools.trials.orientation import Normals, Orientation
from tools.trials.penetration import Ball, Samples, Sheets
from tools.trials.player import LIMITS, RECORDED, Player, area_shares
from tools.trials.sequences import RELEASED, Sequence, sequence


@pytest.fixture(scope="module")
def oracle(face):
    return Oracle(face)


def found(oracle, points):
    """The findings of a shape that nothing was checked before."""
    return copy.copy(oracle).findings(points)


# --- triangles that turn over -------------------------------------------------------------------


def shares(orientation, points, triangles):
    return orientation.shares(points, Normals(points, triangles), np.arange(len(triangles)))


def test_turning_and_scaling_turn_nothing_over(face):
    orientation = Orientation(face.points, face.triangles)
    turn = Rotation.from_rotvec([0.4, 2.0, -0.7]).as_matrix()
    moved = 2.0 * face.points @ turn.T + [5.0, 3.0, 1.0]
    np.testing.assert_allclose(shares(orientation, moved, face.triangles), 4.0)


def test_a_vertex_that_is_pulled_across_its_ring_turns_triangles_over(face, oracle):
    points, triangles = face.points.copy(), face.triangles
    chosen = triangles[np.argmax(points[triangles, 1].mean(axis=1) * (np.abs(points[triangles, 0]).max(axis=1) < 20.0))]
    i, others = chosen[0], chosen[1:]
    points[i] += 2.0 * (points[others].mean(axis=0) - points[i])
    over = oracle.orientation.turned_over(points, Normals(points, triangles))
    assert len(over)
    assert (triangles[over] == i).any(axis=1).all()
    assert found(oracle, points) == Findings(inverted=len(over))


def test_the_turn_of_a_triangle_is_that_of_two_rings_around_it(face):
    rng, points, triangles = np.random.default_rng(1), face.points, face.triangles
    moved = points + rng.normal(size=points.shape)
    got = shares(Orientation(points, triangles), moved, triangles)
    start, ring = vertex_rings(triangles, len(points))
    near = [set(ring[start[v] : start[v + 1]].tolist()) for v in range(len(points))]
    for t in rng.integers(len(triangles), size=40):
        spread = np.zeros((3, 3))
        for v in triangles[t]:
            for w in set().union(*(near[u] for u in near[v])) | near[v]:
                if w != v:
                    rest = points[w] - points[v]
                    spread += np.outer(moved[w] - moved[v], rest) / (rest @ rest)
        a, b, c = points[triangles[t]]
        p, q, r = moved[triangles[t]]
        normal, now = np.cross(b - a, c - a), np.cross(q - p, r - p)
        assert got[t] == pytest.approx(now @ closest_rotations(spread) @ normal / (normal @ normal), abs=1e-9)


def test_no_triangle_that_is_turned_over_is_passed_by(face):
    """Triangles amid hardly changed edges are ruled out: none of those may be turned over."""
    rng, points, triangles = np.random.default_rng(4), face.points, face.triangles
    orientation = Orientation(points, triangles)
    for size in (0.8, 1.2, 2.0):
        for _ in range(5):
            moved = points + size * rng.normal(size=points.shape)
            exact = np.flatnonzero(shares(orientation, moved, triangles) <= 0.0)
            assert len(exact)
            assert orientation.turned_over(moved, Normals(moved, triangles)).tolist() == exact.tolist()


# --- eyes ---------------------------------------------------------------------------------------


def outside(face, eye):
    """The vertex of the upper lid nearest to the middle of the eye."""
    top = eye.centre + eye.radius * (0.8 * eye.gaze + 0.6 * eye.up)
    return int(np.linalg.norm(face.points - top, axis=1).argmin())


@pytest.mark.parametrize("depth", [0.2, 0.05])
def test_a_vertex_in_the_eye_is_found(face, oracle, depth):
    eye, points = face.eyes[0], face.points.copy()
    i = outside(face, eye)
    points[i] = eye.centre + (eye.radius - depth) * (points[i] - eye.centre) / np.linalg.norm(points[i] - eye.centre)
    assert depth - 1e-9 < found(oracle, points).eyes < depth + 0.06  # chords beside it are deeper
    assert oracle.balls[1].depths(points).max() == 0.0


def test_a_chord_in_the_eye_is_found_although_its_ends_are_not():
    turns = np.deg2rad([0.0, 120.0, 240.0])
    corners = np.column_stack([4.0 * np.cos(turns), 4.0 * np.sin(turns), np.full(3, 12.0)])
    ball = Ball(corners, np.array([[0, 1, 2]], np.int32), np.zeros(3), 10.0)
    assert ball.depths(corners).tolist() == [0.0]
    lower = corners * [1.0, 1.0, 0.0] + [0.0, 0.0, 9.2]
    assert (np.linalg.norm(lower, axis=1) > 10.0).all()
    assert ball.depths(lower) == pytest.approx(0.8)
    touching = Ball(lower, np.array([[0, 1, 2]], np.int32), np.zeros(3), 10.0)
    assert touching.depths(lower - [0.0, 0.0, 0.1]) == pytest.approx(0.1)  # beyond rest


# --- lips and lids ------------------------------------------------------------------------------


def two_sheets():
    """Two wavy sheets 1 mm apart, that look at each other: points, triangles, and their halves."""
    plane, up = square(11)
    x, y = 11.0 * plane.T - 5.5
    sheet = np.column_stack([x, y, 0.1 * np.sin(x) * np.cos(0.7 * y)])
    points = np.concatenate([sheet, sheet + np.array([0.13, 0.21, 1.0])])
    triangles = np.concatenate([up, up[:, ::-1] + len(sheet)]).astype(np.int32)
    return points, triangles, np.arange(len(up)), np.arange(len(up)) + len(up)


def pushed_down(points, depth):
    """The upper sheet with a bump pushed down, so far that its vertex goes by `depth` beyond the one below; and it."""
    moved, i = points.copy(), 12 * 12 + 6 * 12 + 6
    near = np.exp(-((points[:, :2] - points[i, :2]) ** 2).sum(axis=1) / 4.0)
    under = cKDTree(points[:144, :2]).query(points[i, :2])[1]
    moved[144:, 2] -= ((points[i, 2] - points[under, 2] + depth) * near)[144:]
    return moved, i


@pytest.mark.parametrize("depth", [0.3, 2.0, -0.2])
def test_sheets_that_are_pushed_through_each_other_are_found(depth):
    points, triangles, below, above = two_sheets()
    sheets = Sheets(points, triangles, above, below)
    moved, i = pushed_down(points, depth)
    got, where = sheets.depth(moved, Normals(moved, triangles))
    if depth < 0.0:
        assert got == 0.0
    else:
        assert got == pytest.approx(depth, rel=0.15, abs=0.06)  # the nearest place lies aside
        assert where == i
    assert sheets.depth(points, Normals(points, triangles))[0] == 0.0


def test_what_crosses_at_rest_does_not_count():
    points, triangles, below, above = two_sheets()
    rest, _ = pushed_down(points, 0.3)
    sheets = Sheets(rest, triangles, above, below)
    assert sheets.depth(rest, Normals(rest, triangles))[0] == 0.0
    moved, _ = pushed_down(points, 1.3)
    assert sheets.depth(moved, Normals(moved, triangles))[0] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("push", [0.0, 1.0, 2.0])
def test_a_lip_that_is_pushed_through_the_other_is_found(face, oracle, push):
    points = face.points.copy()
    middle = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"])
    lower = np.unique(face.triangles[oracle.lips.lower.kept])
    lower = np.setdiff1d(lower, np.unique(face.triangles[oracle.lips.upper.kept]))
    near = np.exp(-(((points[lower] - middle) / 12.0) ** 2).sum(axis=1))
    points[lower] += push * near[:, None] * face.frame.axes[1]
    assert found(oracle, points).lips == (0.0 if push == 0.0 else pytest.approx(push, rel=0.4))


def test_a_lid_that_is_pulled_over_the_other_is_found(face, oracle):
    close = face.joint_weights["orbicularis_oculi_l"]
    points = face.points.copy()
    points[close.vertices] += close.turned(points, 0.7)
    assert found(oracle, points).lids == 0.0
    up = np.setdiff1d(*(np.unique(face.triangles[s.kept]) for s in (oracle.lids[0].upper, oracle.lids[0].lower)))
    fully = face.points.copy()
    fully[close.vertices] += close.turned(fully, 1.0)
    margin = face.eyelid_openings["l"].upper
    fully[margin] -= 1.5 * face.frame.axes[1] + 0.3 * face.frame.axes[2]
    assert set(margin.tolist()) & set(up.tolist())
    assert found(oracle, fully).lids > 0.1


# --- teeth --------------------------------------------------------------------------------------


def lip_before_a_tooth(face, oracle, jaw):
    """A vertex of the skin, and the place on the front of a middle incisor that is nearest to it."""
    crowns = next(c for c in oracle.teeth if c.jaw == jaw)
    enamel = next(arch for arch in teeth_of(face.landmarks, face.frame) if arch.jaw == jaw).points[-14 * 99 :][:99]
    tooth = enamel[(enamel @ face.frame.axes[2]).argmax()]
    skin = np.unique(crowns.samples.triangles)
    return skin[np.linalg.norm(face.points[skin] - tooth, axis=1).argmin()], tooth


def test_a_tooth_through_the_lip_is_found(face, oracle):
    i, tooth = lip_before_a_tooth(face, oracle, "upper")
    points, out = face.points.copy(), face.frame.axes[2]
    points[i] = tooth - 0.6 * out
    assert found(oracle, points).teeth == pytest.approx(0.6, abs=0.1)
    points[i] = tooth + 0.6 * out
    assert found(oracle, points).teeth < 0.1


def test_a_tooth_through_the_middle_of_a_large_triangle_is_found(face, oracle):
    """Its corners stay before the teeth."""
    arch = teeth_of(face.landmarks, face.frame)[0]
    tip = arch.points[-14 * 99 :][(arch.points[-14 * 99 :] @ face.frame.axes[2]).argmax()]
    corners = np.array([[-8.0, -6.0, -0.5], [8.0, -6.0, -0.5], [0.0, 10.0, -0.5]]) @ face.frame.axes + tip
    samples = Samples.of(corners, np.array([[0, 1, 2]]), 1.0)
    crowns = next(c for c in oracle.teeth if c.jaw == "upper")
    kept = crowns.samples, crowns.at_rest
    try:
        crowns.samples, crowns.at_rest = samples, np.zeros(len(samples.shares))
        assert 0.3 < crowns.depths(corners).max() < 0.55
        assert crowns.depths(corners + face.frame.axes[2]).max() == 0.0
    finally:
        crowns.samples, crowns.at_rest = kept


@pytest.mark.slow
def test_depths_in_teeth_are_those_of_a_naive_search(face, oracle):
    """All samples against a cloud of places on the crowns, which are nearly convex."""
    crowns = next(c for c in oracle.teeth if c.jaw == "upper")
    points = face.points - 9.0 * face.frame.axes[2]
    deep = crowns.depths(points)
    some = np.flatnonzero(deep > 0.3)[::10]
    assert len(some) > 20
    places = crowns.samples.places(points)[some]
    teeth, _ = teeth_of(face.landmarks, face.frame)
    naive = cKDTree(Samples.of(teeth.points, teeth.triangles, 0.15).places(teeth.points)).query(places)[0]
    assert (naive < deep[some] + 0.1).all()  # the nearest place may lie on a neighboring crown
    assert np.mean(naive > deep[some] - 0.1) > 0.9


def test_lower_teeth_go_with_the_jaw(face, oracle):
    i, tooth = lip_before_a_tooth(face, oracle, "lower")
    points, jaw = face.points.copy(), face.muscles["jaw"]
    points[i] = tooth - 0.6 * face.frame.axes[2]
    rest = oracle.depths_in_teeth(points)[1].max()
    assert rest == pytest.approx(0.6, abs=0.1)
    opened = Rotation.from_rotvec(0.2 * jaw.axis).apply(points - jaw.hinge) + jaw.hinge
    assert oracle.depths_in_teeth(opened)[1].max() == pytest.approx(rest)
    opened[i] = points[i]  # where the tooth was
    assert oracle.depths_in_teeth(opened)[1].max() == 0.0


# --- ways and energy ----------------------------------------------------------------------------


def test_what_goes_too_far_is_found_and_arcs_are_not():
    t = np.linspace(0.0, 1.0, 21)[:, None]
    turn = 0.35 * (1.0 - t[:, 0])
    arc = 90.0 * np.stack([np.zeros_like(turn), -np.sin(turn), np.cos(turn) - 1.0], axis=1)  # a jaw that closes
    straight = np.zeros((21, 3))
    straight[:, 1] = -30.0 * (1.0 - t[:, 0])
    uneven = np.column_stack([5.0 * 0.5 ** (40 * t[:, 0]), 5.0 * 0.5 ** (4 * t[:, 0]), np.zeros(21)])
    far = straight + np.column_stack([np.zeros((21, 2)), 27.0 * np.sin(np.pi * t)])
    beyond = straight + np.column_stack([np.zeros(21), 12.0 * np.exp(-(((t[:, 0] - 0.9) / 0.05) ** 2)), np.zeros(21)])
    for path in (arc, straight, uneven):
        assert not off_the_way(path[:, None])[:, 0].any()
    for path in (far, beyond):
        assert off_the_way(np.stack([straight, path], axis=1))[:, 0].max() > 1.0
        assert off_the_way(np.stack([straight, path], axis=1))[:, 1].max() == 1


def test_what_states_of_rest_explain_is_not_off_the_way_and_what_lies_beyond_is():
    rest, asked = np.array([[0.0, 6.0, 0.0]]), []

    def resting(frame):
        asked.append(frame)
        return rest

    path = np.zeros((6, 1, 3))
    path[1:, 0, 1] = [0.4, 4.0, 7.5, 9.0, 0.0]  # to the state of rest, beyond it, and back
    np.testing.assert_allclose(off_the_way(path)[:, 0], [0.0, 3.5, 7.0, 8.5, 0.0])
    np.testing.assert_allclose(off_the_way(path, None, resting)[:, 0], [0.0, 0.0, 0.0, 9.0 - 7.7, 0.0])
    assert asked == [1, 3]  # where no earlier one explains it


def test_a_state_of_rest_that_is_not_known_explains_nothing():
    path = np.zeros((4, 1, 3))
    path[1:, 0, 1] = [4.0, 9.0, 0.0]
    rest = {0: np.array([[0.0, 6.0, 0.0]]), 1: None}
    np.testing.assert_array_equal(off_the_way(path, None, rest.get)[:, 0], [0.0, 9.0 - 7.7, 0.0])
    np.testing.assert_array_equal(off_the_way(path, None, lambda frame: None), off_the_way(path))


def test_skin_settles_where_it_comes_to_rest_by_itself(face):
    player = Player(face)
    rates = np.array([0.7 * (name in ("zygomaticus_major_l", "jaw")) for name in face.muscles])
    settled = player.settled(rates)
    assert np.abs(settled).max() > 5.0
    player.settling.displacement = 2.0 * settled
    np.testing.assert_array_equal(player.settled(rates), settled)  # nothing of what was before is left
    player.skin.set_rates(rates)
    for _ in range(60):
        player.skin.step()
    np.testing.assert_allclose(player.skin.displacement, settled, rtol=0.0, atol=0.005)


class Made:
    """A skin that moves as it is told: displacements and energies, frame by frame."""

    def __init__(self, face, shapes, energies=None):
        self.rates, self._rest = np.zeros(len(face.muscles)), face.points
        self._shapes, self._energies = shapes, energies
        self.reset()

    def reset(self):
        self._frame, self.displacement = -1, np.zeros_like(self._rest)

    def set_rates(self, rates):
        self.rates = rates

    def step(self):
        self._frame += 1
        self.displacement = self._shapes[self._frame]
        return self._rest + self.displacement

    def energy(self):
        return 0.0 if self._energies is None else self._energies[self._frame]


def held(face, frames, released=False):
    return Sequence(np.zeros((frames, len(face.muscles))), (0,), released)


def test_energy_that_is_gained_at_held_rates_is_found(face):
    still = [np.zeros_like(face.points)] * 5
    trial = Player(face, Made(face, still, [-4.0, -5.0, -5.0 + 1e-10, -5.0 + 1e-10, -6.0])).play(held(face, 5))
    assert trial.failed()["energy"] == 1
    assert trial.worst()["energy"] == (pytest.approx(2e-11, rel=1e-4), 2)
    rates = held(face, 5)
    rates.rates[2:] = 1.0  # the landscape changes as muscles contract
    assert Player(face, Made(face, still, [-4.0, -5.0, 7.0, 7.0, 6.0])).play(rates).failed()["energy"] == 0


def test_a_release_that_does_not_end_at_rest_is_found(face):
    off = np.zeros_like(face.points)
    off[7, 1] = 1e-18
    for last, expected in ((off, 1), (np.zeros_like(off), 0)):
        trial = Player(face, Made(face, [off] * 7 + [last])).play(held(face, 8, released=True))
        assert trial.failed()["not at rest"] == expected
        assert sum(trial.failed().values()) == expected


def test_a_skin_that_is_not_finite_ends_the_sequence(face):
    broken = np.zeros_like(face.points)
    broken[3, 0] = np.nan
    trial = Player(face, Made(face, [np.zeros_like(broken), broken, broken])).play(held(face, 3))
    assert len(trial.largest) == 2
    assert {kind: count for kind, count in trial.failed().items() if count} == {"not finite": 1}


def test_a_transition_that_shoots_too_far_is_found_in_its_frame(face):
    shapes = [np.zeros_like(face.points) for _ in range(6)]
    for shape, z in zip(shapes, (1.0, 3.0, 4.9, 4.0, 4.0, 4.0), strict=True):
        shape[:, 1] = z
    trial = Player(face, Made(face, shapes)).play(held(face, 6))
    assert trial.failed()["off the way"] == 0
    shapes[2][50, 1] = 8.0
    trial = Player(face, Made(face, shapes)).play(held(face, 6))
    assert np.flatnonzero(trial.values["off the way"]).tolist() == [2]
    np.testing.assert_array_equal(trial.values["off the way to the end"], trial.values["off the way"])


class Hanging(Made):
    """A skin with two states of rest: where it hangs once it was farther out than 10 mm, and where rates lead, 5 mm.

    It may also never settle.
    """

    def __init__(self, face, restless=False):
        self.restless, self.steps = restless, 0
        super().__init__(face, [])

    def cleared(self, displacement):
        self.displacement = displacement.copy()
        return displacement

    def step(self):
        y = np.where(self.displacement[:, 1] > 10.0, self.displacement[:, 1], 5.0 * self.rates.max())
        self.displacement = np.column_stack([0.0 * y, y, 0.0 * y])
        self.steps += 1
        self.displacement[:, 2] = 0.01 * (-1) ** self.steps * self.restless
        return self._rest + self.displacement


@pytest.mark.parametrize("restless", [False, True])
def test_skin_that_hangs_where_no_rest_leads_is_not_its_own_excuse(face, restless):
    """A ramp to 2 mm, over rates at which skin rests 5 mm out: one vertex hangs 27 mm out while these are held."""
    rates, shapes = held(face, 6), [np.zeros_like(face.points) for _ in range(6)]
    rates.rates[:] = np.array([0.5, 1.0, 1.0, 1.0, 0.4, 0.4])[:, None]
    for shape, y in zip(shapes, (2.5, 5.0, 5.0, 5.0, 2.0, 2.0), strict=True):
        shape[:, 1] = y
    for shape in shapes[2:4]:
        shape[50, 1] = 27.0
    player = Player(face, Made(face, shapes))
    player.settling = Hanging(face, restless)
    trial = player.play(rates)
    to_the_end = [0.0, 5.0 - 2.9, 27.0 - 2.9, 27.0 - 2.9, 0.0, 0.0]
    judged = to_the_end if restless else [0.0, 0.0, 27.0 - 6.5, 27.0 - 6.5, 0.0, 0.0]
    np.testing.assert_allclose(trial.values["off the way to the end"], to_the_end, atol=1e-12)
    np.testing.assert_allclose(trial.values["off the way"], judged, atol=0.01)
    assert trial.failed()["off the way"] == (3 if restless else 2)
    assert trial.recorded() == {"off the way to the end": 3}


def test_refined_triangles_that_wrinkles_turn_over_are_counted():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [0, 0, 1]])
    moved = corners.copy()
    moved[3] = [0.2, 0.2, 0.1]
    np.testing.assert_allclose(area_shares(corners, moved, triangles), [1.0, -0.6, 1.0])


# --- sequences and runs -------------------------------------------------------------------------


def test_sequences_hold_all_that_is_asked_of_them(face):
    played = [sequence(face, 0, "head-0", index) for index in range(120)]
    for one in played:
        assert 0.0 <= one.rates.min() <= one.rates.max() <= 1.0
        assert list(one.starts) == sorted(set(one.starts))
        changes = np.flatnonzero((np.diff(one.rates, axis=0, prepend=0.0) != 0.0).any(axis=1))
        assert set(changes.tolist()) <= {f for part in one.transitions() for f in range(part.start, part.stop)}
        if one.released:
            assert not one.rates[-RELEASED:].any()
    steps = np.concatenate([np.diff(one.rates, axis=0) for one in played])
    assert (steps[:, list(face.muscles).index("jaw")] == -1.0).any()  # shuts in one step
    assert ((steps == 1.0).sum(axis=1) >= 20).any()
    assert any((one.rates == 1.0).all(axis=1).any() for one in played)
    assert any(((one.rates == 1.0).sum(axis=1) == 20).any() for one in played)
    assert {one.released for one in played} == {True, False}
    assert 100.0 < np.mean([len(one.rates) for one in played]) < 300.0


@pytest.mark.slow
def test_people_differ_by_name_and_seed():
    asked = (("head-1", 0), ("head-1", 0), ("head-2", 0), ("head-1", 1))
    one, again, other, seeded = (subjects.subject(*which).points for which in asked)
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)
    assert not np.array_equal(one, seeded)


def test_captured_persons_have_the_eyes_that_come_with_them():
    if "ict-1" not in subjects.names():
        pytest.skip("no captured persons beside the repository")
    mean, person = (subjects.subject(f"ict-{k}") for k in (0, 1))
    assert len(mean.points) == len(person.points)
    for one, other in zip(mean.eyes, person.eyes, strict=True):
        assert 0.05 < np.linalg.norm(one.centre - other.centre) < 1.0  # cm


def record(name, index):
    """The record of a sequence: number 1 has lips too deep, number 0 is off the way to the end."""
    worst = dict.fromkeys((*LIMITS, *RECORDED), (0.0, 0))
    worst |= {"lips": (0.5, 3)} if index else {RECORDED[0]: (0.25, 2)}
    return {"face": name, "index": index, "frames": 50, "simulated": False, "failed": {"lips": 7} if index else {},
            "recorded": {} if index else {RECORDED[0]: 4}, "worst": worst, "seconds": 1.0}  # fmt: skip


def test_the_report_tells_what_failed_and_where():
    made = soundness.report([record(name, index) for index in range(2) for name in "ab"])
    faults, worst, beside = made.tables
    lips = faults.columns.index("lips")
    assert [row[0] for row in faults.rows] == ["a", "b", "all"]
    assert [row[lips] for row in faults.rows] == [7, 7, 14]
    assert sum(sum(row[3:]) for row in faults.rows) == 28
    assert worst.rows == [("lips", 2, 14, 0.5, "a", 1, 3)]
    assert beside.rows == [("off the way to the end", 2, 8, 0.25, "a", 0, 2)]
    assert made.numbers == {"sequences": 4, "sound": 2, "frames": 200, "seconds": 4.0}


def test_a_sequence_plays_the_same_after_another_one(face):
    one, fresh = Player(face), Player(face)
    short = Sequence(sequence(face, 0, "head-0", 2).rates[:12], (0,), False)
    one.play(Sequence(np.ones((3, len(face.muscles))), (0,), False))
    assert one.play(short).worst() == fresh.play(short).worst()


def test_a_replay_prints_every_frame(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(soundness, "sequence", lambda face, *_: Sequence(np.zeros((3, len(face.muscles))), (), False))
    soundness.soundness(replay=("head-0", 5), out=tmp_path)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "head-0, sequence 5 of seed 0"
    assert [line.split()[0] for line in lines[2:]] == ["0", "1", "2"]
    with pytest.raises(SystemExit, match="No face is named so"):
        soundness.soundness(faces=["nobody"], out=tmp_path)
