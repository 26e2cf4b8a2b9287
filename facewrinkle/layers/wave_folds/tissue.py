"""The skin that folds: wavelengths by its thickness, and how far the tissue under it lets it fold."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist
from scipy.special import expit

from ...anatomy import Face, LidMuscle, SheetMuscle, hair_cover, of_side, within
from ...array_types import Array, IntArray
from ...geometry import smoothstep
from ..compression import dyads

OWN, OTHERS = 1.0, 0.5
"""Share of their depth that lines along an anatomical fold, and lines across it, lose where that fold is deepest."""

EDGE = (1.0, 4.0)
"""Distances, mm on a face of average size, from the edge of an opening, or through a flap of skin, up to which there
are no folds, and from which they are whole.
"""

ROLLING, HANGING = 0.9, 0.75
"""Shares of the lines that an upper lid lacks, which rolls in as one fold, and that skin between it and the brow lacks,
which hangs before the hollow of the orbit.
"""

GAP = 0.3
"""Share of the lines that skin between the bellies of the frontalis lacks: captured foreheads are .7 times as wrinkled
over the midline as over the brows.
"""


def thickness(face: Face) -> Array:
    """Return the thickness (n0,) of epidermis and dermis at the base vertices, mm on a face of average size.

    It is interpolated from the landmarks by the inverse fourth power of the distance. There it is that of their region,
    mean of both sexes, by high-frequency ultrasound (PMC9205051): of the forehead, temple, eyelid, back of the nose,
    cheek bone and below the jaw.
    """
    measured = {
        "forehead_mid": 1.22,
        "glabella": 1.22,
        "brow_mid": 1.22,
        "brow_outer": 1.11,
        "eye_outer": 0.80,
        "eye_inner": 0.80,
        "sellion": 1.17,
        "nose_tip": 1.17,
        "malar": 1.20,
        "zygion": 1.11,
        "menton": 1.16,
        "gonion": 1.16,
    }
    names = {of_side(stem, side): value for stem, value in measured.items() for side in "lr"}
    known = {name: value for name, value in names.items() if name in face.landmarks}
    if not known:
        return np.full(len(face.points), 1.15)  # the mean
    squares = cdist(face.points, np.array([face.landmarks[name] for name in known]), "sqeuclidean")
    # Within a squared distance of 0.02, in distances between the pupils, a landmark's own thickness rules.
    weights = 1.0 / (squares / face.frame.pupil_distance**2 + 0.02) ** 2
    return np.asarray(weights @ np.array(list(known.values())) / weights.sum(axis=1))


def wavelengths(face: Face) -> Array:
    """Return the wavelength (n0,) of folds at the base vertices, mm: 5.3 times the thickness of the skin, which is
    6.5 mm on the forehead, as on captured ones, and 4.4 mm beside the eye.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> at = [np.linalg.norm(face.points - face.landmarks[k], axis=1).argmin() for k in ("forehead_mid", "eye_l_outer")]
    >>> wavelengths(face)[at].round(1).tolist()
    [6.5, 4.4]
    """
    return 5.3 * scale_of(face) * thickness(face)


def old_depths(face: Face, age: float) -> Array:
    """Return how deep lines at rest are (n0,), mm, over the root of the compression of the skin in full motion.

    ``1.2 age^(t^2) / t`` with the thickness t of the skin, mm: thin skin has its lines earlier, and deeper ones. On
    people the corners of the eyes age first, and the forehead after the folds that everybody has at the same places
    (Takema and others, Skin Research and Technology 1997).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> at = [np.linalg.norm(face.points - face.landmarks[k], axis=1).argmin() for k in ("forehead_mid", "eye_l_outer")]
    >>> [old_depths(face, age)[at].round(2).tolist() for age in (0.5, 1.0)]
    [[0.31, 0.93], [0.88, 1.47]]
    """
    thick = thickness(face)
    return np.asarray(1.2 * age ** (thick**2) / thick * kept_at_rest(face, face.points))


def kept_at_rest(face: Face, places: Array) -> Array:
    """Return the share (n,) of the depth of their lines at rest that places (n, 3) keep: less between the brows, as old
    people are not cross.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> kept_at_rest(face, np.array([face.landmarks[name] for name in ("glabella", "mouth_l")])).round(2).tolist()
    [0.4, 1.0]
    """
    if "glabella" not in face.landmarks:
        return np.ones(len(places))
    away = np.linalg.norm(places - face.landmarks["glabella"], axis=1) / face.frame.pupil_distance
    return np.asarray(1.0 - 0.6 * np.exp(-((away / 0.3) ** 2)))


def scale_of(face: Face) -> float:
    """Return the size of a face relative to one of average size; 1 without landmarks."""
    return face.frame.scale * face.unit if face.landmarks else 1.0


def firmness(face: Face, some: IntArray | slice = slice(None)) -> Array:
    """Return the share (k,) of its depth that a fold keeps over soft tissue, at edges, on upper lids and under hair, at
    `some` of the base vertices, or at all.

    ``1 / (1 + (h / 7.2)^6)``, with h the depth of the tissue, mm on a face of average size: over the cheek bone folds
    are whole, and thick cheeks bulge as a whole and stay smooth.
    Along the edges of lids, lips and nostrils skin is bound, and what is thin has no room for folds: lids that touch
    would run into each other, and outer sides of lids into their inner sides.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> at = [np.linalg.norm(face.points - face.landmarks[k], axis=1).argmin() for k in ("forehead_mid", "mouth_l")]
    >>> firmness(face)[at].round(1).tolist()
    [0.6, 0.0]
    """
    points, depth = face.points[some], face.tissue.depth[some] * face.unit / scale_of(face)
    firm = np.asarray(1.0 / (1.0 + (depth / 7.2) ** 6))
    for pattern in {id(muscle.folds): muscle.folds for muscle in face.muscles.values() if muscle.folds}.values():
        if pattern.wrinkles.waves:
            firm = np.maximum(firm, pattern.envelope(points))
    firm *= smoothstep((edge_distance(face, some) - EDGE[0]) / (EDGE[1] - EDGE[0]))
    left = (
        (1.0 - HANGING * below_brows(face))
        * (1.0 - GAP * between_bellies(face))
        * (1.0 - ROLLING * np.sqrt(face.shut_lids))
    )
    for name, muscle in face.muscles.items():
        if isinstance(muscle, LidMuscle) and (lid := face.joint_weights.get(name)) is not None:
            rolls = np.clip(np.abs(lid.angles) / max(np.abs(lid.angles).max(initial=0.0), 1e-9), 0.0, 1.0)
            left[lid.vertices] *= 1.0 - ROLLING * np.sqrt(rolls)
    if face.landmarks:  # 2 mm before the hairline lines have half their depth; over 0.7 mm the rest falls by a factor e
        firm *= expit(-(hair_cover(points, face.landmarks, face.frame) + 2.0) / 0.7)
    return np.asarray(firm * left[some])


def between_bellies(face: Face) -> Array:
    """Return the share (n0,) in which skin lies between the two bellies of the frontalis: 1 there, 0 elsewhere.

    They part above the glabella, and only an aponeurosis joins them: lines are weaker there.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> at = [np.linalg.norm(face.points - face.landmarks[k], axis=1).argmin() for k in ("forehead_mid", "brow_l_mid")]
    >>> between_bellies(face)[at].round(1).tolist()
    [1.0, 0.0]
    """
    if not face.landmarks:
        return np.zeros(len(face.points))
    where, low = (face.frame.local_mm(places) for places in (face.points, face.landmarks["glabella"]))
    above = smoothstep((where[:, 1] - low[1]) / 10.0)
    return np.asarray(above * np.exp(-((where[:, 0] / 19.0) ** 2)))  # mm: half the width of the gap


def below_brows(face: Face) -> Array:
    """Return the share (n0,) in which skin hangs between an upper lid and its brow: 1 there, 0 elsewhere.

    Over the orbit there is no bone behind the skin. A brow that is lowered hoods the lid; it does not crumple it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> hanging, names = below_brows(face), ("brow_l_mid", "eye_l_outer", "glabella")
    >>> at = [np.linalg.norm(face.points - face.landmarks[k], axis=1).argmin() for k in names]
    >>> float(hanging.max()), hanging[at].tolist()
    (1.0, [0.0, 0.0, 0.0])
    """
    out = np.zeros(len(face.points))
    for side in "lr":
        names = [of_side(stem, side) for stem in ("eye_inner", "eye_outer", "brow_inner", "brow_mid", "brow_outer")]
        if not all(name in face.landmarks for name in names):
            continue
        size, to_frame = face.frame.pupil_distance, face.frame.axes[:2]
        outwards = np.array([1.0 if side == "l" else -1.0, 1.0])[:, None]
        x, y = outwards * (to_frame @ (face.points - face.frame.origin).T) / size
        xs, ys = outwards * (to_frame @ (np.array([face.landmarks[k] for k in names]) - face.frame.origin).T) / size
        lower, upper = np.interp(x, xs[:2], ys[:2]), np.interp(x, xs[2:], ys[2:])
        rise = (y - lower) / np.maximum(upper - lower, 1e-9)
        # From three quarters of the way up to the brow on, skin is bound to bone again. Beside the outer corner are
        # crow's feet.
        up = smoothstep(rise / 0.25) * smoothstep((1.0 - rise) / 0.25)
        beside = np.maximum(xs[0] - x, x - xs[1] + 0.1) / 0.1
        out = np.maximum(out, up * (1.0 - smoothstep(beside)))
    return out


def edge_distance(face: Face, some: IntArray | slice = slice(None)) -> Array:
    """Return the distance (k,) of `some` of the base vertices, or of all, to the next border of the mesh, or through a
    flap to its other side, mm on a face of average size; larger ones than those that matter may be infinite.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> at = [np.linalg.norm(face.points - face.landmarks[k], axis=1).argmin() for k in ("eye_l_outer", "glabella")]
    >>> edge_distance(face)[at].round(1).tolist()
    [1.7, inf]
    """
    points = face.points_mm / scale_of(face)
    tree, places, normals = cKDTree(points), points[some], face.normals[some]
    out = np.full(len(places), np.inf)
    for depth in (1.5, 3.5):  # at which the other side of a flap is looked for, among the six nearest vertices
        for found in tree.query(places - depth * normals, k=min(6, len(points)))[1].T:
            opposed = np.flatnonzero(np.einsum("nk,nk->n", normals, face.normals[found]) < -0.2)
            other = found[opposed]
            way, facing = points[other] - places[opposed], normals[opposed]
            behind = ((way * facing).sum(axis=1) < 0.0) & ((way * face.normals[other]).sum(axis=1) > 0.0)
            out[opposed[behind]] = np.minimum(out[opposed[behind]], np.linalg.norm(way[behind], axis=1))
    loops = face.boundary_loops
    if loops:
        border = cKDTree(points[np.concatenate(loops)])
        out = np.minimum(out, border.query(places, distance_upper_bound=EDGE[1])[0])
    return out


def grain(face: Face) -> Array:
    """Return the tensor (n0, 6) of the fibers under the skin: ``m m^T`` over a muscle with fibers m, less between.

    Skin that is bound to a sheet of muscle folds across its fibers only: the forehead has no upright lines, whatever
    compresses it. These are the sheets whose lines are drawn as waves (``waves = true`` in the atlas).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> at = np.linalg.norm(face.points - face.landmarks["forehead_mid"], axis=1).argmin()
    >>> up, sideways = grain(face)[at, [1, 0]]
    >>> bool(up > 0.7), bool(sideways < 0.1)
    (True, True)
    """
    total = np.zeros((len(face.points), 6))
    for muscle in face.muscles.values():
        pattern = muscle.fold_pattern
        if not (isinstance(pattern, SheetMuscle) and pattern.wrinkles.waves):
            continue
        inside = np.flatnonzero(pattern.wrinkling_region(face.points))
        fibers = pattern.fold_direction(face.points[inside])
        total[inside] += dyads(fibers)
    return np.asarray(total / np.maximum(total[:, :3].sum(axis=1, keepdims=True), 1.0))


def anatomical(face: Face) -> Array:
    """Return the tensor (n0, 6) of the folds that are drawn by formula: ``s m m^T`` with m across the fold.

    They are those of all muscles whose lines are not drawn as waves; where several overlap, the strongest counts.
    """
    total = np.zeros((len(face.points), 6))
    for muscle in face.muscles.values():
        pattern = muscle.fold_pattern
        if pattern.wrinkles.waves:
            continue
        near = within(face.points, *pattern.reach)
        share = pattern.cover(face.points[near])
        some = np.flatnonzero(share > total[near, :3].sum(axis=1))
        better = near[some]
        across = pattern.fold_direction(face.points[better])
        total[better] = share[some, None] * dyads(across)
    return total
