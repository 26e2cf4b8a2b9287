"""Faces to analyze: the built-in head as random people, and other people's faces beside the repository."""

from __future__ import annotations

import json
import warnings
import zlib
from pathlib import Path

import numpy as np
import pyvista as pv

import facewrinkle as fw

FACES = Path(__file__).parents[2] / "shared" / "faces"
"""Folder of other people's faces; without it only the built-in head is analyzed."""

HEADS, PERSONS = 5, 7
"""Numbers of built-in heads and of captured persons; the first of either is the mean."""

MESHES = {"makehuman": "makehuman_head_male", "mediapipe": "mediapipe_canonical_face_model"}
"""Further faces, and the stems of their files."""


def names() -> tuple[str, ...]:
    """Return the names of all faces at hand.

    Examples
    --------
    >>> names()[:2]
    ('head-0', 'head-1')
    """
    found = [f"head-{k}" for k in range(HEADS)]
    if (FACES / "ict_face_identities.npz").exists():
        found += [f"ict-{k}" for k in range(PERSONS)]
    return (*found, *(name for name, stem in MESHES.items() if (FACES / f"{stem}.obj").exists()))


def generator(seed: int, name: str, *more: int) -> np.random.Generator:
    """Return random numbers that depend on a seed, the name of a face and further numbers alone.

    Examples
    --------
    >>> draws = {float(generator(*spec).random()) for spec in ((0, "a"), (1, "a"), (0, "b"), (0, "a", 0), (0, "a"))}
    >>> len(draws)
    4
    """
    return np.random.default_rng([seed, zlib.crc32(name.encode()), len(more), *more])


def subject(name: str, seed: int = 0) -> fw.Face:
    """Return a face by its name; the seed makes the random people.

    Examples
    --------
    >>> subject("head-1").mesh.n_points == subject("head-0").mesh.n_points
    True
    """
    kind, _, number = name.partition("-")
    if kind == "head":
        person = fw.Identity.random(int(generator(seed, name).integers(2**31))) if int(number) else None
        return fw.default_face(person)
    with warnings.catch_warnings():  # texture seams, and landmarks that have no name here
        warnings.simplefilter("ignore", fw.FaceWrinkleWarning)
        if kind == "ict":
            return _captured(np.zeros(10) if number == "0" else generator(seed, name).normal(size=10))
        path = FACES / f"{MESHES[kind]}.obj"
        return fw.fit_face(path, path.with_suffix(".landmarks.json"))


def _captured(weights: np.ndarray) -> fw.Face:
    """The captured face as the person with these weights (10,) of the modes in which people differ."""
    modes = np.load(FACES / "ict_face_identities.npz")
    mesh = pv.read(FACES / "ict_face_narrow.obj")
    marks = json.loads((FACES / "ict_face_narrow.landmarks.json").read_text(encoding="utf-8"))["landmarks"]
    shift = np.einsum("k,knc->nc", weights, modes["deltas"])
    eyes = np.einsum("k,ksc->sc", weights, modes["eye_centre_deltas"])
    moved = {"eye_l_centre": eyes[0], "eye_r_centre": eyes[1]}
    landmarks = {}
    for name, mark in marks.items():
        offset = moved[name] if name in moved else shift[mark["vertex"]]
        landmarks[name] = np.array(mark["xyz"]) + offset
    mesh.points = np.asarray(mesh.points, np.float64) + shift
    return fw.fit_face(mesh, landmarks, units="cm")
