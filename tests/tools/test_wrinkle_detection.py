"""A network that finds furrows: its parts against definitions, and all of it on a set whose answer is known."""

import io
import json
import tarfile

import numpy as np
import pytest
from PIL import Image

from facewrinkle.dataset.labels import PARTS
from facewrinkle.dataset.sample import compressed, key_of
from tools.trials import wrinkle_detection
from tools.trials.wrinkle_detection import FURROW, MARKS, OTHER, SKIN, photograph, read, report

SIZE = 48
"""Side of the pictures, pixels."""


@pytest.fixture
def dark_lines(tmp_path):
    """Return the folder of a set of 20 people, each a picture of skin with a dark furrow, and rows of the furrows."""
    random, rows = np.random.default_rng(5), []
    with tarfile.open(tmp_path / "shard-000000.tar", "w") as tar:
        for person in range(20):
            image = random.normal(150.0, 2.0, (SIZE, SIZE, 3))
            furrow, row = np.zeros((SIZE, SIZE), np.uint8), int(random.integers(8, 40))
            furrow[row : row + 2] = 1
            image[row : row + 2] -= 40.0
            rows.append(row)
            labels = {"part": np.full((SIZE, SIZE), PARTS.index("skin"), np.uint8), "furrow": furrow}
            picture = io.BytesIO()
            Image.fromarray(image.astype(np.uint8)).save(picture, format="PNG")
            facts = json.dumps({"person": {"number": person}}).encode()
            files = {"png": picture.getvalue(), "npz": compressed(labels), "json": facts}
            for ending, content in files.items():
                member = tarfile.TarInfo(f"{key_of(person)}.{ending}")
                member.size = len(content)
                tar.addfile(member, io.BytesIO(content))
    return tmp_path, rows


def test_furrows_of_a_set_are_read(dark_lines):
    folder, rows = dark_lines
    found = list(read(folder))
    assert [person for person, _, _ in found] == list(range(20))
    for row, (_, picture, kinds) in zip(rows, found, strict=True):
        assert picture.shape == (SIZE, SIZE, 3)
        expected = np.full((SIZE, SIZE), SKIN)
        expected[row : row + 2] = FURROW
        np.testing.assert_array_equal(kinds, expected)


def test_photographs_are_turned_and_scaled_as_the_marks_want(tmp_path):
    """Dots at the pupils of a picture that is turned and twice as large come to level places, PUPILS apart."""
    pupils = np.array([(300, 400), (460, 520)])
    image = np.full((900, 900, 3), 200, np.uint8)
    yy, xx = np.mgrid[:900, :900]
    for x, y in pupils:
        image[np.hypot(xx - x, yy - y) < 10.0] = (0, 0, 255)
    Image.fromarray(image).save(tmp_path / "face.png")
    marks = {"file": "face.png", "pupils": pupils.tolist(), "skin": [[100, 100], [280, 100], [280, 300], [100, 300]],
             "not_skin": [[[150, 200], [200, 200], [200, 250]]], "lines": [[[120, 280], [260, 280]]]}  # fmt: skip
    picture, kinds = photograph(tmp_path, marks)
    dots = picture[:, :, 2] > picture[:, :, 0] + 100.0
    for side, x in ((np.s_[:, :192], 192 - 48), (np.s_[:, 192:], 192 + 48)):
        rows, columns = np.nonzero(dots[side])
        assert rows.mean() == pytest.approx(165, abs=1.0)
        assert columns.mean() + (192 if x > 192 else 0) == pytest.approx(x, abs=1.0)
    assert (kinds[280, 190], kinds[282, 190], kinds[284, 190]) == (FURROW, FURROW, SKIN)
    assert (kinds[210, 190], kinds[110, 90]) == (OTHER, OTHER)


def test_marks_lie_on_the_photographs():
    for entry in json.loads(MARKS.read_text()):
        points = np.array([point for line in (*entry["lines"], entry["skin"], *entry["not_skin"]) for point in line])
        assert 0 <= points.min() <= points.max() < wrinkle_detection.SIZE


def test_dark_lines_are_found_on_people_not_seen_before(dark_lines, tmp_path):
    pytest.importorskip("torch")
    folder, _ = dark_lines
    skin = report(folder, None, None, 60, tmp_path / "out").tables[0].rows
    assert skin[0][1] == pytest.approx(2 / SIZE)
    assert skin[0][3] > 0.9
    again = report(folder, None, tmp_path / "out" / "unet.pt", 60, tmp_path / "out")
    assert again.tables[0].rows[0][3] == pytest.approx(skin[0][3], abs=0.01)  # weights are kept in half precision
