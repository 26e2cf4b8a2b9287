"""Long hair, cropped hair and beards: where they grow and hang, how long, and what becomes of them in a person."""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.identity import Identity, hair_cover, head_of
from facewrinkle.appearance.seen import own_parts
from facewrinkle.dataset.labels import PARTS
from facewrinkle.dataset.sample import SampleMaker
from facewrinkle.dataset.spec import Spec
from facewrinkle.export.meshes import part_models

PEOPLE = [
    {"sex": -0.9},
    *(
        pytest.param(person, marks=pytest.mark.slow)
        for person in (
            {"child": 0.9, "age": -0.9},
            {"width": 1.0, "length": -1.0},
            {"width": -1.0, "length": 1.0, "jaw": 1.0, "cheeks": 1.0, "brow": 1.0},
        )
    ),
]


@pytest.fixture(scope="module", params=PEOPLE, ids=lambda person: "-".join(person))
def grown(request):
    """Faces of one person, with hair of several lengths."""
    return {length: fw.default_face(request.param | {"hair_length": length}) for length in (0.1, 0.5, 1.0)}


def hair_of(face) -> pv.PolyData:
    return face.parts["hair"].mesh


def hidden(face, points, direction) -> np.ndarray:
    """True for points (n, 3) that hair hides from a direction."""
    hair, far = hair_of(face), 300.0 * np.array(direction)
    return np.array([len(hair.ray_trace(point, point + far)[0]) > 0 for point in points])


def test_no_hair_is_inside_the_head(grown):
    for face in grown.values():
        placed = pv.PolyData(np.asarray(hair_of(face).points)).compute_implicit_distance(face.mesh)
        assert np.asarray(placed["implicit_distance"]).min() > 0.5


@pytest.mark.parametrize("combed", [-0.3, 0.5])
def test_hair_faces_away_from_the_head(combed):
    """As programs have it that draw the front of triangles only; single hairs may turn."""
    face = fw.default_face({"sex": -0.6, "hair_length": 0.4, "hair_combed": combed})
    hair = hair_of(face).compute_normals(point_normals=False, auto_orient_normals=False, consistent_normals=False)
    middles = np.asarray(hair.cell_centers().points)
    _, nearest = face.mesh.find_closest_cell(middles, return_closest_point=True)
    away = middles - nearest
    near = (np.linalg.norm(away, axis=1) < 15.0) & (middles[:, 2] > face.points[:, 2].min() + 30.0)  # not of the knot
    assert near.sum() > 5000
    assert ((away * hair.cell_data["Normals"]).sum(axis=1)[near] > 0.0).mean() > 0.95


def test_the_longest_covers_the_ears(grown):
    face = grown[1.0]
    x, y, z = face.points.T
    zygion = face.landmarks["zygion_l"]
    ear = (abs(x) > 1.03 * zygion[0]) & (abs(y - zygion[1]) < 30.0) & (z < zygion[2] - 15.0)
    assert ear.sum() > 100
    for sign in (1.0, -1.0):
        assert hidden(face, face.points[ear & (sign * x > 0.0)], [sign, 0.0, 0.0]).all()


@pytest.mark.parametrize("combed", [0.0, -0.9])
@pytest.mark.parametrize("person", [{"child": 0.9}, {"width": 1.0, "length": -1.0}, {"width": -1.0, "length": 1.0}])
def test_it_comes_out_of_the_scalp_from_the_hairline_on(person, combed):
    """Also where it is parted, however far aside. Locks, up to 3 mm wide at their roots, may begin over others."""
    face = fw.default_face(person | {"hair_length": 0.7, "hair_combed": combed})
    hair = hair_of(face)
    ends = pv.PolyData(np.asarray(hair.points)[hair.point_data["strand_at"][:, 1] == 0.0])
    roots = ends.points[ends.compute_implicit_distance(face.mesh)["implicit_distance"] < 2.5]
    assert len(roots) > 150
    assert -2.0 < hair_cover(roots, face.landmarks, face.frame).min() < 5.0


@pytest.mark.parametrize("person", [{"child": 0.9}, {"width": 1.0, "length": -1.0}, {"width": -1.0, "length": 1.0}])
def test_no_skin_is_seen_in_its_parting(person):
    """From above, although pictures leave out up to 0.07 of hairs at their roots."""
    hair = hair_of(fw.default_face(person | {"hair_length": 0.7}))
    hair.point_data["along"] = hair.point_data["strand_at"][:, 1]
    drawn = hair.clip_scalar(scalars="along", invert=False, value=0.07)
    places = [(x, z) for z in np.arange(0.0, 70.0, 3.0) for x in np.arange(-30.0, 40.0, 0.5)]
    seen = [len(drawn.ray_trace([x, 300.0, z], [x, 0.0, z])[0]) == 0 for x, z in places]
    assert not any(seen)


def test_it_hangs_beside_the_face(grown):
    names = (
        "eye_l_inner",
        "eye_l_outer",
        "brow_l_inner",
        "brow_l_mid",
        "mouth_l",
        "nose_tip",
        "forehead_mid",
        "malar_l",
    )
    for face in grown.values():
        sides = [name.replace("_l", side) for name in names for side in ("_l", "_r")]
        assert not hidden(face, [face.landmarks[name] for name in sides], [0.0, 0.0, 1.0]).any()


@pytest.mark.parametrize(
    "person",
    [{"hair_density": -0.9}, pytest.param({"hair_density": 0.9, "width": 0.5, "length": -0.5}, marks=pytest.mark.slow)],
)
def test_a_fringe_hides_the_more_of_the_forehead_the_more_it_is_combed_there_and_no_eye(person):
    covered = []
    for combed in (0.0, -0.5, -1.0):
        face = fw.default_face(person | {"hair_length": 0.5, "hair_combed": combed})
        points, marks = face.points, face.landmarks
        inside = hair_cover(points, marks, face.frame)
        forehead = (points[:, 1] > marks["brow_l_mid"][1] + 10.0) & (inside < -3.0) & (points[:, 2] > 60.0)
        covered.append(hidden(face, points[forehead], [0.0, 0.0, 1.0]).mean())
        seen = [marks[name] for name in ("eye_l_centre", "eye_r_centre", "eye_l_inner", "eye_r_inner", "mouth_r")]
        assert not hidden(face, seen, [0.0, 0.0, 1.0]).any()
        placed = pv.PolyData(np.asarray(hair_of(face).points)).compute_implicit_distance(face.mesh)
        assert np.asarray(placed["implicit_distance"]).min() > 0.5
    assert covered[0] < covered[1] - 0.05 < covered[2] - 0.15


def test_fine_short_hairs_grow_along_the_hairline(grown):
    for face in grown.values():
        pieces = [np.asarray(piece.points) for piece in hair_of(face).split_bodies()]
        short = [points for points in pieces if np.linalg.norm(np.ptp(points, axis=0)) < 20.0]
        assert len(short) > 50
        roots = [points[0] for points in short]
        inside = hair_cover(np.array(roots), face.landmarks, face.frame)
        assert -2.0 < inside.min() < 0.0
        assert inside.max() < 8.0


def test_its_normals_point_away_from_the_head_also_where_locks_twist(grown):
    """Lest their backs, which are dark, are seen; wherever the head has moved it to."""
    for face in grown.values():
        hair = own_parts(face, face.mesh)["hair"]
        places = np.asarray(hair.points)
        _, nearest = face.mesh.find_closest_cell(places, return_closest_point=True)
        away = places - nearest
        near = np.linalg.norm(away, axis=1) < 12.0
        assert near.sum() > 4000
        assert ((away * hair.point_data["Normals"]).sum(axis=1)[near] > 0.0).mean() > 0.99


def test_its_front_is_its_outer_side(grown):
    hair, middle = hair_of(grown[1.0]), 0.5 * sum(eye.centre for eye in grown[1.0].eyes) - [0.0, 0.0, 80.0]
    a, b, c = (np.asarray(hair.points)[corners] for corners in hair.regular_faces.T)
    area = np.cross(b - a, c - a)
    outwards = (area * (a - middle)).sum(axis=1) > 0.0
    assert np.linalg.norm(area[outwards], axis=1).sum() > 0.95 * np.linalg.norm(area, axis=1).sum()


def test_longer_hair_hangs_lower(grown):
    lowest = [hair_of(grown[length]).bounds[2] for length in sorted(grown)]
    assert lowest[0] > lowest[1] + 15.0 > lowest[2] + 30.0


def test_strands_run_from_roots_to_tips_of_locks_that_are_their_own(grown):
    strand, along = hair_of(grown[0.5]).point_data["strand_at"].T
    assert along.min() == 0.0
    assert along.max() == 1.0
    hair = hair_of(grown[0.5])
    assert np.ptp(strand[hair.regular_faces], axis=1).max() < 40.0


def test_hairs_point_from_roots_to_tips_however_the_head_is_turned(grown):
    face = grown[0.5]
    hair = face.parts_at(face.mesh.rotate_vector((1.0, 2.0, 0.5), 50.0))["hair"]
    edges = hair.regular_faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    strand, share = hair.point_data["strand_at"][edges].transpose(2, 1, 0)
    down = edges[(strand[0] == strand[1]) & (share[0] < share[1])]
    ways = np.diff(np.asarray(hair.points)[down], axis=1)[:, 0]
    along = hair.point_data["strand_along"][down].mean(axis=1)
    cosines = (ways * along).sum(axis=1) / np.linalg.norm(ways, axis=1)
    assert len(down) > 5000
    assert np.percentile(cosines, 1) > 0.9


def test_it_is_closer_to_the_neck_than_to_the_ears(grown):
    marks, hair = grown[1.0].landmarks, np.asarray(hair_of(grown[1.0]).points)
    ears, chin = (np.ptp(hair[abs(hair[:, 1] - marks[name][1]) < 8.0, 0]) for name in ("zygion_l", "menton"))
    assert chin < 0.91 * ears


def test_its_front_edge_is_not_smooth():
    """It falls in tresses that part."""
    face = fw.default_face({"sex": -0.9, "hair_length": 0.3, "hair_combed": -0.5})
    heights = np.arange(face.landmarks["mouth_l"][1], face.landmarks["brow_l_mid"][1], 2.0)
    uneven = []
    for sign in (1.0, -1.0):
        side = hair_of(face).points[sign * hair_of(face).points[:, 0] > 40.0]
        edge = [side[abs(side[:, 1] - height) < 3.0, 2].max() for height in heights]
        uneven.append(np.std(edge - np.polyval(np.polyfit(heights, edge, 3), heights)))
    assert max(uneven) > 3.2


def test_the_same_person_has_the_same_hair():
    first, second = (hair_of(fw.default_face({"hair_length": 0.7, "hair": 0.4})) for _ in range(2))
    assert np.asarray(first.points).tobytes() == np.asarray(second.points).tobytes()
    assert first.point_data["Colors"].tobytes() == second.point_data["Colors"].tobytes()


@pytest.mark.parametrize("length", [0.0, -1.0])
def test_cropped_hair_is_no_part(face, length):
    cropped = fw.default_face({"hair_length": length})
    assert not cropped.parts
    assert (cropped.points == face.points).all()
    skin = hair_cover(face.points, face.landmarks, face.frame) < -15.0
    assert (cropped.mesh.point_data["Colors"] == face.mesh.point_data["Colors"])[skin].all()


@pytest.mark.slow
def test_the_shorter_the_hair_the_more_of_the_scalp_is_seen(face):
    crown = hair_cover(face.points, face.landmarks, face.frame) > 30.0
    bright = [
        fw.default_face({"hair_length": length}).mesh.point_data["Colors"][crown].mean() for length in (0.0, -0.5, -1.0)
    ]
    assert bright[0] * 1.2 < bright[1] < bright[2] / 1.2


def test_the_rounder_a_face_the_farther_aside_is_the_parting():
    partings = [parting_of(fw.default_face({"hair_length": 0.7, "width": w, "length": -w})) for w in (-0.5, 0.0, 0.5)]
    assert partings[0] < partings[1] - 10.0 < partings[2] - 20.0


def parting_of(face) -> float:
    """How far to the left the darkest hairs above the forehead are, mm: roots are dark."""
    hair, hairline = hair_of(face), face.landmarks["trichion"]
    points, brightness = np.asarray(hair.points), hair.point_data["Colors"].sum(axis=1)
    front = (points[:, 1] > hairline[1] - 5.0) & (points[:, 2] > hairline[2] - 30.0)
    return float(np.median(points[front & (brightness < np.quantile(brightness[front], 0.08)), 0]))


def test_dense_hair_is_fuller_and_waves():
    fine, dense = (hair_of(fw.default_face({"hair_length": 0.7, "hair_density": d})) for d in (-0.9, 0.9))
    assert dense.bounds[1] > fine.bounds[1] + 3.0
    assert roughness(dense) > 1.5 * roughness(fine)


def roughness(hair) -> float:
    """Spread of how far hair at the side faces up or down."""
    hair = hair.compute_normals(split_vertices=False)
    x, y, z = np.asarray(hair.points).T
    side = (x > 0.8 * hair.bounds[1]) & (abs(y) < 60.0) & (abs(z) < 40.0)
    return float(np.asarray(hair.point_data["Normals"])[side, 1].std())


def test_it_has_the_color_of_the_person():
    means = [
        hair_of(fw.default_face({"hair_length": 1.0, "hair": hair})).point_data["Colors"].mean() for hair in (-1, 0, 1)
    ]
    assert means[0] > 1.5 * means[1] > 2.0 * means[2]


def test_women_have_longer_hair_than_men():
    people = [Identity.random(seed) for seed in range(300)]
    women, men = ([p.hair_length > 0.3 for p in people if sign * p.sex > 0.3] for sign in (-1.0, 1.0))
    assert 0.5 < np.mean(women) < 0.9
    assert not any(men)


# --- long hair that is tied back -------------------------------------------------------------------


@pytest.fixture(
    scope="module",
    params=[(0.2, 0.1), (1.0, 0.8), *(pytest.param(each, marks=pytest.mark.slow) for each in ((0.3, 0.9), (0.9, 0.2)))],
    ids=str,
)
def tied(request):
    """A face whose hair is tied in a knot or a tail, low or high."""
    length, combed = request.param
    return fw.default_face({"sex": -0.9, "hair_length": length, "hair_combed": combed})


def test_tied_hair_bares_face_and_ears(tied):
    points, marks = tied.points, tied.landmarks
    inside = hair_cover(points, marks, tied.frame)
    ahead = (points[:, 2] > marks["zygion_l"][2]) & (points[:, 1] > marks["menton"][1]) & (inside < -3.0)
    assert ahead.sum() > 500
    assert not hidden(tied, points[ahead], [0.0, 0.0, 1.0]).any()
    ear = (abs(points[:, 0]) > marks["zygion_l"][0] + 6.0) & (abs(points[:, 1] - marks["zygion_l"][1]) < 15.0)
    assert ear.sum() > 30
    assert not hidden(tied, points[ear], [0.0, 0.0, 1.0]).any()


def test_tied_hair_covers_the_scalp_to_its_border_of_short_hairs(tied):
    points = tied.points
    inside = hair_cover(points, tied.landmarks, tied.frame)
    covered = hidden(tied, points[inside > 30.0], [0.0, 1.0, 0.0]) | hidden(
        tied, points[inside > 30.0], [0.0, 0.0, -1.0]
    )
    assert covered.mean() > 0.97
    roots = hairs_of(tied)[:, 0]
    short = hair_cover(roots, tied.landmarks, tied.frame)
    assert -8.0 < short.min() < 3.0
    assert 25.0 < short.max() < 40.0


@pytest.mark.parametrize(
    "person",
    [
        {},
        {"width": 1.0, "length": -1.0},
        *(pytest.param(person, marks=pytest.mark.slow) for person in ({"child": 0.9, "age": -0.9}, {"ears": 1.0})),
    ],
)
def test_tied_hair_is_outside_the_head(person):
    for length, combed in ((0.3, 0.5), (0.9, 0.3)):
        face = fw.default_face(person | {"hair_length": length, "hair_combed": combed})
        placed = pv.PolyData(np.asarray(hair_of(face).points)).compute_implicit_distance(face.mesh)
        assert np.asarray(placed["implicit_distance"]).min() > 0.2


def test_a_tail_hangs_down_and_a_knot_does_not():
    knot, tail = (fw.default_face({"hair_length": length, "hair_combed": 0.5}) for length in (0.3, 0.9))
    assert hair_of(tail).bounds[2] < tail.landmarks["menton"][1] < hair_of(knot).bounds[2] - 20.0


@pytest.mark.slow
def test_the_more_combed_back_the_higher_the_knot():
    knots = [fw.default_face({"hair_length": 0.3, "hair_combed": combed}) for combed in (0.1, 0.5, 0.9)]
    low, middle, high = (np.asarray(hair_of(knot).points) for knot in knots)
    assert low[low[:, 2].argmin(), 1] < middle[middle[:, 2].argmin(), 1] - 15.0
    assert middle[:, 1].max() < high[:, 1].max() - 10.0


def test_people_wear_hair_in_different_ways():
    women = [p for p in map(Identity.random, range(300)) if p.hair_length > 0.0]
    assert 0.35 < np.mean([p.hair_combed > 0.0 for p in women]) < 0.65


# --- hair in files and data sets ---------------------------------------------------------------------


def test_files_have_it(grown):
    face = grown[1.0]
    model = part_models(face, face.mesh)["hair"]
    assert len(model.points) == hair_of(face).n_points
    assert np.ptp(model.colors, axis=0).min() > 20


@pytest.mark.slow
def test_data_sets_label_it_and_what_it_hides():
    woman = {
        "identity": {"hair_length": 1.0, "sex": -0.9, "child": 0.0},
        "camera": {"yaw": 60.0, "roll": 0.0, "height": 5.0},
    }
    with SampleMaker(Spec.of({"size": [96, 96], "quick": True, "tears": {"share": 0.0}} | woman)) as maker:
        sample = maker.sample(0)
    part, marks = sample.labels["part"], sample.facts["landmarks"]
    under = part == PARTS.index("hair")
    assert under.mean() > 0.1
    x, y = np.floor(marks["gonion_l"]["pixel"]).astype(int)
    assert marks["gonion_l"]["visible"] == (not under[y, x])
    assert marks["malar_l"]["visible"]


# --- cropped hair ----------------------------------------------------------------------------------


def hairs_of(face):
    """Points of the hairs of a face at rest."""
    return face.bound_hair["cropped_hair"].polylines(face.points, face.triangles, face.normals)


def reach(hairs):
    return np.linalg.norm(hairs[:, -1] - hairs[:, 0], axis=1)


def test_cropped_hair_grows_inside_the_hairline_alone(face):
    roots = hairs_of(face)[:, 0]
    inside = hair_cover(roots, face.landmarks, face.frame)
    assert len(roots) > 4000
    assert inside.min() > -8.0
    assert (inside > 0.0).mean() > 0.97


def test_tips_of_cropped_hair_stand_off_the_skin(face):
    tips = hairs_of(face)[:, -1]
    away = np.asarray(pv.PolyData(tips).compute_implicit_distance(face.mesh).point_data["implicit_distance"])
    assert (away > 0.3).mean() > 0.97
    assert away.max() < 10.0


def test_cropped_hair_points_away_from_the_crown(face):
    """Forward over the forehead, down at the nape."""
    hairs = hairs_of(face)
    roots, way = hairs[:, 0], hairs[:, -1] - hairs[:, 0]
    front, nape = roots[:, 2] > 60.0, roots[:, 1] < 20.0
    assert way[front, 2].mean() > 2.0
    assert way[nape, 1].mean() < -1.0


def test_cropped_hair_is_shorter_where_it_is_thin(face):
    """Along its border."""
    hairs = hairs_of(face)
    inside = hair_cover(hairs[:, 0], face.landmarks, face.frame)
    assert np.median(reach(hairs[inside < 6.0])) < 0.7 * np.median(reach(hairs[inside > 20.0]))


@pytest.mark.parametrize("combed, way", [(-0.8, 0), (0.8, 2)])
def test_combed_hair_is_longer_on_top_and_lies_aside_or_back(face, combed, way):
    hairs = hairs_of(fw.default_face({"hair_combed": combed}))
    top, low = hairs[:, 0, 1] > 125.0, hairs[:, 0, 1] < 20.0
    assert np.median(reach(hairs[top])) > 1.8 * np.median(reach(hairs_of(face)))
    assert np.median(reach(hairs[low])) < 1.1 * np.median(reach(hairs_of(face)))
    towards = hairs[top, -1] - hairs[top, 0]
    side = np.sign(hairs[top, 0, 0] - 22.0) if way == 0 else -1.0  # from a parting on the left; backwards
    assert np.mean(towards[:, way] * side > 0.0) > 0.95


@pytest.mark.parametrize("combed", [-0.8, 0.8])
def test_thin_hair_is_combed_less(face, combed):
    usual, *thinner = (fw.default_face({"hair_combed": combed, "hair_density": d}) for d in (0.0, -0.5, -0.9))
    on_top = [np.median(reach(hairs)[hairs[:, 0, 1] > 125.0]) for hairs in map(hairs_of, (face, *thinner[::-1], usual))]
    assert (np.diff(on_top) > 2.0).all()


def test_thin_hair_is_as_thin_everywhere():
    usual, *thin = (head_of(Identity(hair_density=d)).paint[1].cover() for d in (0.0, -0.4, -0.9, -1.0))
    shares = [cover[usual > 0.0] / usual[usual > 0.0] for cover in thin]
    np.testing.assert_allclose(shares, np.array([[s.mean()] for s in shares]) + np.zeros_like(shares), atol=1e-12)
    assert 1.0 > shares[0][0] > shares[1][0] > shares[2][0] == 0.0


def test_cropped_hair_of_people_has_its_own_length_color_and_hairline(face):
    others = {"hair_length": -1.0}, {"hair": -1.0}, {"age": 1.0, "sex": 1.0}, {"sex": -1.0}
    short, fair, old, woman = map(fw.default_face, others)
    assert np.median(reach(hairs_of(short))) == pytest.approx(7.0 / 16.0 * np.median(reach(hairs_of(face))), rel=0.02)
    assert np.median(reach(hairs_of(woman))) > 1.8 * np.median(reach(hairs_of(face)))
    colors = [head.bound_hair["cropped_hair"].color.mean() for head in (fair, face)]
    assert colors[0] > 1.5 * colors[1]
    assert hairs_of(old)[:, 0, 2].max() < hairs_of(face)[:, 0, 2].max() - 3.0
    assert fw.default_face({"hair_density": -1.0}).bound_hair.keys() == {"brows"}
    assert fw.default_face({"hair_length": 0.5}).bound_hair.keys() == {"brows"}


# --- beards ----------------------------------------------------------------------------------------


def beard_of(face):
    """Points of the hairs of the beard of a face at rest."""
    return face.bound_hair["beard"].polylines(face.points, face.triangles, face.normals)


@pytest.mark.parametrize("identity", [{}, {"sex": 0.9, "lips": 0.9, "mouth": 0.9}, {"philtrum": -1.0, "lips": -1.0}])
def test_beards_grow_around_the_mouth_but_not_on_lips_and_cheeks(identity):
    face = fw.default_face(identity | {"beard": 0.6})
    roots, marks = beard_of(face)[:, 0], face.landmarks
    assert roots[:, 1].max() < marks["eye_l_centre"][1]
    assert np.percentile(roots[:, 2], 1) > marks["gonion_l"][2] - 20.0
    middle = np.abs(roots[:, 0]) < 0.5 * marks["mouth_l"][0]
    lips = (roots[:, 1] < marks["upper_lip_mid"][1] - 1.0) & (roots[:, 1] > marks["lower_lip_mid"][1] + 1.0)
    assert not (middle & lips).any()
    moustache = (roots[:, 1] > marks["upper_lip_mid"][1]) & (roots[:, 1] < marks["subnasale"][1])
    assert (middle & moustache).sum() > 50


@pytest.mark.parametrize("seed", [23, 31, 32, 37])
def test_moustaches_are_nearly_as_dense_as_the_beard_on_the_chin(seed):
    face = fw.default_face(fw.Identity.random(seed))
    marks, roots = {name: face.frame.local_mm(point) for name, point in face.landmarks.items()}, beard_of(face)[:, 0]
    x, y, _ = face.frame.local_mm(roots).T
    spans = (marks["upper_lip_mid"], marks["subnasale"]), (marks["menton"], marks["lower_lip_mid"])
    upper, chin = (
        ((np.abs(x) < 12.0) & (y > below[1]) & (y < above[1])).sum() / (above[1] - below[1]) for below, above in spans
    )
    assert upper > 0.6 * chin


def test_stubble_is_short_and_full_beards_are_long_and_hang_down():
    reach = []
    for fullness in (0.1, 0.5, 1.0):
        hairs = beard_of(fw.default_face({"beard": fullness}))
        reach.append(np.median(np.linalg.norm(hairs[:, -1] - hairs[:, 0], axis=1)))
    assert reach[0] < 1.0 < reach[1] < reach[2]
    assert 5.0 < reach[2] < 12.0
    assert (hairs[:, -1, 1] < hairs[:, 0, 1]).mean() > 0.9


def test_beards_have_the_color_of_the_hair(face):
    bearded = fw.default_face({"beard": 0.8, "hair": -0.6})
    np.testing.assert_array_equal(bearded.bound_hair["beard"].color, bearded.bound_hair["cropped_hair"].color)
    assert bearded.bound_hair["beard"].color.mean() > face.bound_hair["cropped_hair"].color.mean()
    assert "beard" not in fw.default_face({"beard": -0.5}).bound_hair
