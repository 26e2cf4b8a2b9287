"""Folds that run through each other; long runs that are stopped and go on, whatever becomes of their processes;
dirty faces, and meshes to try things on; ``python -m tools.trials corpus`` goes through more of them, and finds
their landmarks too.
"""

import os
import time
import warnings
from functools import lru_cache

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from tools.trials import runner
from tools.trials.corpus import clean_faces, crossed, flaws, flaws_in_motion, spoiled, verdict
from tools.trials.crossings import AGES, Folded, _near, poses
from tools.trials.runner import DIED, run


def test_poses_are_units_and_expressions_alone_and_then_all_pairs(face):
    alone, every = poses(face, alone=True), poses(face)
    assert {len(pose) for pose in alone} == {1}
    assert every[: len(alone)] == alone
    both = [name for (name,) in alone if not (name.startswith("AU") and name[-1] in "LR")]
    assert len(every) - len(alone) == len(both) * (len(both) - 1) // 2
    assert poses(face) == every


def test_places_near_others():
    places, others = np.array([[0.0, 0, 0], [5, 0, 0]]), np.array([[0.5, 0, 0]])
    assert _near(places, others).tolist() == [True, False]
    assert not _near(places, np.empty((0, 3))).any()


@pytest.mark.slow
def test_surprise_turns_nothing_over_and_nothing_runs_through_itself():
    folded = Folded(fw.default_face())
    folded.pose(("paper_surprise",))
    for age in AGES:
        found = folded.measured(age)
        assert found["deep"] > 0.5
        assert found["turned"] == found["crossing"] == 0
        assert abs(found["net"]) < 0.01


# --- long runs that are stopped and go on ----------------------------------------------------------


def test_a_run_goes_on_where_it_was(tmp_path, monkeypatch):
    path = tmp_path / "some" / "run.jsonl"
    cases = [(7, 2), (9, 4), (5, 5)]
    assert run(path, divmod, cases[:2]) == {(7, 2): [3, 1], (9, 4): [2, 1]}
    lines = path.read_text().splitlines(keepends=True)
    path.write_text(lines[0].replace("[3, 1]", '"kept"') + lines[1][:30])  # killed as it wrote
    assert run(path, divmod, cases, workers=2) == {(7, 2): "kept", (9, 4): [2, 1], (5, 5): [1, 0]}
    assert run(path, divmod, [(9, 4), (1, 1)], minutes=0) == {(9, 4): [2, 1]}
    monkeypatch.setattr(runner, "code", lambda: "other")
    assert run(path, divmod, cases[:1]) == {(7, 2): [3, 1]}


@pytest.mark.slow
@pytest.mark.parametrize(("play", "case"), [(os._exit, 3), (time.sleep, 60)])
def test_what_a_process_does_not_come_back_from_is_an_outcome(tmp_path, play, case):
    path = tmp_path / "run.jsonl"
    assert run(path, play, [(case,)], seconds=1) == {(case,): DIED}
    assert path.read_text().count(DIED) == 1


# --- dirty faces in the proportions met in the wild: each is fitted to a sound mesh that moves, or refused


COUNT, SEED = 18, 2


@lru_cache(maxsize=2)
def dirty_faces(count=COUNT, seed=SEED):
    return [spoiled(count, seed, number) for number in range(count)]


@pytest.mark.slow
def test_the_corpus_is_dirty():
    """The faults that mending is for are in the meshes."""
    kinds = dict.fromkeys(("not manifold", "degenerate", "badly oriented", "self-intersecting"), 0)
    clean = {name: crossed(*mesh) for name, mesh, _ in clean_faces()}  # lips and lids do
    for dirty in dirty_faces():
        triangles, points = np.asarray(dirty.mesh.regular_faces), np.asarray(dirty.mesh.points)
        if "self-intersecting" in dirty.faults:  # but where the pinched skin was torn away
            of_clean = clean[dirty.name.partition(" ")[2].partition(":")[0]]
            kinds["self-intersecting"] += crossed(points, triangles) > of_clean
        proper = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
        kinds["not manifold"] += len(fw.geometry.topology.non_manifold_edges(proper)) > 0
        kinds["badly oriented"] += not fw.geometry.topology.is_oriented(proper)
        kinds["degenerate"] += (
            fw.geometry.double_areas(points, triangles).min() < 1e-12 * np.ptp(points, axis=0).max() ** 2
        )
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


@pytest.mark.slow
def test_mended_faces_keep_their_shape():
    """Points stay where they were, but at triangles that were turned over, which is reported, and neighbors."""
    kept = 0
    for dirty in dirty_faces():
        if dirty.faults and set(dirty.faults) <= {"not manifold", "degenerate", "badly oriented"}:
            with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
                face = fw.fit_face(dirty.mesh, dirty.landmarks)
            moved = (face.points != np.asarray(dirty.mesh.points)[face.source_points]).any(axis=1)
            flat = [int(line.split()[-1].rstrip(".")) for line in face.report if "turned over" in line]
            assert moved.sum() <= 4 * sum(flat), (dirty.name, face.report)
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
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        face = fw.surface(mesh)
    assert flaws(face) + flaws_in_motion(face) == []
    assert fingerprint(mesh) == before


# --- the meshes to try things on -------------------------------------------------------------------


def test_the_pig_is_closed_and_turned_outwards():
    pig = fw.examples.load_pig()
    assert (pig.n_cells, pig.n_points - pig.n_cells // 2, pig.n_open_edges) == (16_000, 2, 0)  # Euler: a sphere
    assert pig.volume > 0


def test_each_call_makes_a_mesh_of_its_own():
    fw.examples.load_pig().points[:] = 0
    assert fw.examples.load_pig().length > 300
