"""Pages that show a rig, in a browser without a window."""

from __future__ import annotations

import re
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image

import facewrinkle as fw
from facewrinkle.errors import OutputError
from facewrinkle.rigging import sheet, write_page

pytestmark = pytest.mark.slow


def shot(page, picture, hash_=""):
    """What chromium shows of a page."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("there is no chromium")
    options = ["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
               "--window-size=800,500", "--hide-scrollbars", "--virtual-time-budget=8000"]  # fmt: skip
    command = [browser, *options, f"--screenshot={picture}", f"{page.as_uri()}{hash_}"]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return np.asarray(Image.open(picture).convert("RGB"), dtype=float)[:, :480]


def test_a_page_needs_nothing_but_itself(smooth_rig, tmp_path):
    path = write_page(smooth_rig, tmp_path / "<A & B>.html")
    text = path.read_text(encoding="utf-8")
    assert "<title>&lt;A &amp; B&gt;</title>" in text
    assert "{{" not in text
    assert not re.search(r"(src|href)\s*=|https?:|import\s", text)
    with pytest.raises(OutputError, match=r"must end in \.html"):
        write_page(smooth_rig, tmp_path / "head.htm")


def test_the_page_shows_the_face_and_its_shapes(smooth_rig, tmp_path):
    path = write_page(smooth_rig, tmp_path / "head.html")
    rest, again = (shot(path, tmp_path / f"{k}.png") for k in range(2))
    opened = shot(path, tmp_path / "2.png", "#jawOpen=1&browInnerUp=1")
    np.testing.assert_array_equal(rest, again)
    assert rest.std() > 20.0  # a face before the background
    changed = np.abs(rest - opened).max(axis=2) > 10.0
    assert 0.01 < changed.mean() < 0.5


def test_a_sheet_shows_every_shape(face):
    rig = fw.rig(face, shapes="jawOpen+browInnerUp+eyeBlinkLeft", wrinkles="none", level=0)
    image = sheet(rig, columns=2, size=100)
    assert image.shape == (204, 204, 3)
    rest = image[:100, :100].astype(float)[20:]  # below the names
    for other in (image[:100, 104:], image[104:, :100], image[104:, 104:]):
        assert np.abs(other.astype(float)[20:] - rest).max() > 30.0
