"""A head with parts beside its skin."""

import numpy as np
import pytest
import pyvista as pv
from dressed_head import ellipsoid, lash, together

from facewrinkle.anatomy.teeth import teeth_of
from facewrinkle.errors import FaceWrinkleWarning


@pytest.fixture(scope="package")
def pieces(face):
    """Eyes, teeth, lashes, hair, glasses and a pedestal for the built-in head."""
    out = {}
    for eye in face.eyes:
        ball = pv.Sphere(radius=1.02 * eye.radius, center=eye.centre, theta_resolution=20, phi_resolution=20)
        out[f"eye_{eye.side}"] = np.asarray(ball.points, float), np.asarray(ball.regular_faces)
        out[f"lashes_{eye.side}"] = lash(face, eye)
    for arch in teeth_of(face.landmarks, face.frame):
        out[f"{arch.jaw}_teeth"] = arch.points, arch.triangles
    out["hair"] = ellipsoid(face, [0.0, 1.6, -1.5], [1.4, 0.8, 1.4])
    out["other"] = ellipsoid(face, [0.0, -4.0, -1.2], [1.2, 0.8, 1.2])  # a pedestal
    out["glasses"] = ellipsoid(face, [0.0, 0.0, 0.42], [1.0, 0.35, 0.04])
    return out


@pytest.fixture(scope="package")
def dressed(face, pieces):
    """The head with all of them in one mesh, and a speck."""
    parts = [*pieces.values(), ellipsoid(face, [0.0, 0.3, 1.5], [0.004] * 3, 5)]
    with pytest.warns(FaceWrinkleWarning, match="separate parts"), pytest.warns(FaceWrinkleWarning, match="are cards"):
        return together(face, parts)
