"""How far outlines are from smooth."""

import numpy as np
from scipy.spatial import ConvexHull

from facewrinkle.plotting.views import VIEWS, placed


def turns(face, points, view):
    """Angles between the edges of the outline of the skull, degrees, as seen in a view."""
    _, _, right, up = placed(VIEWS[view], face)
    skull = points[face.frame.local_mm(points)[:, 1] > 40.0]
    flat = np.column_stack([skull @ right, skull @ up])
    outline = flat[ConvexHull(flat).vertices]
    edges = np.roll(outline, -1, axis=0) - outline
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    turn = np.degrees(np.arccos(np.clip((edges * np.roll(edges, 1, axis=0)).sum(axis=1), -1.0, 1.0)))
    return turn[outline[:, 1] > flat[:, 1].min() + 20.0]
