"""Motion against captured shapes: the measures against closed forms, the muscles against the shapes of a real face."""

import numpy as np
import pytest
from real_faces import FACES

import facewrinkle as fw
from analysis.emotions import EMOTIONS, captured_emotion, emotion_agreements
from analysis.motion import FOLDS, OTHERS, PAIRS, agreements, compared, fold_angles, read_shapes, report

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def captured():
    """A captured face, and its shapes."""
    if not (FACES / "ict_face_expressions.npz").exists():
        pytest.skip("the captured face is not there")
    face = fw.fit_face(FACES / "ict_face_narrow.obj", FACES / "ict_face_narrow.landmarks.json", units="cm")
    return face, read_shapes(FACES / "ict_face_expressions.npz", face.mesh.n_points, face.unit)


def test_a_field_agrees_with_itself_and_with_nothing_square_to_it():
    rng = np.random.default_rng(0)
    field, area = rng.normal(size=(50, 3)), rng.random(50)
    same = compared(field, field, area)
    assert (same.cosine, same.area_cosine, same.size, same.error) == pytest.approx((1.0, 1.0, 1.0, 0.0))
    half = compared(0.5 * field, field, area)
    assert (half.cosine, half.size) == pytest.approx((1.0, 0.5))
    assert compared(np.cross(field, rng.normal(size=3)), field, area).cosine == pytest.approx(0.0, abs=1e-12)


def test_shapes_of_another_mesh_are_refused(tmp_path):
    np.savez(tmp_path / "shapes.npz", names=["a"], deltas=np.zeros((1, 4, 3)))
    with pytest.raises(fw.FaceWrinkleError, match="the mesh has 5 points"):
        read_shapes(tmp_path / "shapes.npz", 5, 1.0)


def test_muscles_move_a_captured_face_as_it_moved(captured):
    face, shapes = captured
    rows = [row for row, _ in agreements(face, shapes)]
    assert [(row.muscle, row.shape) for row in rows] == list(PAIRS)
    assert min(row.cosine for row in rows) >= 0.8
    assert np.mean([row.cosine for row in rows]) >= 0.9
    assert np.mean([row.area_cosine for row in rows]) >= 0.86
    assert all(1 / 1.5 <= row.size <= 1.5 for row in rows if row.muscle != "nasalis_l")
    others = [row for row, _ in agreements(face, shapes, OTHERS)]
    assert [(row.muscle, row.shape) for row in others] == list(OTHERS)
    assert min(row.cosine for row in others) >= 0.8
    assert np.mean([row.area_cosine for row in others]) >= 0.75


@pytest.mark.parametrize(
    ("unit", "shapes", "least", "most"),
    [
        ("AU9", "noseSneer_L+noseSneer_R", 0.4, 0.8),
        ("AU10", "mouthUpperUp_L+mouthUpperUp_R", 0.55, 0.9),
        ("AU14", "mouthDimple_L+mouthDimple_R", 0.35, 0.8),
        ("AU18", "mouthPucker", 0.6, 0.9),
        ("AU20", "mouthStretch_L+mouthStretch_R", 0.9, 2.0),
        ("AU22", "mouthFunnel", 1.0, 1.6),
        ("AU24", "mouthPress_L+mouthPress_R", 0.9, 2.6),
    ],
)
def test_units_move_the_skin_as_far_as_captures_agree(captured, unit, shapes, least, most):
    """Two other captured faces move by .35 to 2.6 of this one in the same shapes; ours lies between the captures."""
    face, moved = captured
    ((row, _),) = agreements(face, moved, [(unit, shapes)])
    assert least <= row.size <= most


def test_emotions_are_those_that_were_captured(captured):
    """Near the best that the muscles can do, none taken for another, and none faint."""
    face, shapes = captured
    rows = emotion_agreements(face, shapes)
    assert [row.agreement.muscle for row in rows] == list(EMOTIONS)
    assert [row.nearest for row in rows] == list(EMOTIONS)
    for row in rows:
        assert row.agreement.cosine >= 0.8
        assert row.ceiling - 0.07 < row.agreement.cosine <= row.ceiling + 0.02
        assert row.agreement.size >= 0.5
    assert np.mean([row.agreement.cosine for row in rows]) >= 0.88


def test_a_captured_emotion_is_the_sum_of_its_units():
    rng = np.random.default_rng(0)
    shapes = {name: rng.normal(size=(5, 3)) for name in ("mouthSmile_R", "mouthDimple_R", "jawOpen")}
    expected = 0.2 * shapes["mouthSmile_R"] + 0.2 * shapes["mouthDimple_R"]
    np.testing.assert_allclose(captured_emotion(shapes, {"AU12R": 0.2, "AU14R": 0.2}), expected)
    np.testing.assert_allclose(captured_emotion(shapes, {"AU26": 0.5}), 0.3 * shapes["jawOpen"])


def test_cheeks_bulge_as_they_did(captured):
    """Outwards, where the flesh that a muscle raises is bunched up: on the cheek bone, and half way to the mouth."""
    face, shapes = captured
    pairs = [("zygomaticus_major_l", "mouthSmile_L"), ("orbicularis_oculi_orbital_l", "cheekSquint_L")]
    normals, cheek = fw.geometry.vertex_normals(face.points, face.triangles), face.landmarks["malar_l"]
    for row, ours in agreements(face, shapes, pairs):
        for place in (cheek, 0.5 * (cheek + face.landmarks["mouth_l"])):
            near = np.linalg.norm(face.points - place, axis=1) * face.unit < 8.0
            outwards, captured = ((field * normals)[near].sum(axis=1).mean() for field in (ours, shapes[row.shape]))
            assert captured > 1.0
            assert 0.6 * captured < outwards < 1.4 * captured


def test_furrows_run_across_the_compression_of_a_map(face):
    """Compressed along the fibers of a forehead's muscle everywhere: 0 degrees; across them: 90."""
    along = face.muscles["frontalis_major_l"].fold_direction(face.points[:1])[0]
    beside = np.cross(along, face.frame.axes[2])
    for axis, expected in ((along, 0.0), (beside / np.linalg.norm(beside), 90.0)):
        field = -0.3 * (face.points @ axis)[:, None] * axis * face.unit
        (angle,) = fold_angles(face, {"squeezed": field}, [("frontalis_major_l", "squeezed")])
        assert angle.folds == pytest.approx(expected, abs=8.0)
        assert angle.epsilon == pytest.approx(0.3, abs=0.05)


def test_furrows_run_across_the_principal_compression_of_a_captured_face(captured):
    face, shapes = captured
    rows = fold_angles(face, shapes)
    assert [(row.muscle, row.shape) for row in rows] == list(FOLDS)
    # Creases are lines that muscles of several directions share: see tests/anatomy/test_crease.py.
    free = [row.folds for row in rows if not isinstance(face.muscles[row.muscle].fold_pattern, fw.Crease)]
    assert len(free) == 8
    assert max(free) < 25.0
    assert max(row.folds for row in rows) < 35.0
    assert np.mean(free) < 15.0
    assert np.mean([row.fibers for row in rows]) > 30.0  # where the paper's furrows would lie
    assert min(row.epsilon for row in rows) > 0.05  # and there is something to fold


def test_the_report_holds_all_pairs(captured):
    face, shapes = captured
    made = report(face, {name: shapes[name] for name in ("browDown_L", "browDown_R", "jawOpen")})
    assert [row[:2] for row in made.tables[0].rows] == [("corrugator_l", "browDown_L"), ("jaw", "jawOpen")]
    assert [row[0] for row in made.tables[2].rows] == ["corrugator_l"]
    assert [plot.name for plot in made.plots] == ["agreement", "corrugator_l_browDown_L", "jaw_jawOpen"]
