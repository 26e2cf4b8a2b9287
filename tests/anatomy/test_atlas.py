"""The atlas of muscles, action units and expressions.

what                            checked against
muscles                         the 23 names of the paper, in pairs
expressions                     the five of the paper, written out
action units                    the muscle that FACS names for each; left and right halves
mixtures                        the strongest rate per muscle, by hand
placing                         the weighted means of landmarks; mirrored, scaled and turned landmarks
files of one's own              what is wrong with them, in the message

Names with numbers, as text.
"""

import dataclasses
import re
import tomllib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skins import settled

import facewrinkle as fw
from facewrinkle.anatomy.atlas import atlas_text, load_atlas, read_atlas, split_names, write_atlas
from facewrinkle.errors import FaceWrinkleError, OutputError, ParameterError, UnknownNameError

PAIRS = [
    "frontalis_inner", "frontalis_major", "frontalis_outer", "corrugator", "nasalis", "zygomaticus_major",
    "zygomaticus_minor", "risorius", "depressor_anguli_oris", "mentalis", "orbicularis_oculi",
]  # fmt: skip
NAMES = {*(f"{name}_{side}" for name in PAIRS for side in "lr"), "orbicularis_oris"}
SPHINCTERS = {"orbicularis_oculi_l", "orbicularis_oculi_r", "orbicularis_oris"}


@pytest.fixture
def read(tmp_path):
    """Reads an atlas from a text, or from bytes."""

    def read(text):
        path = tmp_path / "atlas.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_atlas(path)

    return read


def both(*names, rate=1.0):
    return {f"{name}_{side}": rate for name in names for side in "lr"}


# --- what is in it ------------------------------------------------------------------------------


def test_the_23_muscles_and_their_kinds(face):
    """Those of the paper; others may have joined them."""
    assert len(NAMES) == 23
    assert set(fw.MUSCLES) >= NAMES
    assert list(face.muscles) == list(fw.MUSCLES)
    for name in NAMES:
        kind = fw.SphincterMuscle if name in SPHINCTERS else fw.SheetMuscle if "frontalis" in name else fw.LinearMuscle
        kind = fw.TriangularMuscle if "depressor_anguli" in name else kind  # which the paper leaves to the future
        assert type(face.muscles[name]) is kind


def test_the_five_expressions_of_the_paper():
    frontal = ("frontalis_inner", "frontalis_major", "frontalis_outer")
    assert set(fw.EXPRESSIONS["paper_surprise"]) == set(both(*frontal))
    assert set(fw.EXPRESSIONS["frowning"]) == set(both("corrugator"))
    assert fw.EXPRESSIONS["closing_eye"]["orbicularis_oculi_l"] == 1.0  # and its orbital part, if it is told apart
    assert all(re.fullmatch("orbicularis_oculi.*_l", name) for name in fw.EXPRESSIONS["closing_eye"])
    assert set(fw.EXPRESSIONS["stretching_mouth"]) == {"zygomaticus_major_r"}
    assert set(fw.EXPRESSIONS["paper_fear"]) == set(both("frontalis_inner", "corrugator"))


@pytest.mark.parametrize(
    ("unit", "muscle"),
    {
        "AU1": "frontalis_inner", "AU2": "frontalis_outer", "AU4": "corrugator", "AU6": "orbicularis_oculi",
        "AU7": "orbicularis_oculi", "AU9": "nasalis", "AU11": "zygomaticus_minor", "AU12": "zygomaticus_major",
        "AU15": "depressor_anguli_oris", "AU17": "mentalis", "AU20": "risorius", "AU43": "orbicularis_oculi",
    }.items(),
)  # fmt: skip
def test_action_units_name_their_muscles_on_both_sides(unit, muscle):
    rates = fw.ACTION_UNITS[unit]
    strongest = max(rates.values())
    for side in "lr":  # or a part of that muscle
        assert max(rate for name, rate in rates.items() if re.fullmatch(f"{muscle}.*_{side}", name)) == strongest
    left, right = fw.ACTION_UNITS[unit + "L"], fw.ACTION_UNITS[unit + "R"]
    assert {**left, **right} == rates
    assert all(name.endswith("_l") for name in left)
    assert all(name.endswith("_r") for name in right)


def test_all_rates_are_shares_of_known_muscles():
    for rates in (*fw.ACTION_UNITS.values(), *fw.EXPRESSIONS.values()):
        assert rates
        assert set(rates) <= set(fw.MUSCLES)
        assert all(0.0 < rate <= 1.0 for rate in rates.values())


GUIDE = {
    "happiness": ("AU6", "AU12"),
    "sadness": ("AU1", "AU4", "AU15", "AU64"),
    "surprise": ("AU1", "AU2", "AU5", "AU26"),
    "fear": ("AU1", "AU2", "AU4", "AU5", "AU7", "AU20", "AU26"),
    "anger": ("AU4", "AU7", "AU17", "AU24"),
    "disgust": ("AU9", "AU17"),
    "contempt": ("AU12R", "AU14R"),
}


@pytest.mark.parametrize("emotion", GUIDE)
def test_emotions_are_made_of_their_action_units(emotion):
    """Of all that the FACS Investigator's Guide lists for it; others join in where other prototypes have them."""
    atlas = load_atlas()
    units = set().union(*(atlas.action_units[unit] for unit in GUIDE[emotion]))
    assert units <= set(atlas.expressions[emotion])
    more = set(atlas.units_of({emotion: 1.0})) - set(GUIDE[emotion])
    others = {
        "happiness": {"AU10", "AU20", "AU25", "AU26"},
        "sadness": {"AU7", "AU17"},
        "fear": {"AU25"},
        "anger": {"AU5", "AU10", "AU15", "AU23"},
        "disgust": {"AU4", "AU6", "AU7", "AU10", "AU15", "AU25"},
    }
    assert more == others.get(emotion, set())


@pytest.mark.parametrize("emotion", ["surprise", "fear", "anger", "disgust", "sadness"])
def test_lids_belong_to_emotions(emotion):
    """Raised in surprise and fear; drawn together, and hardly raised, in anger, disgust and sadness."""
    rates = fw.EXPRESSIONS[emotion]
    raised, drawn = (rates.get(f"{name}_l", 0.0) for name in ("levator_palpebrae", "orbicularis_oculi_palpebral"))
    assert (raised > drawn) == (emotion in ("surprise", "fear"))
    assert raised + drawn > 0.2


def test_a_smile_widens_the_mouth_as_spontaneous_smiles_do(face):
    """By 27 %, the corners rising at 47 degrees (Tarantili, Halazonetis and Spyropoulos, 2005)."""
    corners = [
        int(np.linalg.norm(face.points - face.landmarks[name], axis=1).argmin()) for name in ("mouth_l", "mouth_r")
    ]
    (left, right), before = face.points[corners] + settled(face, "happiness")[corners], face.points[corners[0]]
    assert (left - right)[0] / (2.0 * before[0]) == pytest.approx(1.27, abs=0.05)
    assert np.degrees(np.arctan2(*(left - before)[[1, 0]])) == pytest.approx(47.0, abs=5.0)


# --- mixtures -----------------------------------------------------------------------------------


@pytest.mark.parametrize("emotion", ["happiness", "sadness", "surprise", "fear", "contempt", "laughter"])
def test_units_of_an_emotion_contract_its_muscles(emotion):
    atlas = load_atlas()
    units = atlas.units_of({emotion: 0.6})
    assert set(units) <= set(atlas.action_units)
    assert atlas.contractions(units) == pytest.approx(atlas.contractions(emotion, 0.6))


MOODS = {
    "[expressions]\nmood = { contempt = 1.0, AU4 = 0.5 }": {"AU12R": 0.5, "AU14R": 1.0, "AU4": 0.5},
    "[expressions]\nmood = { contempt = 0.5 }": {"AU12R": 0.25, "AU14R": 0.5},
    "[expressions]\nmood = { contempt = 0.5, AU14R = 0.75, sadness = 0.0 }": {"AU12R": 0.25, "AU14R": 0.75},
    "[expressions]\nless = { contempt = 0.5, AU4 = 1.0 }\nmood = { less = 0.5, AU17 = 0.25 }":
        {"AU12R": 0.125, "AU14R": 0.25, "AU4": 0.5, "AU17": 0.25},
    "[expressions]\nmood = { paper_surprise = 0.5, AU17 = 0.25 }": {"AU1": 0.5, "AU2": 0.35, "AU17": 0.25},
    "[expressions]\nmood = { happiness = 0.0, mentalis = 0.5 }": {"AU17": 0.5},
    "[expressions]\nnothing = {}\nmood = { nothing = 1.0 }": {},
    "[expressions]\nmood = { mentalis = 1.0 }\nmentalis = { mentalis = 0.5 }": {"AU17": 1.0},
    "[expressions]\nmood = { mentalis = 1.0 }\n[action_units]\nAU90 = { name = 'None', muscles = {} }": {"AU17": 1.0},
    "[expressions]\nmood = { mentalis = 1.0 }\n[action_units]\nAU90 = { name = 'Rest', muscles = { mentalis = 0.0 } }":
        {"AU17": 1.0},
    "[expressions]\nmood = { mentalis = 1.0 }\n[action_units]\n"
    "AU17 = { name = 'Chin raiser', muscles = { mentalis = 1.0, corrugator = 0.0 } }": {"AU17": 1.0},
}  # fmt: skip


@pytest.mark.parametrize("own", MOODS)
def test_units_of_expressions_of_ones_own(read, own):
    atlas = read(f'base = "facewrinkle"\n{own}\n')
    assert atlas.units_of({"mood": 1.0}) == pytest.approx(MOODS[own])
    assert atlas.units_of({"mood": 0.5}) == pytest.approx({unit: 0.5 * rate for unit, rate in MOODS[own].items()})


def test_units_are_those_of_an_expression_as_it_is_now():
    atlas = load_atlas()
    other = {**atlas.expressions, "happiness": atlas.contractions("AU4")}
    assert dataclasses.replace(atlas, expressions=other).units_of({"happiness": 0.5}) == {"AU4": 0.5}
    fewer = {name: unit for name, unit in atlas.action_units.items() if name != "AU12"}
    names = {name: title for name, title in atlas.action_unit_names.items() if name != "AU12"}
    without = dataclasses.replace(atlas, action_units=fewer, action_unit_names=names)
    assert without.units_of({"happiness": 1.0})["AU6"] == 1.0


def test_mixtures_take_the_strongest_rate_of_each_muscle():
    atlas = load_atlas()
    mixture = {"AU12": 0.7, "corrugator_l": 0.2, "frowning": 0.5, "AU1": 0.5, "zygomaticus_major_l": 0.9}
    got = atlas.contractions(mixture, 0.5)
    expected = {
        **both("zygomaticus_major", rate=0.35), "zygomaticus_major_l": 0.45,
        **both("frontalis_inner", "corrugator", rate=0.25),
    }  # fmt: skip
    assert got == pytest.approx(expected)


@pytest.mark.parametrize(
    "what",
    ["AU1=.7+AU4", "AU1=.7,AU4", " AU4 + AU1 = 0.7", "au1=7e-1,au4=+1", "AU1=70e-2, AU4=1e+0", {"AU1": 0.7, "AU4": 1}],
)
def test_mixtures_have_one_notation(what):
    brows = {name: 0.7 * rate for name, rate in fw.ACTION_UNITS["AU1"].items()}
    expected = brows | {name: max(rate, brows.get(name, 0.0)) for name, rate in fw.ACTION_UNITS["AU4"].items()}
    assert load_atlas().contractions(what) == pytest.approx(expected)


def test_names_in_a_list_count_whole_and_case_does_not_matter():
    atlas = load_atlas()
    assert atlas.contractions(["AU1", "AU2"]) == atlas.contractions({"AU1": 1.0, "AU2": 1.0})
    assert atlas.contractions("Surprise", 0.5) == atlas.contractions("surprise", 0.5)


def test_names_keep_what_joins_nothing():
    assert split_names("visème_ä+été, jawOpen+") == ["visème_ä", "été", "jawOpen+"]


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("suprise", "Did you mean .*surprise"),
        ("Suprise", "Did you mean .*surprise"),
        ("AU123", "Did you mean .*AU12"),
        ({"corugator": 1.0}, "Did you mean .*corrugator"),
        ({"AU_12": 1.0}, "Did you mean .*AU12"),
        ("AU1++AU2", "unknown expression, action unit or muscle 'AU1.'"),
        ("AU1,", "unknown expression, action unit or muscle ''"),
        ("AU1=+AU4", r"such as AU1=0.7\+AU4; received 'AU1='"),
        ("AU1=a", "received 'AU1=a'"),
        ("AU1=0.5,AU1=0", "AU1 is named twice in 'AU1=0.5,AU1=0'. Give one number"),
        *((what, "is a name, a text such as .*, or a dictionary") for what in (5, [1], ["AU1", 2], None)),
        *(({"AU12": value}, "AU12") for value in (-1e-9, 1.0 + 1e-9, 70.0, np.nan, np.inf, "much", None)),
    ],
)
def test_what_is_no_mixture_is_refused(what, message):
    with pytest.raises(FaceWrinkleError, match=message):
        load_atlas().contractions(what)


@pytest.mark.parametrize("value", [-1e-9, 1.0 + 1e-9, 70.0, np.nan, np.inf, "much", None])
def test_intensities_outside_zero_and_one_are_refused(value):
    with pytest.raises(ParameterError, match="intensity"):
        load_atlas().contractions("AU12", value)


# --- placing ------------------------------------------------------------------------------------


def ends(muscle):
    """The points that define a muscle (k, 3)."""
    names = ("attachment", "insertion", "centre")
    found = [np.atleast_2d(getattr(muscle, name)) for name in names if hasattr(muscle, name)]
    return np.vstack(found) if found else np.empty((0, 3))


def test_muscles_of_mirrored_landmarks_are_mirrored(face):
    mirror = np.diag([-1.0, 1.0, 1.0])
    landmarks = {fw.anatomy.mirrored_name(name): mirror @ point for name, point in face.landmarks.items()}
    placed = load_atlas().place(landmarks, fw.anatomy.frame_of(landmarks))
    for name, muscle in face.muscles.items():
        other = placed[name[:-1] + {"_l": "r", "_r": "l"}[name[-2:]] if name[-2:] in ("_l", "_r") else name]
        np.testing.assert_allclose(ends(other), ends(muscle) @ mirror, atol=1e-11)
        x = (ends(muscle)[0] if len(ends(muscle)) else 0.0) + np.random.default_rng(2).normal(scale=20, size=(200, 3))
        np.testing.assert_allclose(other.force(x @ mirror), muscle.force(x) @ mirror, atol=1e-10)
        if not name.startswith("orbicularis_oris"):
            pattern, other = muscle.fold_pattern, other.fold_pattern
            np.testing.assert_allclose(other.unit_amplitude(x @ mirror), pattern.unit_amplitude(x), atol=1e-9)


def test_the_mouth_folds_alike_on_both_sides(face):
    muscle = face.muscles["orbicularis_oris"].fold_pattern
    centre, frame = np.asarray(muscle.centre), face.frame
    x = np.random.default_rng(2).normal(scale=20, size=(500, 3)) @ frame.axes
    mirrored = x - 2.0 * (x @ frame.axes[0])[:, None] * frame.axes[0]
    assert muscle.unit_amplitude(centre + x).any()
    np.testing.assert_allclose(muscle.unit_amplitude(centre + mirrored), muscle.unit_amplitude(centre + x), atol=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_placing_moves_with_the_landmarks(face, scale):
    turn, shift = Rotation.from_rotvec([0.3, 2.0, -0.5]).as_matrix(), scale * np.array([300.0, -50.0, 8.0])
    landmarks = {name: scale * turn @ point + shift for name, point in face.landmarks.items()}
    frame = fw.anatomy.frame_of(landmarks)
    placed = load_atlas().place(landmarks, frame)
    for name, muscle in face.muscles.items():
        moved, pattern = placed[name], muscle.fold_pattern
        np.testing.assert_allclose(ends(moved), scale * ends(muscle) @ turn.T + shift, rtol=1e-12, atol=1e-9 * scale)
        assert moved.half_wavelength == pytest.approx(scale * muscle.half_wavelength, rel=1e-12)
        assert moved.fold_pattern.half_wavelength == pytest.approx(scale * pattern.half_wavelength, rel=1e-12)
    _, values = load_atlas().tissue_samples(landmarks, frame)
    depth, stiffness, across, bulge = values.T
    assert 1.0 < depth.min() < depth.max() < 25.0
    assert min(stiffness.min(), across.min()) > 0.0
    assert 0.0 <= bulge.min() < bulge.max() <= 1.0


def test_one_entry_is_a_weighted_mean_and_an_offset(read, face):
    marks, frame = face.landmarks, face.frame
    placed = read(
        '[muscles.m]\nkind = "linear"\nradius = 0.1\nmax_angle = 30\n'
        "attachment = { eye_outer = 0.25, mouth = 0.75, offset = [0.5, 0.0, 0.0] }\ninsertion = { nose_tip = 1.0 }\n"
    ).place(marks, frame)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        mean = 0.25 * marks[f"eye_{side}_outer"] + 0.75 * marks[f"mouth_{side}"]
        muscle = placed[f"m_{side}"]
        lateral = sign * frame.axes[0] * 0.5 * frame.pupil_distance
        np.testing.assert_allclose(muscle.attachment, mean + lateral, atol=1e-12)
        np.testing.assert_allclose(muscle.insertion, marks["nose_tip"], atol=1e-12)
        assert muscle.max_angle == pytest.approx(np.pi / 6)
        assert muscle.radius == pytest.approx(muscle.length)  # at least the distance between its ends


def test_muscles_share_named_patterns_of_folds(read, face):
    pattern = """[folds.arcs]
kind = "linear"
attachment = { upper_lip_mid = 1.0 }
insertion = { mouth = 1.0 }
radius = 1.0
max_angle = 40
wrinkles = { count = 2, depth = 0.7, fronts = "round" }
"""
    second = MUSCLE.replace("[muscles.m]", "[muscles.k]") + 'folds = "arcs"\nwrinkles = { depth = 0.2 }\n'
    placed = read(MUSCLE + 'folds = "arcs"\n' + second + pattern).place(face.landmarks, face.frame)
    for side in "lr":
        one, other = placed[f"m_{side}"].fold_pattern, placed[f"k_{side}"].fold_pattern
        assert (one.wrinkles.depth, other.wrinkles.depth, other.wrinkles.count) == (0.7, 0.2, 2)
        np.testing.assert_allclose(one.attachment, face.landmarks["upper_lip_mid"], atol=1e-12)
        np.testing.assert_allclose(other.insertion, face.landmarks[f"mouth_{side}"], atol=1e-12)
    with pytest.raises(UnknownNameError, match="Did you mean 'arcs'"):
        read(MUSCLE + 'folds = "arsc"\n' + pattern)


# --- files of one's own -------------------------------------------------------------------------

MUSCLE = """[muscles.m]
kind = "linear"
attachment = { nasion = 1.0 }
insertion = { mouth = 1.0 }
radius = 1.0
max_angle = 20
"""


def test_an_atlas_of_ones_own(read):
    unit = "[action_units]\nAU99 = { name = 'Test', muscles = { m = 0.5 } }\n"
    atlas = read(MUSCLE + unit + "[expressions]\nodd = { AU99L = 0.5 }\nneutral = {}\n")
    assert set(atlas.muscles) == {"m_l", "m_r"}
    assert atlas.action_units == {"AU99": both("m", rate=0.5), "AU99L": {"m_l": 0.5}, "AU99R": {"m_r": 0.5}}
    assert atlas.action_unit_names == {"AU99": "Test"}
    assert atlas.expressions == {"odd": {"m_l": 0.25}, "neutral": {}}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("nasion = 1.0", "nasion = 0.9", "add up to 0.9"),
        ("mouth = 1.0", "mouht = 1.0", "Did you mean 'mouth'"),
        ("max_angle = 20", "max_angle = 200", "max_angle"),
        ("max_angle = 20", "max_angel = 20", "unknown key 'max_angel'. Did you mean 'max_angle'"),
        ('kind = "linear"', 'kind = "liner"', "unknown kind 'liner'. Did you mean 'linear'"),
        ("radius = 1.0", "radius = 1.0\nwrinkles = { count = 0 }", "number of wrinkles"),
    ],
)
def test_faulty_entries_are_refused_when_placed(read, face, old, new, message):
    with pytest.raises(FaceWrinkleError, match=message):
        read(MUSCLE.replace(old, new)).place(face.landmarks, face.frame)


SHEET = 'base = "facewrinkle"\n[muscles.frontalis_inner]\n'
TISSUE = "[[tissue]]\nat = {{nose_tip = 1.0}}\nstiffness = 1.0\ndepth = {}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"{SHEET}length = {value}", rf"atlas\.muscles\.frontalis_inner\.length must .* received {told}")
        for value, told in (("inf", "inf"), ("nan", "nan"), ("1e30", r"1e\+30"), ("true", "True"), ('"x"', "'x'"),
                            ("1" + 30 * "0", r"1e\+30"))
    ] + [
        (f"{SHEET}kind = 3", r"frontalis_inner\.kind must be a word, received 3"),
        (f"{SHEET}paired = 1", r"frontalis_inner\.paired must be True or False"),
        (f"{SHEET}attachment = [{{nose_tip = true}}]", r"attachment\.nose_tip must be a number, received True"),
        (TISSUE.format('"x"'), r"atlas\.tissue\.depth must be a number, received 'x'"),
        (TISSUE.format("1" + 30 * "0"), r"atlas\.tissue\.depth must lie in"),
        ("a" + 50_000 * ".a" + " = 1", "a name has more than 64 parts"),
        ("x = {" + "a." * 50_000 + "a = 1}", "a name has more than 64 parts"),
        ("x = " + 50_000 * "[", "nested too deeply|not valid TOML"),
        (f'# {"..." * 60}\nbase = "facewrinkle"\nx = [{", ".join(["0.5"] * 200)}]', "unknown table 'x'"),
        ("[muscles.m\n", "not valid TOML"),
        (bytes(range(256)), "is not valid TOML"),
        ("[expressions]\nodd = { m = 1.0 }\n", "in the atlas: unknown expression, action unit or muscle 'm'"),
        (MUSCLE + "[expressions]\nodd = { m = 2.0 }\n", "must lie in"),
        ('base = "mine"', "unknown base of an atlas 'mine'"),
        ('base = "facewrinkle"\n[tisue]\n', "unknown table 'tisue'. Did you mean 'tissue'"),
        ('base = "facewrinkle"\n[tissue]\ndepth = 3.0\n',
         r"tissue must be written as \[\[tissue\]\], once for each sample"),
        ('base = "facewrinkle"\n[[muscles]]\nname = 1\n',
         r"muscles must be written as \[muscles\], with entries by name"),
        *((text, "in the atlas: .*tissue") for text in ("", "tissue = 5", "[[tissue]]\ndepth = 1.0")),
        ('base = "facewrinkle"\n' + TISSUE.format("[]"), r"depth of tissue must be a number, received \[\]"),
    ],
)  # fmt: skip
def test_faulty_files_are_refused(read, face, text, message):
    with pytest.raises(FaceWrinkleError, match=message):
        fw.fit_face(face.mesh, face.landmarks, atlas=read(text))


def test_tissue_is_changed_as_a_whole(read):
    sample = "depth = 3.0\nstiffness = 2.0\nat = { glabella = 1.0 }\n"
    atlas = read(f'base = "facewrinkle"\n[[tissue]]\n{sample}')
    assert atlas.tissue == [{"depth": 3.0, "stiffness": 2.0, "at": {"glabella": 1.0}}]
    assert atlas.muscles == load_atlas().muscles


# --- written and read again -------------------------------------------------------------------------------------------


def test_the_atlas_of_the_package_is_read_again_as_it_is(tmp_path):
    atlas = load_atlas()
    again = read_atlas(write_atlas(atlas, tmp_path / "own.toml"))
    for name in ("muscles", "action_units", "action_unit_names", "expressions", "tissue", "mixtures"):
        assert getattr(again, name) == getattr(atlas, name), name


def test_expressions_keep_the_units_that_they_are_written_in(tmp_path):
    atlas = load_atlas()
    grim = {"contempt": 0.5, "AU4": 1.0}
    own = {**atlas.expressions, "grim": atlas.contractions(grim), "doubt": atlas.contractions("AU15")}
    changed = dataclasses.replace(atlas, expressions=own, mixtures={**atlas.mixtures, "grim": grim})
    again = read_atlas(write_atlas(changed, tmp_path / "own.toml"))
    assert again.expressions == changed.expressions
    for name in own:
        assert again.units_of({name: 1.0}) == changed.units_of({name: 1.0}), name
    assert again.units_of({"grim": 1.0}) == {"AU12R": 0.25, "AU14R": 0.5, "AU4": 1.0}
    assert again.units_of({"doubt": 1.0}) == {"AU15": 1.0}


def test_pairs_are_stated_once():
    content = tomllib.loads(atlas_text(load_atlas()))
    assert "corrugator" in content["muscles"]
    assert not any(name.endswith(("_l", "_r")) for name in content["muscles"])
    assert content["expressions"]["frowning"] == {"corrugator": 1.0}
    assert content["expressions"]["closing_eye"].keys() == {"orbicularis_oculi_l", "orbicularis_oculi_orbital_l"}


@pytest.mark.parametrize("name", ["smirk", "a smile", 'the "wry" one', "back\\slash", "tab\there", "ж", "a.b"])
def test_names_of_any_letters_are_kept(tmp_path, name):
    atlas = load_atlas()
    own = {**atlas.expressions, name: {"zygomaticus_major_l": 0.25, "corrugator_l": 1.0, "corrugator_r": 0.5}}
    again = read_atlas(write_atlas(dataclasses.replace(atlas, expressions=own), tmp_path / "own.toml"))
    assert again.expressions[name] == own[name]


def test_sides_that_differ_have_no_file(tmp_path):
    atlas = load_atlas()
    muscles = {**atlas.muscles, "corrugator_l": {**atlas.muscles["corrugator_l"], "strength": 2.0}}
    with pytest.raises(ParameterError, match="two sides of the muscle corrugator differ"):
        atlas_text(dataclasses.replace(atlas, muscles=muscles))
    one = {name: entry for name, entry in atlas.muscles.items() if name != "corrugator_l"}
    with pytest.raises(ParameterError, match="corrugator_r without its other side"):
        atlas_text(dataclasses.replace(atlas, muscles=one))
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="own.toml"):
        write_atlas(atlas, tmp_path / "file" / "own.toml")
