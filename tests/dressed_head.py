"""Parts for the built-in head, for several tests."""

import numpy as np
import pyvista as pv

import facewrinkle as fw

NAMES = ("eye_l", "eye_r", "glasses", "hair", "lashes_l", "lashes_r", "lower_teeth", "other", "upper_teeth")


def ellipsoid(face, where, radii, resolution=16):
    """In the face's own axes, in distances between the pupils from the middle between the eyes."""
    ball = pv.Sphere(radius=1.0, theta_resolution=resolution, phi_resolution=resolution)
    return face.frame.world(np.asarray(ball.points, float) * radii + where), np.asarray(ball.regular_faces)


def lash(face, eye):
    """A strip along the upper lid."""
    turn = np.linspace(-0.6, 0.6, 16)
    side, up, ahead = face.frame.axes
    rim = np.outer(np.sin(turn), side) + np.outer(np.cos(turn), np.cos(0.3) * ahead + np.sin(0.3) * up)
    root = eye.centre + 1.06 * eye.radius * rim
    points = np.concatenate([root, root + 0.3 * eye.radius * (ahead + 0.4 * up)])
    i = np.arange(15)
    return points, np.concatenate([np.column_stack([i, i + 1, i + 16]), np.column_stack([i + 1, i + 17, i + 16])])


def joined(face, pieces):
    """The skin of the face and other parts, in one mesh."""
    meshes = [(face.points, face.triangles), *pieces]
    starts = np.cumsum([0, *(len(points) for points, _ in meshes[:-1])])
    return pv.PolyData.from_regular_faces(
        np.vstack([points for points, _ in meshes]),
        np.vstack([triangles + start for (_, triangles), start in zip(meshes, starts, strict=True)]),
    )


def together(face, pieces):
    """The face with other parts in one mesh."""
    return fw.fit_face(joined(face, pieces), face.landmarks, units="mm")
