from onefit import *
from scipy.sparse.csgraph import dijkstra
from scipy.sparse import vstack
from facewrinkle.motion.joints import Joints
from facewrinkle.geometry.laplacian import neighbor_mean
from facewrinkle.geometry.normals import tangent_axes

def quad_rows(nearest, t, w, q, points, edges, ring_rows):
    pass

class Bound:
    """rows (n, k) for displacement of the skin's vertices -> scan's vertices"""
    def __init__(self, face, skin, mode='linear', far=(6.0, 14.0), lids=True, rate=1.0):
        self.face, self.skin_face = face, skin
        P = face.points*face.unit; X = skin.points*skin.unit
        self.P = P
        N = vertex_normals(P, face.triangles)
        nr = Nearest(X, skin.triangles, 32)
        t, w, d = nr(P, N, 0.3)
        scale = face.frame.scale*face.unit
        good = (t >= 0) & (d < 4.0*scale)
        n, k = len(P), len(X)
        rows = np.flatnonzero(good)
        corners = skin.triangles[t[good]]
        Wt = w[good]
        if mode == 'linear':
            B = csr_array((Wt.ravel(), (np.repeat(rows,3), corners.ravel())), shape=(n,k))
        else:
            G = self.gradients(X, skin.triangles)   # (3k... ) per-vertex gradient operators: list of 3 sparse (k,k)
            # PN-like quadratic blending: u(p) = sum_i w_i (u_i + g_i . (p - x_i)) blended: half of linear+taylor
            E = csr_array((Wt.ravel(), (np.repeat(rows,3), corners.ravel())), shape=(n,k))
            place = E @ X
            B = E.copy()
            # correction: quadratic per-edge: for each corner i: w_i * g_i·(p - x_i) *.5
            for c in range(3):
                off = (place[rows][:,None]-X[corners])[:,:,c]   # (m,3)
                M = csr_array(((0.5*Wt*off).ravel(), (np.repeat(rows,3), corners.ravel())), shape=(n,k))
                B = B + M @ G[c]
        # others: nearest good along the edges, smoothed
        edges,_ = unique_edges(face.triangles)
        ln = np.linalg.norm(P[edges[:,0]]-P[edges[:,1]],axis=1)+1e-12
        g = csr_array((np.r_[ln,ln], (np.r_[edges[:,0],edges[:,1]], np.r_[edges[:,1],edges[:,0]])), shape=(n,n))
        dist, _, src = dijkstra(g, indices=rows, min_only=True, return_predecessors=True)
        bad = np.flatnonzero(~good)
        has = bad[src[bad] >= 0]
        S = csr_array((np.ones(len(has)), (has, src[has])), shape=(n,n)) + csr_array((np.ones(len(rows)),(rows,rows)),shape=(n,n))
        B = csr_array(S @ B)
        M = neighbor_mean(edges, n)
        keep = diags_array(good.astype(float)); ch = diags_array((~good).astype(float))
        for _ in range(10):
            B = csr_array(keep @ B + ch @ (M @ B))
        # fade
        reach = np.where(good, d, dist)
        fade = 1 - smoothstep((np.where(good, d, dist)/scale - far[0])/(far[1]-far[0]))
        self.good, self.d, self.dist, self.fade = good, d, dist, fade
        self.B = csr_array(diags_array(fade) @ B)
        self.E3 = None
        self.lids = lids

    def gradients(self, X, T):
        edges,_ = unique_edges(T); k = len(X)
        i = np.r_[edges[:,0],edges[:,1]]; j = np.r_[edges[:,1],edges[:,0]]
        d = X[j]-X[i]
        N = vertex_normals(X,T)
        t1,t2 = tangent_axes(N)
        a = np.stack([(d*t1[i]).sum(1),(d*t2[i]).sum(1)],1)
        wt = 1/np.maximum((d*d).sum(1),1e-9)
        A = np.zeros((k,2,2)); np.add.at(A, i, wt[:,None,None]*a[:,:,None]*a[:,None])
        A += 1e-6*np.eye(2)*np.trace(A,axis1=1,axis2=2)[:,None,None]
        inv = np.linalg.inv(A)
        co = np.einsum('eab,eb->ea', inv[i], a)*wt[:,None]   # (e,2)
        vec = co[:,:1]*t1[i]+co[:,1:]*t2[i]   # (e,3)
        out=[]
        for c in range(3):
            M = csr_array((vec[:,c],(i,j)),shape=(k,k))
            M = M - diags_array(M.sum(axis=1))
            out.append(csr_array(M))
        return out

class OneSkin:
    def __init__(self, face, time_step=1.0, mode='linear', lids=True, skin_face=None, **kw):
        self.face=face
        self.sf = skin_face or skin_of(face, **kw)
        self.skin = fw.Skin(self.sf, time_step)
        self.b = Bound(face, self.sf, mode)
        self.points = face.points*face.unit
        self.lids = lids
        if lids:
            tethers, of_lids = self._held(face)
            self.joints = Joints(face, self.skin.names, tethers, of_lids)
    def _held(self, face):
        from facewrinkle.motion.constraints import tip_of_nose
        plates = {name: self.skin.material.lid_stiffness * joint.hold for name, joint in face.joint_weights.items()}
        return face.tissue.stiffness * (1.0 - tip_of_nose(face)[1]), plates
    def reset(self): self.skin.reset()
    def contract(self, r): self.skin.contract(r)
    def step(self): self.skin.advance()
    @property
    def displacement(self):
        u = self.skin._displacement
        if not self.lids: return self.b.B @ u
        beyond = u.copy()
        self.skin.joints.turn_lids(beyond, self.skin._placed, -1.0)
        out = self.b.B @ beyond
        self.joints.turn_lids(out, self.skin._placed, 1.0)
        return out
