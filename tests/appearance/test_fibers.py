"""Fibers of muscles.

where they are        | under the skin, not deeper than the bone; sheets and rings by the numbers of their muscles
how they move         | origins with the bone: the skull, or the mandible as its teeth go; insertions with the skin
in pictures           | over the muscle that contracts, redder; not through the head
without muscles       | none
"""

import numpy as np
import pytest
import pyvista as pv
from drawing import held
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.appearance.fibers import Fibers
from facewrinkle.appearance.seen import Appearance


def of(fibers, name):
    return fibers.muscle == fibers.names.index(name)


def test_fibers_lie_between_skin_and_bone(face):
    fibers = Fibers.of(face)
    lines = fibers.at(face.mesh)
    depth, vertex = cKDTree(face.points).query(lines[:, 1:-1])
    under = ((lines[:, 1:-1] - face.points[vertex]) * face.tissue.normals[vertex]).sum(axis=-1)
    assert (under < 0.0).mean() > 0.95  # all, but for smoothing
    assert np.percentile(under, 99) < 1.0
    assert np.percentile(depth / face.tissue.depth[vertex], 95) < 1.3
    pulling = {name for name, muscle in face.muscles.items() if np.any(muscle.force(face.points))}
    assert set(fibers.names) == pulling


def test_fibers_of_a_sheet_go_from_line_to_line_and_rings_around_their_centre(face):
    fibers, muscle = Fibers.of(face), face.muscles["frontalis_outer_l"]
    lines = fibers.at(face.mesh)[of(fibers, "frontalis_outer_l")]
    for ends, line in ((lines[:, 0], muscle.attachment), (lines[:, -1], muscle.insertion)):
        normal = face.tissue.normals[cKDTree(face.points).query(line, k=6)[1]].mean(axis=1)
        moved = ends[[0, -1]] - line  # into the flesh, and hardly along the skin
        across = np.linalg.norm(np.cross(moved, normal), axis=1)
        assert (across < 0.2 * np.linalg.norm(moved, axis=1)).all()
    ring = face.muscles["orbicularis_oris"]
    along, _ = ring.coordinates(fibers.at(face.mesh)[of(fibers, "orbicularis_oris")].reshape(-1, 3))
    assert ring.inner - 0.2 < along.min() < along.max() < 1.2


def test_insertions_go_with_the_skin_and_origins_stay(face):
    fibers, smile = Fibers.of(face), held("AU12")
    lines = fibers.at(face.mesh)[of(fibers, "zygomaticus_major_l")]
    moved = fibers.at(smile)[of(fibers, "zygomaticus_major_l")] - lines
    vertex = cKDTree(face.points).query(lines[:, -1])[1]
    skin = np.asarray(smile.points)[: face.mesh.n_points] - face.points
    assert np.abs(moved[:, 0]).max() == 0.0
    assert np.linalg.norm(moved[:, -1], axis=1).max() > 4.0
    assert np.abs(moved[:, -1] - skin[vertex]).max() < 2.0  # that of the nearest vertex, of those at hand
    assert moved[:, 6] == pytest.approx(6 / 13 * moved[:, -1])


def test_origins_on_the_mandible_go_with_its_teeth(face):
    fibers, teeth, origins = Fibers.of(face), [], []
    for unit in ("AU26", "AU27"):
        teeth.append(np.asarray(Appearance.of(face).at(held(unit)).inside_mouth["lower_teeth"].points, float))
        origins.append(fibers.at(held(unit))[:, 0])
    turn, _ = Rotation.align_vectors(teeth[1] - teeth[1].mean(axis=0), teeth[0] - teeth[0].mean(axis=0))
    carried = turn.apply(origins[0] - teeth[0].mean(axis=0)) + teeth[1].mean(axis=0)
    for name, moved in (("depressor_labii_inferioris_l", carried), ("zygomaticus_major_l", origins[0])):
        mine = of(fibers, name)
        assert origins[1][mine] == pytest.approx(moved[mine], abs=1e-2)
    assert np.linalg.norm(carried - origins[0], axis=1).min() > 1.0


def test_fibers_are_seen_and_redder_where_they_contract(face):
    with fw.plotting.Scene(face, fw.plotting.Style((240, 300), "left_profile", brows=False)) as scene:
        plain = scene.picture(face.mesh).astype(float)
        scene.show_muscles(face.mesh, {})
        relaxed = scene.picture(face.mesh).astype(float)
        scene.show_muscles(face.mesh, {"zygomaticus_major_l": 1.0})
        left = scene.picture(face.mesh).astype(float)
        scene.show_muscles(face.mesh, {"zygomaticus_major_r": 1.0})
        right = scene.picture(face.mesh).astype(float)
    assert (np.abs(relaxed - plain).max(axis=2) > 10.0).sum() > 300
    other = np.abs(left - relaxed).max(axis=2) > 20.0
    assert other.sum() > 100
    assert (left - relaxed)[other][:, 1].max() < 0.0  # less green
    assert np.array_equal(right, relaxed)  # it is on the other side of the head


def test_a_surface_without_muscles_has_no_fibers():
    sheet = fw.surface(pv.Plane(i_resolution=4, j_resolution=4).triangulate())
    fibers = Fibers.of(sheet)
    assert fibers.names == []
    assert fibers.at(sheet.mesh).shape == (0, *fibers.half.shape[1:], 3)
