"""Openings between lids, and the margins of these."""

from __future__ import annotations

import numpy as np
import pytest
from eyelids_of_faces import margins_of


@pytest.mark.parametrize("name", ["makehuman_head_male", "ict_face_narrow"])
def test_the_margins_of_thick_lids_keep_to_one_edge(real_face, name):
    """Between their ends they go from neighbour to neighbour, and turn little."""
    face = real_face(name)
    sides = {tuple(sorted(edge)) for t in face.triangles.tolist() for edge in zip(t, t[1:] + t[:1], strict=True)}
    for eye in face.eyes:
        inner, outer = (face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer"))
        for chain in margins_of(face, eye.side):
            place = (face.points[chain] - inner) @ (outer - inner) / ((outer - inner) @ (outer - inner))
            middle = chain[(place > 0.22) & (place < 0.95)]
            steps = zip(middle[:-1].tolist(), middle[1:].tolist(), strict=True)
            assert len(middle) > 5
            assert {tuple(sorted(step)) for step in steps} <= sides
            along = np.diff(face.points[middle], axis=0)
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            assert (along[1:] * along[:-1]).sum(axis=1).min() > np.cos(np.radians(40.0))
