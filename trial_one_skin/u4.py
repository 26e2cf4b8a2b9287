import sys; sys.path.insert(0,'trial_one_skin')
from u2 import *
for n in sys.argv[1:]:
    f=subject(n); sf=onefit.skin_of(f); P=U(f,0.2,skin_face=sf)
    dep=f.cavities.depth(f.points)*f.unit; from tools.trials.oracle import _from_mouth
    m=_from_mouth(f,f.points*f.unit)
    for lo,hi in ((-1,.5),(.5,2),(2,5),(5,10),(10,30)):
        k=(m<.7)&(dep>lo)&(dep<=hi); g=P.b.good&k
        print(n,lo,hi,'n',k.sum(),'good',g.sum(),'d',np.quantile(P.b.d[g],[.5,.9,1]).round(2) if g.any() else '')
    h=sf; deph=h.cavities.depth(h.points)*h.unit; mh=_from_mouth(h,h.points*h.unit)
    from scipy.spatial import cKDTree
    tr=cKDTree(f.points*f.unit)
    for lo,hi in ((-1,.5),(.5,2),(2,5),(5,10),(10,30)):
        k=(mh<.7)&(deph>lo)&(deph<=hi)
        if k.any(): print('  skin',lo,hi,k.sum(),'d to scan vertex',np.quantile(tr.query(h.points[k]*h.unit)[0],[.5,.9,1]).round(2))
