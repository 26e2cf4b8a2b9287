"""An off-the-shelf detector takes the drawn head for a person's face: a floor, not a judge."""

import cv2
import numpy as np
import pytest

import facewrinkle as fw

TILT = np.tan(np.radians(15.0))
VIEWS = {
    "front": (0.0, 0.0, 1.0),
    "turned left": (TILT, 0.0, 1.0),
    "turned right": (-TILT, 0.0, 1.0),
    "from above": (0.0, TILT, 1.0),
    "from below": (0.0, -TILT, 1.0),
}


def found(image: np.ndarray) -> tuple[int, list[tuple[float, float]]]:
    """Number of faces, and the centres of the two surest eyes in the first, as shares of its width and height."""
    gray = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    faces = detector("frontalface_default").detectMultiScale(gray, 1.1, 5, minSize=(120, 120))
    if len(faces) == 0:
        return 0, []
    x, y, w, h = faces[0]
    upper = gray[y : y + int(0.6 * h), x : x + w]
    size = (w // 10, w // 10)
    eyes, _, sure = detector("eye").detectMultiScale3(upper, 1.05, 5, minSize=size, outputRejectLevels=True)
    eyes = [eyes[k] for k in np.argsort(sure)[-2:]]  # it takes the bags of the old for eyes, too
    return len(faces), sorted(((ex + ew / 2) / w, (ey + eh / 2) / h) for ex, ey, ew, eh in eyes)


def detector(name: str) -> cv2.CascadeClassifier:
    return cv2.CascadeClassifier(f"{cv2.data.haarcascades}haarcascade_{name}.xml")


def check(face: fw.Face, view: str) -> None:
    frame = fw.Simulation(face).step()
    faces, eyes = found(
        fw.picture(frame, face, fw.plotting.Style(size=(600, 600), view=fw.plotting.View(VIEWS[view], height=4.6)))
    )
    assert faces == 1
    assert len(eyes) == 2
    assert eyes[0][0] < 0.5 < eyes[1][0]
    assert abs(eyes[0][1] - eyes[1][1]) < 0.1  # at one height


@pytest.mark.parametrize(
    "view", ["front", *(pytest.param(view, marks=pytest.mark.slow) for view in VIEWS if view != "front")]
)
def test_one_face_and_two_eyes_are_found(face, view):
    check(face, view)


@pytest.mark.slow
@pytest.mark.parametrize(
    "identity", [{"age": 1.0}, {"sex": -1.0, "lips": 0.7}, {"jaw": 1.0, "width": 0.6, "brow": 1.0}]
)
def test_other_identities_are_faces_too(identity):
    check(fw.default_face(identity=identity), "front")
