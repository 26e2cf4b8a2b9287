from bind import *
class Bound2(Bound):
    def __init__(self, face, skin, quad=True, far=(6.0,14.0), reach=4.0, cos=0.3):
        P = self.P = face.points*face.unit; X = self.X = skin.points*skin.unit
        N = vertex_normals(P, face.triangles)
        nr = Nearest(X, skin.triangles, 32)
        t, w, d = nr(P, N, cos)
        scale = face.frame.scale*face.unit
        good = (t >= 0) & (d < reach*scale)
        n, k = len(P), len(X)
        rows = np.flatnonzero(good)
        edges,_ = unique_edges(face.triangles)
        ln = np.linalg.norm(P[edges[:,0]]-P[edges[:,1]],axis=1)+1e-12
        g = csr_array((np.r_[ln,ln], (np.r_[edges[:,0],edges[:,1]], np.r_[edges[:,1],edges[:,0]])), shape=(n,n))
        dist, _, src = dijkstra(g, indices=rows, min_only=True, return_predecessors=True)
        src = np.where(src<0, rows[0], src)
        t, w = t[src], w[src]
        corners = skin.triangles[t]
        self.T = skin.triangles
        r3 = np.repeat(np.arange(n),3)
        E = csr_array((w.ravel(), (r3, corners.ravel())), shape=(n,k))
        M = neighbor_mean(edges, n)
        keep = diags_array(good.astype(float)); ch = diags_array((~good).astype(float))
        B = E.copy()
        if quad:
            G = self.gradients(X, skin.triangles)
            place = E @ X
            for c in range(3):
                off = (place[:,None]-X[corners])[:,:,c]
                B = B + csr_array(((0.5*w*off).ravel(), (r3, corners.ravel())), shape=(n,k)) @ G[c]
        if (~good).any():
          for _ in range(10):
            B = csr_array(keep @ B + ch @ (M @ B)); E = csr_array(keep@E + ch@(M@E))
        fade = 1 - smoothstep((np.where(good, d, dist)/scale - far[0])/(far[1]-far[0]))
        self.good, self.d, self.dist, self.fade = good, d, dist, fade
        self.B, self.E = csr_array(diags_array(fade)@B), E
        VN = vertex_normals(X, skin.triangles)
        self.n0 = E @ VN; self.n0 /= np.linalg.norm(self.n0,axis=1)[:,None]+1e-12
        self.o = (P - E @ X)*fade[:,None]
    def at(self, u):
        out = self.B @ u
        n1 = self.E @ vertex_normals(self.X+u, self.T); n1 /= np.linalg.norm(n1,axis=1)[:,None]+1e-12
        a = np.cross(self.n0, n1); c = (self.n0*n1).sum(1)
        ao = np.cross(a, self.o)
        return out + ao + np.cross(a, ao)/(1.0+np.maximum(c,-0.9))[:,None]
class OneSkin2(OneSkin):
    def __init__(self, face, time_step=1.0, lids=False, skin_face=None, quad=True, **kw):
        self.face=face
        self.sf = skin_face or skin_of(face, **kw)
        self.skin = fw.Skin(self.sf, time_step)
        self.b = Bound2(face, self.sf, quad)
        self.points = face.points*face.unit
        self.lids = lids
        if lids:
            self.joints = Joints(face, self.skin.names, *self._held(face))
    @property
    def displacement(self):
        u = self.skin._displacement
        if not self.lids: return self.b.at(u)
        beyond = u.copy()
        self.skin.joints.turn_lids(beyond, self.skin._placed, -1.0)
        out = self.b.at(beyond)
        self.joints.turn_lids(out, self.skin._placed, 1.0)
        return out
