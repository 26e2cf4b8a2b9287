"""Margins of lids, and faces whose eyes are closed by skin, for several tests."""

import numpy as np
import pyvista as pv

from facewrinkle.geometry.topology import boundary_loops


def margins_of(face, side):
    """The vertices of the upper and the lower margin."""
    opening = face.eyelid_openings[side]
    return opening.upper, opening.lower


def rims(face):
    """The rims of the openings of both eyes."""
    centres = [eye.centre for eye in face.eyes]
    return [
        loop
        for loop in boundary_loops(face.triangles)
        if min(np.linalg.norm(face.points[loop] - centre, axis=1).max() for centre in centres) < 24.0
    ]


def filled(face, *rings):
    """Points and triangles of the face with its eyes closed by rings (share of the rim, mm back) and a last point."""
    points, triangles = [face.points], [face.triangles]
    back = -face.frame.axes[2]
    for rim in rims(face):
        before, middle = rim, face.points[rim].mean(axis=0)
        for share, depth in rings:
            start = sum(map(len, points))
            ring = np.arange(start, start + len(rim))
            points.append(middle + share * (face.points[rim] - middle) + depth * back)
            after = np.roll(before, -1), np.roll(ring, -1)
            triangles += [np.stack([before, ring, after[0]], axis=1), np.stack([after[0], ring, after[1]], axis=1)]
            before = ring
        last = sum(map(len, points))
        points.append(points[-1].mean(axis=0)[None] if rings else middle[None])
        triangles.append(np.stack([before, np.full(len(rim), last), np.roll(before, -1)], axis=1))
    return np.vstack(points), np.vstack(triangles).astype(np.int32)


def ball_of(eye):
    """The eyeball as a mesh whose first point is the middle of the iris."""
    sphere = {"theta_resolution": 48, "phi_resolution": 48}
    return pv.Sphere(radius=eye.radius, center=eye.centre, direction=eye.gaze, **sphere)
