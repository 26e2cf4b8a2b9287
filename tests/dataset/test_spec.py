"""Specifications: defaults, limits, distributions, errors that name what is meant."""

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
    assert other.drawn("camera", other.random(3, "camera"))["yaw"] == 0.0


def test_aspects_and_samples_are_independent():
    spec = Spec.of()
    streams = [spec.random(number, what, attempt).random() for number in (0, 1) for what in "ab" for attempt in (0, 1)]
    assert len(set(streams)) == 8
    pairs = np.array([[spec.random(n, what).random() for what in ("camera", "lights")] for n in range(500)])
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 4.0 / np.sqrt(500)


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
    assert ends[0] <= Distribution.of({"uniform": ends}, "x").draw(np.random.default_rng(seed)) <= ends[1]


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


def number(written):
    return Distribution.of(written, "x", 0.0, 5.0)


def words(written):
    return Distribution.of_words(written, "names", ("happiness", "anger"))


@pytest.mark.parametrize(
    ("of", "written", "error", "message"),
    [
        (Spec.of, {"sede": 1}, UnknownNameError, "seed"),
        (Spec.of, {"camera": {"jaw": 1}}, UnknownNameError, "yaw"),
        (Spec.of, {"identity": {"agee": 1}}, UnknownNameError, "age"),
        (Spec.of, {"expression": {"units": ["AU99"]}}, UnknownNameError, "AU99"),
        (Spec.of, {"expression": {"names": ["hapiness"]}}, UnknownNameError, "happiness"),
        (Spec.of, {"camera": 3}, ParameterError, r"\[camera\]"),
        (Spec.of, {"size": [3, 3]}, ParameterError, r"size\[0\] must be at least 16, received 3"),
        (Spec.of, {"size": 512}, ParameterError, "size must be a list, received 512"),
        (Spec.of, {"quick": "yes"}, ParameterError, "quick must be true or false, received 'yes'"),
        (Spec.of, {"shard": 0}, ParameterError, "shard must be at least 1, received 0"),
        (Spec.of, {"seed": float("nan")}, ParameterError, "seed must be a whole number"),
        (Spec.of, {"mesh": "obj"}, ParameterError, "mesh must be one of '', 'npz', 'glb', received 'obj'"),
        (Spec.of, {"clip": {"frames": 0}}, ParameterError, "clip.frames"),
        (Spec.of, {"clip": {"interval": 0.03}}, ParameterError, "whole number of steps"),
        (Spec.of, {"identity": {"age": 2}}, ParameterError, "identity.age must be at most 1, received 2"),
        (Spec.of, {"expression": {"neutral": 0.8}}, ParameterError, "at most 1 together"),
        (Spec.of, {"expression": {"units": []}}, ParameterError, "expression.units must not be empty"),
        (
            Spec.of,
            {"expression": {"apart": [["AU1"]]}},
            ParameterError,
            r"expression.apart\[0\] must be a list of 2 entries",
        ),
        (
            Spec.of,
            {"expression": {"together": [["AU1", "AU2", 2]]}},
            ParameterError,
            r"together\[0\]\[2\] must be at most 1",
        ),
        (Spec.of, {"tears": {"share": float("nan")}}, ParameterError, "tears.share must be at least 0"),
        (Spec.of, {"faces": {"built_in": 0}}, ParameterError, "no face is left"),
        (Spec.of, {"faces": {"scans": [{"path": "nobody.face"}]}}, ParameterError, "does not exist"),
        (
            Spec.of,
            {"faces": {"scans": "nobody.face"}},
            ParameterError,
            "faces.scans must be a list, received 'nobody.face'",
        ),
        (number, {"uniform": [2, 1]}, ParameterError, "rising order"),
        (number, {"uniform": [0, 9]}, ParameterError, r"x\[1\] must be at most 5, received 9.0"),
        (
            number,
            {"uniform": [0, 1], "within": [0, 1]},
            ParameterError,
            "must have uniform, normal, .* received uniform, within",
        ),
        (number, {"uniform": "wide"}, ParameterError, "x.uniform must be a list"),
        (number, {"uniform": [float("nan"), 1]}, ParameterError, r"x.uniform\[0\] must be at least"),
        (number, {"normal": [1, float("inf")]}, ParameterError, r"x.normal\[1\] must be at most"),
        (number, {"normal": [1, 0]}, ParameterError, "positive deviation"),
        (number, {"normal": [1, 1], "within": [3, 4]}, ParameterError, "mean within"),
        (number, {"choice": []}, ParameterError, "x.choice must not be empty"),
        (number, {"choice": [1, 2], "weights": [1]}, ParameterError, "one for each"),
        (number, {"choice": [1, 2], "weights": [0, 0]}, ParameterError, "above 0"),
        (number, "often", ParameterError, "received 'often'"),
        (number, True, ParameterError, "received True"),
        (number, 7, ParameterError, "received 7"),
        (number, {"unifrom": [0, 1]}, UnknownNameError, "uniform"),
        (number, {"normal": [0, 1], "witin": [0, 1]}, UnknownNameError, "within"),
        (words, ["hapiness"], UnknownNameError, "happiness"),
        (words, [3], ParameterError, r"names\[0\] must be a text"),
    ],
)
def test_wrong_values_and_unknown_words(of, written, error, message):
    with pytest.raises(error, match=message):
        of(written)
