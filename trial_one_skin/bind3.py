from bind2 import *
from facewrinkle.geometry.laplacian import graph_laplacian
class Bound3(Bound):
    def __init__(self, face, skin, quad=True, reach=4.0, cos=0.3, beyond=60.0):
        t0=time.process_time()
        P = self.P = face.points*face.unit; X = self.X = skin.points*skin.unit
        N = vertex_normals(P, face.triangles)
        nr = Nearest(X, skin.triangles, 32)
        t, w, d = nr(P, N, cos)
        scale = face.frame.scale*face.unit
        good = (t >= 0) & (d < reach*scale)
        n, k = len(P), len(X)
        edges,_ = unique_edges(face.triangles)
        ln = np.linalg.norm(P[edges[:,0]]-P[edges[:,1]],axis=1)+1e-12
        rows = np.flatnonzero(good)
        corners = skin.triangles[t[rows]]; ww=w[rows]; m=len(rows)
        r3 = np.repeat(np.arange(m),3)
        E = csr_array((ww.ravel(), (r3, corners.ravel())), shape=(m,k))
        B = E.copy()
        if quad:
            G = self.gradients(X, skin.triangles)
            place = E @ X
            for c in range(3):
                off = (place[:,None]-X[corners])[:,:,c]
                B = B + csr_array(((0.5*ww*off).ravel(), (r3, corners.ravel())), shape=(m,k)) @ G[c]
        self.B=csr_array(B); self.rows=rows; self.good=good; self.d=d; self.n=n
        bad=np.flatnonzero(~good)
        L=csr_array(graph_laplacian(edges, 1/ln, n))
        reachable=np.zeros(n,bool)
        g = csr_array((np.r_[ln,ln], (np.r_[edges[:,0],edges[:,1]], np.r_[edges[:,1],edges[:,0]])), shape=(n,n))
        way = dijkstra(g, indices=rows, min_only=True, limit=beyond*scale)
        self.free = np.flatnonzero(~good & np.isfinite(way))
        if len(self.free):
            self.factor=symmetric_factors(csc_array(L[self.free][:,self.free]))
            self.right=csr_array(L[self.free][:,rows])
        self.cpu=time.process_time()-t0
    def at(self, u):
        out=np.zeros((self.n,3)); out[self.rows]=v=self.B@u
        if len(self.free): out[self.free]=self.factor.solve(-(self.right@v))
        return out
class OneSkin3(OneSkin2):
    def __init__(self, face, time_step=1.0, skin_face=None, quad=True, **kw):
        self.face=face; self.sf=skin_face; self.lids=False
        self.skin=fw.Skin(self.sf, time_step); self.b=Bound3(face,self.sf,quad,**kw); self.points=face.points*face.unit
