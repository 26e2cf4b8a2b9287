"""Specifications: defaults, limits, distributions, errors that name what is meant."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import facewrinkle
from facewrinkle.dataset.spec import DEFAULT, NUMBERS, Distribution, Spec, digest_of
from facewrinkle.errors import ParameterError, UnknownNameError


def test_the_default_is_what_is_left_out():
    written = tomllib.loads(DEFAULT.read_text(encoding="utf-8"))
    assert Spec.of().digest == Spec.of(written).digest == Spec.of({"camera": {}}).digest
    assert all(set(NUMBERS[table]) <= set(Spec.of().written[table]) for table in NUMBERS)


def test_other_values_are_another_set():
    digests = {
        Spec.of(written).digest
        for written in ({}, {"seed": 1}, {"identity": {"age": 0}}, {"camera": {"yaw": 0}}, {"size": [64, 64]})
    }
    assert len(digests) == 5


def test_what_is_not_changed_is_drawn_as_before():
    one, other = Spec.of(), Spec.of({"camera": {"yaw": 0}})
    assert one.drawn("lights", one.random(3, "lights")) == other.drawn("lights", other.random(3, "lights"))
    drawn = other.drawn("camera", other.random(3, "camera"))
    assert drawn["yaw"] == 0.0


def test_aspects_and_samples_are_independent():
    spec = Spec.of()
    streams = [spec.random(number, what, attempt).random() for number in (0, 1) for what in "ab" for attempt in (0, 1)]
    assert len(set(streams)) == 8
    pairs = np.array([[spec.random(n, what).random() for what in ("camera", "lights")] for n in range(500)])
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 4.0 / np.sqrt(500)


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ({"sede": 1}, "seed"),
        ({"camera": {"jaw": 1}}, "yaw"),
        ({"identity": {"agee": 1}}, "age"),
        ({"expression": {"units": ["AU99"]}}, "AU99"),
        ({"expression": {"names": ["hapiness"]}}, "happiness"),
    ],
)
def test_unknown_words_name_the_nearest(written, message):
    with pytest.raises(UnknownNameError, match=message):
        Spec.of(written)


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ({"camera": 3}, r"\[camera\]"),
        ({"size": [3, 3]}, r"size\[0\] must be at least 16, received 3"),
        ({"size": 512}, "size must be a list, received 512"),
        ({"quick": "yes"}, "quick must be true or false, received 'yes'"),
        ({"shard": 0}, "shard must be at least 1, received 0"),
        ({"seed": float("nan")}, "seed must be a whole number"),
        ({"mesh": "obj"}, "mesh must be one of '', 'npz', 'glb', received 'obj'"),
        ({"clip": {"frames": 0}}, "clip.frames"),
        ({"clip": {"interval": 0.03}}, "whole number of steps"),
        ({"identity": {"age": 2}}, "identity.age must be at most 1, received 2"),
        ({"expression": {"neutral": 0.8}}, "at most 1 together"),
        ({"expression": {"units": []}}, "expression.units must not be empty"),
        ({"expression": {"apart": [["AU1"]]}}, r"expression.apart\[0\] must be a list of 2 entries"),
        ({"expression": {"together": [["AU1", "AU2", 2]]}}, r"together\[0\]\[2\] must be at most 1"),
        ({"tears": {"share": float("nan")}}, "tears.share must be at least 0"),
        ({"faces": {"built_in": 0}}, "no face is left"),
        ({"faces": {"scans": [{"path": "nobody.face"}]}}, "does not exist"),
        ({"faces": {"scans": "nobody.face"}}, "faces.scans must be a list, received 'nobody.face'"),
    ],
)
def test_wrong_values(written, message):
    with pytest.raises(ParameterError, match=message):
        Spec.of(written)


def test_files(tmp_path):
    good = tmp_path / "good.toml"
    good.write_text("seed = 5\n[camera]\nyaw = 10\n", encoding="utf-8")
    assert Spec.read(good).digest == Spec.of({"seed": 5, "camera": {"yaw": 10}}).digest
    good.write_text("seed = ", encoding="utf-8")
    with pytest.raises(ParameterError, match="is not valid TOML"):
        Spec.read(good)
    good.write_text("sede = 1", encoding="utf-8")
    with pytest.raises(UnknownNameError, match=r"good.toml.*seed"):
        Spec.read(good)
    with pytest.raises(ParameterError, match="cannot be read"):
        Spec.read(tmp_path / "none.toml")


def test_a_scan_is_known_by_its_content(tmp_path):
    scan = tmp_path / "a.face"
    scan.write_bytes(b"one")
    written = {"faces": {"scans": [{"path": "a.face", "licence": "mine"}]}}
    first = Spec.of(written, tmp_path)
    assert first.faces.scans[0].licence == "mine"
    scan.write_bytes(b"two")
    assert Spec.of(written, tmp_path).digest != first.digest


@pytest.mark.slow
def test_the_digest_is_of_what_can_change_a_pixel(tmp_path):
    package = Path(facewrinkle.__file__).parent
    copy = shutil.copytree(package, tmp_path / "copy", ignore=shutil.ignore_patterns("__pycache__", "page"))

    def add(name, added):
        with (copy / name).open("a", encoding="utf-8") as file:
            file.write(f"\n{added}\n")

    before = digest_of(copy)
    add("motion/skin.py", "# a word more")
    add("motion/skin.py", '"""A docstring."""')
    add("commands/play.py", "LIMIT = 3")
    add("live/document.py", "LIMIT = 3")
    assert digest_of(copy) == before
    add("motion/skin.py", "LIMIT = 3")
    code = digest_of(copy)
    assert code != before
    add("dataset/data/default.toml", "# a word more")
    assert digest_of(copy) not in (before, code)


# --- distributions ---------------------------------------------------------------------------------


NUMBER = st.floats(-5.0, 5.0)


@given(st.tuples(NUMBER, NUMBER).map(sorted), st.integers(0, 2**32))
def test_uniform_values_lie_in_their_range(ends, seed):
    value = Distribution.of({"uniform": ends}, "x").draw(np.random.default_rng(seed))
    assert ends[0] <= value <= ends[1]


@given(NUMBER, st.floats(0.01, 2.0), st.floats(0.1, 3.0), st.floats(0.1, 3.0), st.integers(0, 2**32))
def test_normal_values_lie_within_their_limits(mean, deviation, below, above, seed):
    limits = [mean - below, mean + above]
    value = Distribution.of({"normal": [mean, deviation], "within": limits}, "x").draw(np.random.default_rng(seed))
    assert limits[0] <= value <= limits[1]


def test_choices_are_as_frequent_as_their_weights():
    drawn = Distribution.of({"choice": [1, 2, 3], "weights": [1, 0, 3]}, "x")
    random = np.random.default_rng(5)
    values = np.array([drawn.draw(random) for _ in range(4000)])
    assert not (values == 2.0).any()
    assert abs((values == 3.0).mean() - 0.75) < 4.0 * np.sqrt(0.75 * 0.25 / 4000)


def test_a_number_is_fixed_and_a_list_is_a_choice():
    random = np.random.default_rng(1)
    assert {Distribution.of(3, "x").draw(random) for _ in range(5)} == {3.0}
    assert {Distribution.of([1, 2], "x").draw(random) for _ in range(50)} == {1.0, 2.0}


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ({"uniform": [2, 1]}, "rising order"),
        ({"uniform": [0, 9]}, r"x\[1\] must be at most 5, received 9.0"),
        ({"uniform": [0, 1], "within": [0, 1]}, "must have uniform, normal, .* received uniform, within"),
        ({"uniform": "wide"}, "x.uniform must be a list"),
        ({"uniform": [float("nan"), 1]}, r"x.uniform\[0\] must be at least"),
        ({"normal": [1, float("inf")]}, r"x.normal\[1\] must be at most"),
        ({"normal": [1, 0]}, "positive deviation"),
        ({"normal": [1, 1], "within": [3, 4]}, "mean within"),
        ({"choice": []}, "x.choice must not be empty"),
        ({"choice": [1, 2], "weights": [1]}, "one for each"),
        ({"choice": [1, 2], "weights": [0, 0]}, "above 0"),
        ("often", "received 'often'"),
        (True, "received True"),
        (7, "received 7"),
    ],
)
def test_wrong_distributions_of_numbers(written, message):
    with pytest.raises(ParameterError, match=message):
        Distribution.of(written, "x", 0.0, 5.0)


def test_unknown_words():
    with pytest.raises(UnknownNameError, match="uniform"):
        Distribution.of({"unifrom": [0, 1]}, "x")
    with pytest.raises(UnknownNameError, match="within"):
        Distribution.of({"normal": [0, 1], "witin": [0, 1]}, "x")
    with pytest.raises(UnknownNameError, match="happiness"):
        Distribution.of_words(["hapiness"], "names", ("happiness", "anger"))
    with pytest.raises(ParameterError, match=r"names\[0\] must be a text"):
        Distribution.of_words([3], "names", ("happiness",))
