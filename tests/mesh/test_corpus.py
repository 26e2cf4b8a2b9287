"""Dirty faces in the proportions met in the wild: each is fitted to a sound mesh that moves, or refused.

``python -m tools.trials corpus`` goes through more of them, and finds their landmarks too.
"""

from __future__ import annotations

import hashlib
import struct
import warnings
from collections import Counter
from functools import lru_cache

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleError, FaceWrinkleWarning
from facewrinkle.geometry import topology
from facewrinkle.mesh.repair import areas_doubled
from tools.trials.corpus import FAULTS, clean_faces, crossed, flaws, flaws_in_motion, spoiled, verdict

COUNT, SEED = 18, 2


@lru_cache(maxsize=2)
def dirty_faces(count=COUNT, seed=SEED):
    return [spoiled(count, seed, number) for number in range(count)]


@pytest.mark.slow
def test_the_proportions_are_those_of_the_wild():
    faces = dirty_faces(100, 7)
    counts = Counter(fault for dirty in faces for fault in dirty.faults)
    assert counts == {kind: round(100 * share) for kind, (share, _) in FAULTS.items()}
    used = {name for dirty in faces for name in dirty.name.split(": ")[1].split(", ")}
    assert used >= {way.__name__ for _, ways in FAULTS.values() for way in ways}


def test_the_corpus_is_dirty():
    """The faults that mending is for are in the meshes."""
    kinds = dict.fromkeys(("not manifold", "degenerate", "badly oriented"), 0)
    clean = {name: crossed(*mesh) for name, mesh, _ in clean_faces()}  # lips and lids do
    for dirty in dirty_faces():
        triangles, points = np.asarray(dirty.mesh.regular_faces), np.asarray(dirty.mesh.points)
        if "self-intersecting" in dirty.faults:
            assert crossed(points, triangles) > clean[dirty.name.partition(" ")[2].partition(":")[0]], dirty.name
        proper = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
        kinds["not manifold"] += len(topology.non_manifold_edges(proper)) > 0
        kinds["badly oriented"] += not topology.is_oriented(proper)
        kinds["degenerate"] += areas_doubled(points, triangles).min() < 1e-12 * np.ptp(points, axis=0).max() ** 2
    assert min(kinds.values()) >= 2, kinds


@pytest.mark.slow
@pytest.mark.parametrize("number", range(COUNT))
def test_a_dirty_face_is_fitted_or_refused(number, fingerprint):
    dirty = dirty_faces()[number]
    before = fingerprint(dirty.mesh)
    end, report = verdict(dirty)
    assert end in ("fitted", "refused"), (dirty.name, end, report)
    if end == "refused":  # only those that lack a part of the face
        assert "ragged" in dirty.name, report
    assert fingerprint(dirty.mesh) == before


def test_mended_faces_keep_their_shape():
    """Points stay where they were, but where triangles were turned over, which is reported."""
    kept = 0
    for dirty in dirty_faces():
        if dirty.faults and set(dirty.faults) <= {"not manifold", "degenerate", "badly oriented"}:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FaceWrinkleWarning)
                face = fw.fit_face(dirty.mesh, dirty.landmarks)
            moved = (face.points != np.asarray(dirty.mesh.points)[face.source_points]).any(axis=1)
            flat = [int(line.split()[-1].rstrip(".")) for line in face.report if "turned over" in line]
            assert moved.sum() <= 3 * sum(flat), (dirty.name, face.report)
            kept += not moved.any()
    assert kept >= 2


@pytest.mark.slow
def test_a_dirty_face_is_found():
    dirty = next(d for d in dirty_faces() if d.name.split()[1] == "head:" and d.faults)
    end, report = verdict(dirty, find=True)
    assert end == "fitted", (dirty.name, end, report)


OTHERS = {
    "a sphere inside out": pv.Sphere(theta_resolution=12, phi_resolution=12).flip_faces(),
    "a torus": pv.ParametricTorus(u_res=16, v_res=12, w_res=8),
    "two triangles": pv.Plane(i_resolution=1, j_resolution=1).triangulate(),
    "crossing sheets": pv.Plane().triangulate().append_polydata(pv.Plane(direction=(1, 0, 0)).triangulate()),
    "a tetrahedron": pv.Tetrahedron(),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_shapes_are_surfaces_that_move(name, fingerprint):
    mesh = OTHERS[name]
    before = fingerprint(mesh)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)
        face = fw.surface(mesh)
    assert flaws(face) + flaws_in_motion(face) == []
    assert fingerprint(mesh) == before


def big_index_obj():
    return b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n"


def big_stl():
    return b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50


def saved(ending, **options):
    def write(path):
        pv.Sphere(theta_resolution=8, phi_resolution=8).save(path, **options)
        return path.read_bytes()

    return write, ending


FILES = [
    saved(".stl"), saved(".stl", binary=False), saved(".vtk"), saved(".vtk", binary=False), saved(".vtp"),
    saved(".vtp", binary=False), saved(".vtkhdf"), saved(".ply"), saved(".ply", binary=False),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("write", "ending"), FILES, ids=lambda value: value if isinstance(value, str) else "")
def test_files_that_are_cut_off_or_garbled(tmp_path, write, ending):
    data = write(tmp_path / f"whole{ending}")
    random = np.random.default_rng(len(data))
    for share in (0.02, 0.2, 0.5, 0.9):
        path = tmp_path / f"cut{share}{ending}"
        path.write_bytes(data[: int(share * len(data))])
        _read_or_refused(path)
    for k in range(6):
        garbled = bytearray(data)
        for place in random.integers(0, len(data) if k % 2 else min(500, len(data)), 1 + 3 * k):
            garbled[place] = random.integers(256)
        path = tmp_path / f"garbled{k}{ending}"
        path.write_bytes(bytes(garbled))
        _read_or_refused(path)


def _read_or_refused(path):
    before = hashlib.sha256(path.read_bytes()).hexdigest()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)
        try:
            face = fw.surface(path)
        except FaceWrinkleError:
            face = None
    assert face is None or len(face.triangles) > 0
    assert hashlib.sha256(path.read_bytes()).hexdigest() == before


@pytest.mark.parametrize(
    ("name", "data"), [("a.obj", big_index_obj()), ("a.stl", big_stl()), ("a.obj", b"\x89PNG\r\n\x1a\n" + bytes(99))]
)
def test_files_that_lie(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FaceWrinkleError, match=name):
        fw.fit_face(tmp_path / name)
