from bind3 import *
@numba.njit
def nearest_share(q, nq, share, points, tris, tn, tshare, cand, offs, least, tol, out_t, out_w, out_d):
    w = np.empty(3)
    for i in range(len(q)):
        best = np.inf; out_t[i] = -1
        for c in range(offs[i], offs[i+1]):
            t = cand[c]
            d = closest_in_triangle(q[i], points[tris[t,0]], points[tris[t,1]], points[tris[t,2]], w)
            d += (least*(1-(tn[t,0]*nq[i,0]+tn[t,1]*nq[i,1]+tn[t,2]*nq[i,2])))**2
            for j in range(share.shape[1]):
                d += (tol*(w[0]*tshare[tris[t,0],j]+w[1]*tshare[tris[t,1],j]+w[2]*tshare[tris[t,2],j]-share[i,j]))**2
            if d < best:
                best = d; out_t[i] = t
                out_w[i,0]=w[0];out_w[i,1]=w[1];out_w[i,2]=w[2]
        out_d[i] = np.sqrt(best)
def shares(face):
    out=np.zeros((len(face.points),3))
    out[:,0]=face.mandible_share
    for k,s in enumerate('lr'):
        j=face.joint_weights.get(f'orbicularis_oculi_{s}')
        if j is not None: out[j.vertices,1+k]=j.angles/1.2   # 45 degrees ~ .65
    return out
class Bound4(Bound3):
    def __init__(self, face, skin, quad=True, reach=4.0, cos=3.0, beyond=60.0, tol=10.):
        P = self.P = face.points*face.unit; X = self.X = skin.points*skin.unit
        N = vertex_normals(P, face.triangles)
        nr = Nearest(X, skin.triangles, 48)
        _, near = nr.tree.query(P, k=nr.k)
        offs=np.arange(len(P)+1)*nr.k
        sh, ts = shares(face), shares(skin)
        t=np.empty(len(P),np.int64); w=np.zeros((len(P),3)); d=np.empty(len(P))
        nearest_share(P,N,sh,nr.p,nr.t,nr.tn,ts,near.ravel(),offs,cos,tol,t,w,d)
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
        L=csr_array(graph_laplacian(edges, 1/ln, n))
        g = csr_array((np.r_[ln,ln], (np.r_[edges[:,0],edges[:,1]], np.r_[edges[:,1],edges[:,0]])), shape=(n,n))
        way = dijkstra(g, indices=rows, min_only=True, limit=beyond*scale)
        self.free = np.flatnonzero(~good & np.isfinite(way))
        if len(self.free):
            self.factor=symmetric_factors(csc_array(L[self.free][:,self.free]))
            self.right=csr_array(L[self.free][:,rows])
        self.balls=[]
        for e in face.eyes:
            off=P-e.centre*face.unit; r=np.linalg.norm(off,axis=1)
            v=np.flatnonzero(r<1.6*e.radius*face.unit)
            self.balls.append((v, e.centre*face.unit, np.minimum(r[v], e.radius*face.unit)))
    def at(self, u, carry):
        out=carry.copy(); v=self.B@u; out[self.rows]=v
        if len(self.free): out[self.free]+=self.factor.solve(-(self.right@(v-carry[self.rows])))
        for v,c,least in self.balls:
            x=self.P[v]+out[v]-c; r=np.linalg.norm(x,axis=1)
            out[v]+= x*(np.maximum(least/r,1)-1)[:,None]
        return out
class OneSkin4(OneSkin3):
    def __init__(self, face, time_step=1.0, skin_face=None, quad=True, **kw):
        self.face=face; self.sf=skin_face; self.lids=False
        self.skin=fw.Skin(self.sf, time_step); self.b=Bound4(face,self.sf,quad,**kw); self.points=face.points*face.unit
        self.joints=Joints(face, self.skin.names, *self._held(face))
    @property
    def displacement(self):
        return self.b.at(self.skin._displacement, self.joints.shift(self.skin._placed))
