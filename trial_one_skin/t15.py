import sys; sys.path.insert(0,'trial_one_skin')
from t13 import *
def where(f,p):
    lm=f.landmarks; names=list(lm); L=np.array([lm[k] for k in names]); k=np.linalg.norm(L-p,axis=1).argmin()
    return names[k], (f.frame.axes@(p-L[k])*f.unit).round(1).tolist()
for n in sys.argv[1:]:
    f=subject(n); sf=onefit.skin_of(f); P=P4(f,0.2,skin_face=sf); orc=Oracle(f); good=P.b.good
    so=Oracle(sf)
    ev=[]
    for i in range(4):
        s=sequence(f,0,n,i); P.reset()
        for q,r in enumerate(s.rates[::10]):
            P.set_rates(r)
            for _ in range(3): P.skin.advance()
            u=P.displacement; x=P.points+u; N=Normals(x,f.triangles)
            inv=orc.orientation.turned_over(x,N)
            li=orc.lips.depth(x,N); ld=max((l.depth(x,N) for l in orc.lids), key=lambda t:t[0])
            te=[a.max(initial=0) for a in orc.depths_in_teeth(x)]
            if len(inv) or li[0]>.1 or ld[0]>.1 or max(te)>.1:
                act={m:round(float(v),2) for m,v in zip(f.muscles,r) if v>.2}
                xs=sf.points*sf.unit+P.skin._displacement; fs=so.findings(xs)
                print(n,i,q*10,'inv',len(inv),'lips %.2f'%li[0],'lids %.2f'%ld[0],'teeth',np.round(te,2),'| skin itself',fs)
                if len(inv):
                    c=f.points[f.triangles[inv]].mean(1); print('    inv at', [where(f,p) for p in c[:3]], 'd', P.b.d[f.triangles[inv]].max(1).round(2)[:5], 'depth', (f.cavities.depth(c)*f.unit).round(1)[:5])
                if li[0]>.1: v=li[1]; print('    lips at', v, where(f,f.points[v]), 'd', P.b.d[v].round(2), 'good', good[v], 'share', f.mandible_share[v].round(2), 'u', u[v].round(1))
                if ld[0]>.1: v=ld[1]; print('    lids at', v, where(f,f.points[v]), 'd', P.b.d[v].round(2), 'good', good[v])
                if max(te)>.1: print('    act', act)
