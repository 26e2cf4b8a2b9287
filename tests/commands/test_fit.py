"""``facewrinkle fit`` from outside: what it finds, and how other commands take it."""

import json

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.cli import main


@pytest.mark.slow
def test_fit_finds_a_face_and_express_takes_it(tmp_path, run):
    head = fw.default_face()
    head.mesh.scale(0.001).rotate_y(40).flip_faces().save(tmp_path / "head.vtp")
    (tmp_path / "some.json").write_text(json.dumps({"nose_tip": _turned(head.landmarks["nose_tip"])}))
    arguments = ["fit", str(tmp_path / "head.vtp"), "--landmarks", str(tmp_path / "some.json"), "--units", "m"]
    told = run(*arguments, "--out", str(tmp_path / "out")).out
    assert "4517" in told
    assert "repaired and separated" in told
    assert "oriented inward" in told
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "head.face",
        "head.landmarks.json",
        "head.png",
    ]
    found = json.loads((tmp_path / "out" / "head.landmarks.json").read_text())["landmarks"]
    assert found["zygion_l"]["estimated"]
    assert not found["nose_tip"]["estimated"]
    for name in ("nose_tip", "mouth_l", "eye_r_outer"):
        np.testing.assert_allclose(found[name]["xyz"], _turned(head.landmarks[name]), atol=0.002)
    few = ["--frames", "6", "--size", "96", "--no-movie", "--max-level", "1", "--view", "front"]
    source = ["--face", str(tmp_path / "out" / "head.face")]
    assert main(["express", "AU4", *source, *few, "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "AU4.png").is_file()
    assert (
        "--units is not for head.face, which has its own: leave it out."
        in run("express", "AU4", *source, "--units", "mm", code=1).err
    )


def _turned(point):
    """A place on the head after it was made a thousand times smaller and turned by 40 degrees about y."""
    cos, sin = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
    return [0.001 * (cos * point[0] + sin * point[2]), 0.001 * point[1], 0.001 * (cos * point[2] - sin * point[0])]
