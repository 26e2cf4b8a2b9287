"""Brows and lashes: they go with the skin, and stay on it."""

from itertools import pairwise

import numpy as np
import pytest
from drawing import held
from eyelids_of_faces import rims

from facewrinkle.anatomy.face import Face
from facewrinkle.appearance.hair import Brows, Lashes
from facewrinkle.mesh import to_polydata


def test_lashes_stay_on_the_margins_of_the_lids(face):
    """Within the thickness of a lid, open and closed; the upper ones come down with theirs."""
    open_eyes, closed = face.points, np.asarray(held("AU43").points)[: face.mesh.n_points]
    for eye in face.eyes:
        lashes = Lashes(eye, face)
        opening = face.eyelid_openings[eye.side]
        heights = []
        for points in (open_eyes, closed):
            tips = lashes.cards(0.1).along(lashes.lines(points)).points.reshape(-1, Lashes.KNOTS, 2, 3).mean(axis=2)
            counts = [len(weights) for _, weights in lashes.roots]
            for hairs, chain in zip(np.split(tips, counts[:1]), (opening.upper, opening.lower), strict=True):
                fine = np.concatenate(
                    [np.linspace(a, b, 30) for a, b in zip(points[chain][:-1], points[chain][1:], strict=True)]
                )
                gap = np.linalg.norm(hairs[:, 0, None] - fine, axis=2).min(axis=1)
                assert gap.max() < 2.0
                length = np.linalg.norm(np.diff(hairs, axis=1), axis=2).sum(axis=1)
                assert 0.5 < length.min() < length.max() < 10.0
                # Outside of the eyeball along all their length.
                assert np.linalg.norm(hairs - eye.centre, axis=2).min() > eye.radius
            heights.append(tips[: counts[0], 0, 1].mean())
        assert heights[0] - heights[1] > 4.0


def _moved_brow(face, by):
    """Motion of the roots of the left brow's hairs with skin that moves, in the mean of each tenth of its length."""
    brows, normals, knots = (
        Brows(face.bound_hair["brows"], face),
        face.tissue.normals,
        face.bound_hair["brows"].triangles.shape[1],
    )
    before, after = (
        brows.lines(points, face.triangles, normals).points.reshape(-1, brows.STRANDS, knots, 3)[:, 0, 0]
        for points in (face.points, face.points + by)
    )
    x, moved = before[:, 0], after - before
    left = np.sort(x[x > 0.0])
    tenth = np.digitize(x, np.linspace(left[0], left[-1], 11)[1:-1])
    return np.array([moved[(x > 0.0) & (tenth == k)].mean(axis=0) for k in range(10)])


def test_brows_go_with_skin_that_goes_as_a_whole(face):
    assert _moved_brow(face, [1.0, 3.0, 0.5]) == pytest.approx(np.tile([1.0, 3.0, 0.5], (10, 1)), abs=1e-4)


def test_brows_do_not_bend_as_sharply_as_skin(face):
    def bend(x):
        return 0.5 * np.maximum(40.0 - x, 0.0)

    brow = _moved_brow(face, bend(face.points[:, :1]) * [0.0, 1.0, 0.0])[:, 1]
    skin = np.diff(bend(np.linspace(10.0, 60.0, 11)), 2)
    assert 0.0 < np.diff(brow, 2).max() < 0.5 * skin.max()


def test_hairs_of_brows_are_lifted_onto_a_surface_over_them(face):
    """All of the skin is 1.5 mm farther out, also where the hairs that lie farthest ahead are."""
    brows, normals = Brows(face.bound_hair["brows"], face), face.tissue.normals
    fine = to_polydata(face.points + 1.5 * normals, face.triangles).subdivide(2, "linear")
    out, triangles = np.asarray(fine.points, float), fine.regular_faces
    on_skin = brows.cards(0.01).along(brows.lines(face.points, face.triangles, normals))
    lifted = brows.cards(0.01).along(brows.lines(face.points, face.triangles, normals, (out, triangles)))
    surface = to_polydata(out, triangles)
    ahead = 50.0 * face.frame.axes[2]

    def hidden(hairs):
        among = hairs.points[::37].astype(float)
        hits = [surface.ray_trace(point + ahead, point)[0] for point in among]
        return np.mean(
            [
                bool(len(hit)) and np.linalg.norm(hit - at, axis=1).max() > 0.15
                for hit, at in zip(hits, among, strict=True)
            ]
        )

    assert hidden(on_skin) > 0.9
    assert hidden(lifted) < 0.02
    aside = brows.cards(0.01).along(
        brows.lines(face.points, face.triangles, normals, (out + 500.0 * face.frame.axes[1], triangles))
    )
    np.testing.assert_array_equal(aside.points, on_skin.points)


def test_lashes_grow_on_lids_of_few_vertices(face):
    """The opening of a coarse head has as few as four: its corners, and a place of each lid."""
    added = []
    for rim in rims(face):
        rim = np.roll(rim, -int(np.argmin(face.points[rim] @ face.frame.axes[0])))
        n, end = len(rim), int(np.argmax(face.points[rim] @ face.frame.axes[0]))
        corners = [0, end // 2, end, (end + n) // 2, n]
        for a, b in pairwise(corners):
            added += [[rim[a], rim[(k + 1) % n], rim[k]] for k in range(a + 1, b)]
    coarse = Face.from_landmarks(
        to_polydata(face.points, np.vstack([face.triangles, added]).astype(np.int32)), face.landmarks, 1.0
    )
    for eye in coarse.eyes:
        opening = coarse.eyelid_openings[eye.side]
        assert max(len(opening.upper), len(opening.lower)) < 4
        assert np.isfinite(Lashes(eye, coarse).lines(coarse.points).points).all()
