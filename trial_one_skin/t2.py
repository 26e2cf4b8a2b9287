import sys; sys.path.insert(0,'trial_one_skin')
from bind import *
from analysis.subjects import subject, FACES
from analysis import motion, relief
from analysis.motion import read_shapes, compared, summed, PAIRS, settled
import warnings
def measure(face, skin, shapes):
    area = vertex_areas(skin.points, face.triangles)
    cos=[]
    for m, s in PAIRS:
        cos.append(compared(settled(skin, face.atlas.resolve(m)), summed(shapes, s), area).cosine)
    far = relief.off_rims(face)
    seen = area*(face.cavities.depth(face.points) < relief.SEEN*face.frame.scale)
    change = relief.change_of_curvature(skin.points, face.triangles)
    rs, cs, vr = [], [], []
    for name,(units,shape) in relief.PAIRS.items():
        field = summed(shapes, shape)
        ours = settled(skin, face.atlas.contractions(dict.fromkeys(units.split("+"),1.0)))
        where = far & (np.linalg.norm(field,axis=1) > relief.MOVED)
        a,b = change(ours), change(field)
        rs.append(relief.correlation(a,b,where*seen)[0]); vr.append(relief.correlation(a,b,where*1.0)[0])
        cs.append(compared(ours[where], field[where], area[where]).cosine)
    t=time.process_time(); settled(skin, face.atlas.contractions('AU12')); settled(skin, face.atlas.contractions('AU43')); settled(skin, face.atlas.contractions('AU1')); t=time.process_time()-t
    lids=[]
    for what in ('AU43','AU45'):
        if what not in face.atlas.action_units: continue
        u = settled(skin, face.atlas.contractions(what)) ; x = (skin.points+u)/face.unit
        for o in face.eyelid_openings.values():
            m = o.upper[len(o.upper)//5:-len(o.upper)//5]
            tr = cKDTree(x[o.lower]); 
            la=o.polar(x[o.lower]); ua=o.polar(x[m]); el=np.interp(ua[0], la[0][np.argsort(la[0])], la[1][np.argsort(la[0])])
            lids.append(((ua[1]-el).max()*o.eye.radius*face.unit, (ua[1]-el).min()*o.eye.radius*face.unit))
    return np.array(cos), np.array(rs), np.array(cs), np.array(vr), t, np.array(lids)
def show(tag, m):
    c,r,cs,vr,t,l = m
    print(f'  {tag:22s} cos13 {c.mean():.4f} min {c.min():.3f} | rel r {r.mean():.3f} min {r.min():.2f} vr {vr.mean():.3f} cos10 {cs.mean():.4f} min {cs.min():.3f} | t {t:.2f} | lid gap {l.max() if len(l) else 0:.2f} over {l.min() if len(l) else 0:.2f}', flush=True)
if __name__=='__main__':
    for n in sys.argv[1:] or ('ict-0',):
        f = subject(n)
        shapes = read_shapes(FACES/'ict_face_expressions.npz', f.mesh.n_points, f.unit)
        print(n)
        m0 = measure(f, fw.Skin(f, 1.0), shapes); show('today', m0)
        for mode, kw in (('linear', dict(rounds=0)),('linear', {}), ('quad', {}),):
            show(f'{mode} {kw}', m1 := measure(f, OneSkin(f, mode=mode, **kw), shapes))
        print('   d cos13', (m1[0]-m0[0]).round(3)); print('   d r', (m1[1]-m0[1]).round(3)); print('  d cos10', (m1[2]-m0[2]).round(3))
