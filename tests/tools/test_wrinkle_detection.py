"""A network that finds furrows: its parts against definitions, and all of it on a set whose answer is known."""

from __future__ import annotations

import io
import json
import tarfile

import numpy as np
import pytest

from facewrinkle.dataset.labels import PARTS
from facewrinkle.dataset.sample import Sample
from tools.trials import wrinkle_detection
from tools.trials.wrinkle_detection import report


def test_dark_lines_are_found_on_people_not_seen_before(tmp_path, monkeypatch):
    monkeypatch.setattr(wrinkle_detection, "PER_PICTURE", 800)
    random = np.random.default_rng(5)
    with tarfile.open(tmp_path / "shard-000000.tar", "w") as tar:
        for person in range(8):
            image = random.normal(150.0, 2.0, (48, 48, 3))
            furrow, row = np.zeros((48, 48), np.uint8), int(random.integers(8, 40))
            furrow[row : row + 2] = 1
            image[row : row + 2] -= 40.0
            labels = {"part": np.full((48, 48), PARTS.index("skin"), np.uint8), "furrow": furrow}
            sample = Sample(person, image.astype(np.uint8), labels, {"person": {"number": person}})
            for ending, content in sample.files().items():
                member = tarfile.TarInfo(f"{sample.key}.{ending}")
                member.size = len(content)
                tar.addfile(member, io.BytesIO(content))
    found = report(tmp_path)
    assert (found.numbers["train"], found.numbers["test"]) == (6, 2)
    assert found.tables[0].rows[-1][1] > 0.99
    assert json.loads(json.dumps(found.numbers))["share"] == pytest.approx(2 / 48, rel=0.3)
