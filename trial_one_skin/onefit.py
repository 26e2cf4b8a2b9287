import numpy as np, dataclasses, time
from scipy.interpolate import RBFInterpolator
from scipy.sparse import csr_array, diags_array, csc_array
from scipy.spatial import cKDTree
import facewrinkle as fw
from facewrinkle.anatomy.face import Face
from facewrinkle.anatomy.fitting import mean_face
from facewrinkle.geometry.normals import vertex_normals, triangle_normals, vertex_areas
from facewrinkle.geometry.laplacian import cotangent_laplacian, symmetric_factors
from facewrinkle.geometry.topology import unique_edges
from facewrinkle.geometry.interpolation import closest_in_triangle
from facewrinkle.geometry.interpolation import smoothstep
from facewrinkle.mesh import to_polydata
import numba

@numba.njit
def nearest(q, nq, points, tris, tn, cand, offs, least, out_t, out_w, out_d):
    w = np.empty(3)
    for i in range(len(q)):
        best = np.inf
        out_t[i] = -1
        for c in range(offs[i], offs[i+1]):
            t = cand[c]
            if tn[t,0]*nq[i,0]+tn[t,1]*nq[i,1]+tn[t,2]*nq[i,2] < least: continue
            d = closest_in_triangle(q[i], points[tris[t,0]], points[tris[t,1]], points[tris[t,2]], w)
            if d < best:
                best = d; out_t[i] = t
                out_w[i,0]=w[0];out_w[i,1]=w[1];out_w[i,2]=w[2]
        out_d[i] = np.sqrt(best)

LIN=6.0
class Nearest:
    """closest points on a mesh with compatible normals"""
    def __init__(self, points, tris, k=24):
        self.p, self.t = np.ascontiguousarray(points, float), np.ascontiguousarray(tris)
        self.tn = triangle_normals(self.p, self.t)
        self.vn = vertex_normals(self.p, self.t)
        # mixed candidates: by k nearest triangle middles
        self.mid = self.p[self.t].mean(axis=1)
        self.tree, self.k = cKDTree(self.mid), min(k, len(self.mid))
    def __call__(self, q, nq, least=0.3):
        _, near = self.tree.query(q, k=self.k, workers=1)
        offs = np.arange(len(q)+1)*self.k
        t = np.empty(len(q), np.int64); w = np.zeros((len(q),3)); d = np.empty(len(q))
        nearest(np.ascontiguousarray(q), np.ascontiguousarray(nq), self.p, self.t, self.tn, near.ravel(), offs, least, t, w, d)
        return t, w, d
    def at(self, t, w):
        return np.einsum('nk,nki->ni', w, self.p[self.t[t]])

def margins_targets(home, face, pts):
    """(vertex, place) for the margins of lids of the skin on those of the face"""
    vs, ps = [], []
    for side, own in home.eyelid_openings.items():
        other = face.eyelid_openings.get(side)
        if other is None: continue
        for a, b in ((own.upper, other.upper), (own.lower, other.lower)):
            la = own.polar(home.points[a])[0]; lb = other.polar(face.points[b])[0]
            # by normalised length from end to end
            xb = face.points[b]
            order = np.argsort(lb, kind='stable'); lb, xb = lb[order], xb[order]
            la = np.clip(la, 0, 1)
            la = (la-la.min())/(la.max()-la.min()); lb=(lb-lb.min())/(lb.max()-lb.min())
            vs.append(a); ps.append(np.stack([np.interp(la, lb, xb[:,k]) for k in range(3)],1))
    if not vs: return np.empty(0,int), np.empty((0,3))
    return np.concatenate(vs), np.concatenate(ps)

def skin_of(face, rounds=6, alpha=3.0, limits=(12,8,6,4,3,3), pin=True, smoothing=1.0, verbose=False):
    home = mean_face(face.atlas)
    t0=time.process_time()
    names = [n for n in home.landmarks if n in face.landmarks]
    a = np.array([home.landmarks[n] for n in names]); b = np.array([face.landmarks[n] for n in names])*face.unit
    va, vb = margins_targets(home, face, None); vb = vb*face.unit
    if not pin: va, vb = va[:0], vb[:0]
    use = np.arange(0, len(va), 2)
    warp = RBFInterpolator(np.vstack([a, home.points[va[use]]]), np.vstack([b, vb[use]]), kernel='thin_plate_spline', smoothing=smoothing)
    x0 = warp(home.points)
    x = x0.copy()
    if rounds:
        pts = face.points*face.unit
        target = Nearest(pts, face.triangles)
        border = np.zeros(len(pts), bool)
        for loop in face.boundary_loops: border[loop] = True
        L = cotangent_laplacian(x0, home.triangles)
        area = vertex_areas(x0, home.triangles)
        bi = csr_array(L.T @ diags_array(1/area) @ L)
        # skip what is inside
        inside = home.lining.vertices
        for r in range(rounds):
            n = vertex_normals(x, home.triangles)
            t, w, d = target(x, n, 0.5)
            ok = (t >= 0) & (d < np.where(inside, LIN, limits[min(r,len(limits)-1)]))
            tt = np.maximum(t,0)
            onb = (border[target.t[tt]] & (w > 1e-9)).any(axis=1) & (border[target.t[tt]].sum(1)>=2) & ((w*~border[target.t[tt]]).sum(1)<1e-6)
            ok &= ~onb
            wt = np.where(ok, area, 0.0)
            goal = target.at(tt, w)
            wt[va] = 100*area[va].mean(); goal[va] = vb
            # keep loosely at the warp
            sys = diags_array(wt + 1e-4*area) + alpha**2*bi*1.0
            rhs = wt[:,None]*(goal-x0)
            x = x0 + symmetric_factors(csc_array(sys)).solve(rhs)
            if verbose: print(r, ok.mean().round(2), np.median(d[ok]).round(3), np.quantile(d[ok],.9).round(3))
    mesh = to_polydata(x/face.unit, home.triangles)
    skin = Face.from_landmarks(mesh, face.landmarks, face.unit, face.atlas, template=home)
    skin = dataclasses.replace(skin, eyes=face.eyes, muscles=face.muscles, age=face.age)
    object.__setattr__(skin, "behind_lips", face.behind_lips)
    return skin

def inverted(face, skin):
    home = mean_face(face.atlas)
    return (( triangle_normals(skin.points, home.triangles)*vertex_normals(skin.points, home.triangles)[home.triangles[:,0]]).sum(1)<0).sum()
