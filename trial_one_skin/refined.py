import sys; sys.path.insert(0,'trial_one_skin')
import onefit
from onefit import *
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.geometry.interpolation import interpolated
from facewrinkle.geometry.normals import vertex_normals as vn
import functools
def split_home(levels=1, reach=2.0, lips=0.0):
    h = fw.default_face()
    forest = RedGreenForest(h.triangles, levels, len(h.points))
    P=h.points; N=vn(P,h.triangles)
    for l in range(levels):
        corners = forest.corners; bary=forest.barycentric
        X = interpolated(P, corners, bary)
        T = forest.triangles
        mid = X[T].mean(axis=1)
        mark = np.zeros(len(T),bool)
        for e in h.eyes:
            mark |= (np.linalg.norm(mid-e.centre,axis=1) < reach*e.radius) & ((mid-e.centre)@e.gaze > 0)
        if lips:
            d = cKDTree(np.array([h.landmarks[n] for n in h.landmarks if 'mouth' in n or 'lip' in n or 'stom' in n])).query(mid)[0]
            mark |= d < lips
        forest.split(mark)
    corners, bary = forest.corners, forest.barycentric
    X = interpolated(P, corners, bary)
    # curved: PN-like: project onto tangent planes half
    n3 = N[corners]; off=((X[:,None]-P[corners])*n3).sum(2,keepdims=True)*n3
    X = X - 0.5*np.einsum('nk,nki->ni',bary,off)
    f = Face.from_landmarks(to_polydata(X, forest.triangles), h.landmarks, 1.0, h.atlas)
    f = dataclasses.replace(f, eyes=h.eyes, muscles=h.muscles)
    return f
