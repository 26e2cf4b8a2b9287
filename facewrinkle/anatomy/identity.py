"""Identity of a face: parameters in an artist's words that move the cage of the built-in head, and color it."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..array_types import Array
from ..errors import ParameterError, check_name, check_range, check_whole
from ..geometry import BoxTree, smoothstep
from .eyeball import eye_distance
from .head import DATA, HAIR_COLOR, Head, cage_data, load_head, pair_of_eyes
from .landmarks import FaceFrame

COLORS = ("skin", "hair", "hair_density", "iris", "hair_length", "beard", "hair_combed")
"""Parameters that do not change the shape of the head."""

TONES = np.array(
    # the value of `skin`, red, green and blue of the forehead
    [
        (-1.0, 239, 202, 177), (-0.75, 234, 195, 169), (-0.5, 228, 188, 159), (-0.25, 222, 181, 151),
        (0.0, 216, 174, 145), (0.2, 195, 150, 119), (0.4, 174, 128, 97), (0.6, 151, 106, 79), (0.8, 126, 86, 65),
        (1.0, 98, 69, 54),
    ]
)  # fmt: skip
"""Ten tones in the order of the Monk Skin Tone Scale (E. Monk, Google, 2022); the fifth is the mean head.

Its swatches, from L* 94 to 14, are what a chart shows, not what skin reflects: in the light of a scene they would be
chalk and coal. These run in even steps of L* through the classes of skin by the angle arctan((L* - 50) / b*) (A.
Chardon, I. Cretois and C. Hourseau, Int. J. Cosmetic Science 13, 1991), from very light, above 55 degrees, to dark,
below -30.
"""

CHILDS_FOLDS, YOUNG_FOLDS = 0.25, 0.6
"""Depth of the folds of a child, and of a face of age -1, relative to those of an adult."""

EVEN = (*COLORS, "age", "eye_fold")
"""Parameters of which random people have all values alike; the others are mostly near the mean, as measures are."""


@dataclass(frozen=True)
class Identity:
    """A person: every parameter is in [-1, 1]; 0 is the mean head.

    Parameters
    ----------
    width : float
        From a narrow to a wide head.
    length : float
        From a short to a long face.
    jaw : float
        From a narrow to a square jaw.
    chin : float
        From a receding to a strong chin.
    nose_length, nose_width : float
        From a short to a long nose that stands out, and from a narrow nose with a high bridge to a broad, low one.
    mouth : float
        From a narrow to a wide mouth.
    brow : float
        From a flat to a heavy ridge above the eyes, and from high to low brows.
    eye_spacing : float
        From close to wide-set eyes.
    eye_fold : float
        From a deep crease of the upper lid to none, with a fold over the inner corner of the eye, and the outer one
        higher.
    lips : float
        From thin to full lips.
    cheeks : float
        From hollow cheeks and a thin neck to full cheeks and a double chin.
    age : float
        From younger to older: brows, cheeks and jowls sag, cheeks and temples sink, lips get thinner, folds deeper.
    sex : float
        From feminine, with full lips, high, thin brows and longer cropped hair, to masculine: larger, with a long
        face, strong jaw, chin, nose and brow ridge, lean cheeks and a broad neck.
    child : float
        From mature proportions to those of a child: a small head with eyes of full size, a short face, a small nose, a
        narrow jaw, full cheeks.
    skin : float
        From fair to dark skin, through the ten tones of the Monk Skin Tone Scale; see :attr:`monk`.
    hair : float
        From fair to black hair; with `age` it turns gray, and on masculine heads recedes.
    hair_density : float
        From a shaved head to dense hair; if it is long, from fine, straight hair to full waves.
    iris : float
        From blue over gray to dark brown irises.
    hair_length : float
        Up to 0 hair is cropped, from short to longer; above, it falls from a parting, over the ears, from a bob to
        layers, and at 1 down the neck, or is tied back: see `hair_combed`.
    nose_bridge : float
        From a low, scooped bridge of the nose to a high one with a hump.
    nose_tip : float
        From an upturned tip of the nose to a drooping one.
    nose_bulb : float
        From a fine tip of the nose to a bulbous one.
    upper_lip : float
        From a thin upper lip above a full lower one to the opposite.
    philtrum : float
        From a short philtrum with a deep groove, above a marked bow of the lip, to a long, flat one.
    cheekbones : float
        From flat to prominent cheekbones.
    ears : float
        From small, close ears to large ones that stand out.
    beard : float
        Up to 0 none; above, from stubble to a full beard in the color of the hair.
    hair_combed : float
        From a crop that is longer on top and combed aside, past one that is as long all over, to one that is combed
        back; the thinner it is, the less. Long hair has a fringe over the forehead, the less, the nearer to 0, where it
        falls behind the cheeks; above 0 it is tied at the back, the higher, the greater: in a knot up to a
        `hair_length` of 0.4, else in a tail.
    eye_slant : float
        From low to high outer corners of the eyes.
    brow_arch : float
        From straight to arched brows.
    mouth_corners : float
        From low to high corners of the mouth.
    nose_wings : float
        From high wings of the nose, which show its septum, to low ones.

    Raises
    ------
    ParameterError
        If a value lies outside [-1, 1].

    Examples
    --------
    >>> Identity(jaw=0.5, age=1.0).jaw
    0.5
    """

    width: float = 0.0
    length: float = 0.0
    jaw: float = 0.0
    chin: float = 0.0
    nose_length: float = 0.0
    nose_width: float = 0.0
    mouth: float = 0.0
    brow: float = 0.0
    eye_spacing: float = 0.0
    eye_fold: float = 0.0
    lips: float = 0.0
    cheeks: float = 0.0
    age: float = 0.0
    sex: float = 0.0
    child: float = 0.0
    skin: float = 0.0
    hair: float = 0.0
    hair_density: float = 0.0
    iris: float = 0.0
    hair_length: float = 0.0
    nose_bridge: float = 0.0
    nose_tip: float = 0.0
    nose_bulb: float = 0.0
    upper_lip: float = 0.0
    philtrum: float = 0.0
    cheekbones: float = 0.0
    ears: float = 0.0
    beard: float = 0.0
    hair_combed: float = 0.0
    eye_slant: float = 0.0
    brow_arch: float = 0.0
    mouth_corners: float = 0.0
    nose_wings: float = 0.0

    def __post_init__(self) -> None:
        for name, value in dataclasses.asdict(self).items():
            object.__setattr__(self, name, check_range(name, value, -1.0, 1.0, "0 is the mean head."))

    @classmethod
    def of(cls, what: Identity | Mapping[str, float] | None) -> Self | Identity:
        """Return an identity from parameters by name; the mean one from None.

        Raises
        ------
        UnknownNameError
            For a name that is no parameter; the nearest names are suggested.
        ParameterError
            For a value outside [-1, 1], or if `what` is not a dictionary.

        Examples
        --------
        >>> Identity.of({"nose_length": -0.5}).nose_length
        -0.5
        """
        if isinstance(what, Identity):
            return what
        if what is not None and not isinstance(what, Mapping):
            raise ParameterError(f"an identity is an Identity or a dictionary of names and numbers, received {what!r}.")
        known = [f.name for f in dataclasses.fields(cls)]
        for name in what or {}:
            check_name("parameter of an identity", name, known)
        return cls(**(what or {}))

    @classmethod
    def random(cls, seed: int | None = None, spread: float = 0.9) -> Self:
        """Return a random person, with all parameters in [-spread, spread]; the same for the same seed.

        Half are women and half men, whose measures differ and spread as people's do; one in ten is a child, most women
        have long hair, and the colors are :meth:`plausible`.

        Examples
        --------
        >>> Identity.random(7) == Identity.random(7), Identity.random(7) == Identity.random(8)
        (True, False)
        """
        check_range("spread", spread, 0.0, 1.0)
        if seed is not None:
            seed = check_whole("seed", seed, 0, 2**63)
        random = np.random.default_rng(seed)

        def values_of(names: list[str]) -> dict[str, float]:
            usual = random.normal(0.0, 0.5 * spread, len(names)).clip(-spread, spread)
            even = random.uniform(-spread, spread, len(names))
            return dict(zip(names, np.where(np.isin(names, EVEN), even, usual).tolist(), strict=True))

        names = [field.name for field in dataclasses.fields(cls)]
        # These many are drawn before all others: parameters that come later change nobody's.
        first, last = 20, names.index("hair_combed")
        drawn = values_of(names[:first])
        sex, child = spread * random.power(3.0, 2)  # few are in between
        drawn["sex"] = float(np.copysign(sex, drawn["sex"]))
        drawn["child"] = float(child) if random.random() < 0.1 else 0.0
        drawn |= values_of(names[first:last])
        # Men's is cropped to any length, and most women's is long.
        drawn["hair_length"] = float(np.clip(0.6 * (drawn["hair_length"] - drawn["sex"]), -spread, spread))
        drawn["hair_combed"] = float(random.uniform(-spread, spread))
        drawn |= values_of(names[last + 1 :])
        return cls(**drawn).plausible()

    @property
    def monk(self) -> int:
        """The tone of the skin on the Monk Skin Tone Scale, from 1, the fairest, to 10.

        Examples
        --------
        >>> [Identity(skin=skin).monk for skin in (-1.0, 0.0, 0.35, 1.0)]
        [1, 5, 7, 10]
        """
        return 1 + int(np.abs(TONES[:, 0] - self.skin).argmin())

    def plausible(self) -> Self:
        """Return the person with hair and irises that are no fairer than the skin, and parts that go together.

        Children look young, and boys and girls alike. A head is at most by 1 wider than long, and so is a nose. The
        more masculine, the shorter the hair may be, at most 0.5 less `sex`, and the fuller the beard; children have
        none.

        Examples
        --------
        >>> Identity(skin=0.5, hair=-1.0, child=0.8).plausible()
        Identity(..., sex=0.0, child=0.8, skin=0.5, hair=0.5, ..., beard=-0.8, ...)
        """
        child = max(self.child, 0.0)
        age = min(self.age, -child) if child > 0.0 else self.age
        sex = float(np.clip(self.sex, child - 1.0, 1.0 - child))
        head = 0.5 * max(self.width - self.length - 1.0, 0.0)
        nose = 0.5 * max(self.nose_width - self.nose_length - 1.0, 0.0)
        return dataclasses.replace(
            self,
            width=self.width - head,
            length=self.length + head,
            nose_width=self.nose_width - nose,
            nose_length=self.nose_length + nose,
            sex=sex,
            hair=max(self.hair, self.skin),
            iris=max(self.iris, self.skin),
            age=age,
            hair_length=min(self.hair_length, 0.5 - sex),
            beard=min(self.beard, -child if child > 0.0 else sex),
        )


def head_of(identity: Identity) -> Head:
    """The built-in head of a person: the same triangles and texture coordinates, moved with its landmarks and eyes.

    Examples
    --------
    Distance of the angle of the jaw from the middle, mm, from a narrow to a square jaw:

    >>> [round(float(head_of(Identity(jaw=jaw)).landmarks["gonion_l"][0])) for jaw in (-1.0, 0.0, 1.0)]
    [55, 60, 66]
    """
    mean = load_head()
    if identity == Identity():
        return mean
    weights, data = _weights(identity), cage_data()
    cage = np.array(list(data["points"].values()))
    left = mean.eyes[0]
    shift, eye_shift = _shifts(weights, list(data["points"]), cage, left.centre)
    centre = left.centre + eye_shift
    points = mean.mold(cage + shift, centre, left.radius)
    if identity.age > 0.0:
        points += identity.age * aged_flesh(mean.points, eye_distance(mean.points, mean.eyes))
    cells, shares, _ = BoxTree(mean.points, mean.triangles).closest(np.array(list(mean.landmarks.values())))
    places = np.einsum("nc,nci->ni", shares, points[mean.triangles[cells]])
    landmarks = dict(zip(mean.landmarks, places, strict=True))
    eyes = pair_of_eyes(centre, left.radius)
    landmarks |= {f"eye_{eye.side}_centre": eye.centre for eye in eyes}
    thin = 0.45 * max(-identity.sex, identity.child, 0.0)  # share of the hairs that brows of women and children lack
    head = dataclasses.replace(mean, points=points, landmarks=landmarks, eyes=eyes, brows=mean.brows.thinned(thin))
    # Scalp is seen between the hairs of short cuts, and where hair is parted or tied back.
    bare = 0.25 * (1.0 if identity.hair_length > 0.0 else -identity.hair_length)
    graying = 0.2  # the age at which hair begins to turn gray
    if identity.skin == identity.hair == identity.hair_density == bare == 0.0 and identity.age <= graying:
        return head
    at, *channels = TONES.T
    skin = np.array([np.interp(identity.skin, at, channel) / np.interp(0.0, at, channel) for channel in channels])
    # Factors of red, green and blue of the fairest and of the darkest hair.
    tint = np.array([0.55, 0.6, 0.65] if identity.hair > 0.0 else [3.1, 3.0, 2.5]) ** abs(identity.hair)
    old = float(smoothstep((identity.age - graying) / (1.0 - graying)))
    # At age 1, 85 % of hair is gray, and 90 % of its border is bare on a masculine head.
    gray, border = 0.85 * old, 0.9 * max(old * identity.sex, 0.0)
    # Brows are as dark as hair, but half as fair, and turn gray less and later: until then they have at most 60 % of
    # the color of the forehead.
    own = np.minimum(np.minimum(tint, np.sqrt(tint)) * mean.brows.color, 0.6 * skin * TONES[4, 1:])
    strands, brows = (
        (1.0 - share) * color + share * np.array([152.0, 145.0, 136.0])
        for color, share in ((tint * HAIR_COLOR, gray), (own, 0.5 * gray**2))
    )
    color, texture = (
        dataclasses.replace(paint, tint=skin, hair=strands, density=identity.hair_density, border=border, bare=bare)
        for paint in mean.paint
    )
    return dataclasses.replace(head, paint=(color, texture), brows=dataclasses.replace(head.brows, color=brows))


def _weights(identity: Identity) -> dict[str, float]:
    """Parameters of the shape of the head that are not 0, with what goes with others."""
    weights = {name: value for name, value in dataclasses.asdict(identity).items() if value and name not in COLORS}
    parameters = _typed()["parameters"]
    for name, weight in list(weights.items()):
        for other, share in parameters[name].get("of", {}).items():
            weights[other] = weights.get(other, 0.0) + weight * share
    return weights


def _shifts(weights: Mapping[str, float], names: list[str], cage: Array, eye: Array) -> tuple[Array, Array]:
    """Displacements (c, 3) of the left half's cage points and (3,) of the left eyeball."""
    typed, named = _typed(), dict(zip(names, cage, strict=True))
    places = np.vstack([cage, eye])
    shift = np.zeros_like(places)
    for name, weight in weights.items():
        move = typed["parameters"][name]
        handled = _handled(move["handles"], named, places)
        shift += weight * (np.array(move["stretch"]) * (places - typed["origin"]) + handled)
    # The eyeball and what lies on it move in one piece, or the lids would not fit.
    inner, outer = typed["socket"]
    free = smoothstep((np.linalg.norm(places - eye, axis=1) - inner) / (outer - inner))[:, None]
    turn = np.radians(sum(weight * typed["parameters"][name].get("turn", 0.0) for name, weight in weights.items()))
    turned = (places - eye) @ Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix().T - (places - eye)
    shift += (1.0 - free) * (shift[-1] + turned - shift)
    for name, weight in weights.items():
        for point, offset in typed["parameters"][name]["points"].items():
            shift[names.index(point)] += weight * np.array(offset)
    shift[:-1][cage[:, 0] == 0.0, 0] = 0.0
    return shift[:-1], shift[-1]


def aged_flesh(places: Array, away: Array) -> Array:
    """Return how far flesh goes with the years: displacements (n, 3) of places on the mean head from age 0 to 1, mm.

    Brows, cheeks and jowls sag, temples and hollows sink, ears grow. `away` (n,) tells how far places are from the
    nearest middle of an eyeball, in its radii: what lies on eyeballs stays.

    Examples
    --------
    >>> brow = load_head().landmarks["brow_l_outer"]
    >>> aged_flesh(np.array([brow, brow]), np.array([2.0, 1.0]))[:, 1].round()
    array([-2., -0.])
    """
    cage = {name: np.array(place) for name, place in cage_data()["points"].items()}
    stays, goes = 1.17, 1.76  # up to the first distance skin stays, and from the second on it goes whole
    free = smoothstep((away - stays) / (goes - stays))
    return free[:, None] * _handled(_typed()["flesh"], cage, places)


def _typed() -> dict[str, Any]:
    """How the parameters move the cage, as it was typed."""
    return dict(json.loads((DATA / "identity.json").read_text(encoding="utf-8")))


def _handled(handles: Sequence[tuple[str, float, Array]], cage: Mapping[str, Array], places: Array) -> Array:
    """Displacements (n, 3) of places by handles: the cage point of each, its reach, and how far it is moved."""
    shift = np.zeros_like(places)
    for handle, reach, offset in handles:
        for side in (1.0, -1.0) if cage[handle][0] != 0.0 else (1.0,):
            mirror = np.array([side, 1.0, 1.0])
            near = np.exp(-((np.linalg.norm(places - cage[handle] * mirror, axis=1) / reach) ** 2))
            shift += near[:, None] * (offset * mirror)
    return shift


def hair_cover(points: Array, landmarks: Mapping[str, Array], frame: FaceFrame) -> Array:
    """Signed distance (n,) of points (n, 3) from the hairline along the head; positive where hair grows.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> marks = face.landmarks
    >>> crown = marks["trichion"] + [0, 60, -60]
    >>> hair_cover(np.array([crown, marks["nose_tip"]]), marks, face.frame) > 0
    array([ True, False])
    """
    where = frame.local_mm(points)
    ear, top = frame.local_mm(landmarks["zygion_l"]), frame.local_mm(landmarks["trichion"])
    # The upright axis of the head lies 12 mm behind the zygion.
    azimuth = np.degrees(np.arctan2(np.abs(where[:, 0]), where[:, 2] - ear[2] + 12.0))
    line = np.array(
        # over the forehead, down the temple before the ear, and around the ear to the nape: azimuth from the front,
        # degrees, and height above the eyes
        [
            *((0, 62), (10, 62.5), (20, 64), (29, 63), (36, 57), (42, 46), (48, 32), (55, 24), (60, 18), (63, 10)),
            *((66, 1), (70, -7), (76, -13), (90, -14), (94, -6), (96, 4), (99, 10), (105, 13), (112, 13), (118, 8)),
            *((121, -2), (122, -18), (126, -36), (134, -52), (150, -62), (168, -67), (180, -68)),
        ],
        dtype=np.float64,
    )
    # The line follows the trichion up to an azimuth of 30 degrees and the zygion from 60 on, which is 16 mm below the
    # eyes on the built-in head.
    share = smoothstep((line[:, 0] - 30.0) / 30.0)
    line[:, 1] += (1.0 - share) * (top[1] - line[0, 1]) + share * (ear[1] + 16.0)
    radius = 80.0  # at which azimuths are measured as lengths, mm
    flat = np.radians(azimuth) * radius
    line[:, 0] = np.radians(line[:, 0]) * radius
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    dense = np.linspace(0.0, along[-1], 600)
    curve = np.stack([np.interp(dense, along, line[:, c]) for c in range(2)], axis=1)
    away = cKDTree(curve).query(np.stack([flat, where[:, 1]], axis=1))[0]
    below = where[:, 1] < np.interp(flat, *line.T)
    return np.asarray(np.where(below, -away, away))


def childlike(landmarks: Mapping[str, Array], frame: FaceFrame) -> float:
    """Return how childlike the proportions of a face are, from 0 (an adult's) to 1 (an infant's).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> small = {"width": 0.5, "length": -1.0, "nose_length": -1.0, "chin": -1.0, "jaw": -1.0, "age": -1.0}
    >>> faces = fw.default_face(), fw.default_face(small)
    >>> [round(childlike(face.landmarks, face.frame), 1) for face in faces]
    [0.0, 1.0]
    """
    height = np.linalg.norm(landmarks["nasion"] - landmarks["menton"]) / frame.pupil_distance
    out = (landmarks["nose_tip"] - landmarks["subnasale"]) @ frame.axes[2] / frame.pupil_distance
    child, adult = 0.24, 0.31  # of the product, which grows with the years: 0.31 to 0.51 on thirty-two labeled faces
    return float(smoothstep((adult - height * max(out, 0.0)) / (adult - child)))


def fold_depth(landmarks: Mapping[str, Array], frame: FaceFrame, age: float) -> float:
    """Return the depth of the folds of a face relative to those of an adult.

    Parameters
    ----------
    landmarks : mapping of str to ndarray, shape (3,)
    frame : FaceFrame
    age : float
        From -1 (young) to 1 (old); from 0 on it makes no difference.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> [round(fold_depth(face.landmarks, face.frame, age), 2) for age in (-1.0, 0.0, 1.0)]
    [0.6, 1.0, 1.0]
    """
    young = 1.0 - (1.0 - YOUNG_FOLDS) * max(-age, 0.0)
    return young * (1.0 - (1.0 - CHILDS_FOLDS) * childlike(landmarks, frame))
