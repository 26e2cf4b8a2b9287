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
from tools.trials.wrinkle_detection import Network, area_under_curve, average_precision, overlap, report


def test_the_area_is_the_share_of_pairs_in_order():
    random = np.random.default_rng(2)
    score, truth = random.integers(0, 9, 60).astype(float), random.random(60) < 0.4
    pairs = score[truth][:, None] - score[~truth]
    assert area_under_curve(score, truth) == pytest.approx((pairs > 0).mean() + 0.5 * (pairs == 0).mean())


def test_scores_of_a_perfect_guess_and_of_chance():
    random = np.random.default_rng(3)
    truth = random.random(20000) < 0.1
    assert average_precision(truth + 0.0, truth) == overlap(truth + 0.0, truth, 0.5) == 1.0
    assert average_precision(random.random(20000), truth) == pytest.approx(0.1, abs=0.01)


def test_gradients_are_those_of_the_loss():
    random = np.random.default_rng(4)
    inputs, targets = random.normal(size=(30, 5)), (random.random(30) < 0.5).astype(float)
    network = Network(inputs, targets > 0.0)

    def loss():
        w, b, v, c = network.weights
        odds = np.maximum(inputs @ w + b, 0.0) @ v + c
        return np.mean(np.logaddexp(0.0, odds) - targets * odds)

    for weights, gradient in zip(network.weights, network.gradients(inputs, targets), strict=True):
        for k in random.integers(0, weights.size, 3):
            kept = weights.flat[k]
            weights.flat[k] = kept + 1e-6
            above = loss()
            weights.flat[k] = kept - 1e-6
            below = loss()
            weights.flat[k] = kept
            assert gradient.flat[k] == pytest.approx((above - below) / 2e-6, abs=1e-6)


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
