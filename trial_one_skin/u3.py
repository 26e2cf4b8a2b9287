import sys; sys.path.insert(0,'trial_one_skin')
from u2 import *
def where(f,p):
    lm=f.landmarks; names=list(lm); L=np.array([lm[k] for k in names]); k=np.linalg.norm(L-p,axis=1).argmin()
    return names[k], (f.frame.axes@(p-L[k])*f.unit).round(1).tolist()
for n in sys.argv[1:] if __name__=="__main__" else ():
    f=subject(n); sf=onefit.skin_of(f); P=U(f,0.2,skin_face=sf); orc=Oracle(f); good=P.b.good
    dep=f.cavities.depth(f.points)*f.unit
    for i in range(4):
        s=sequence(f,0,n,i); P.reset()
        for q,r in enumerate(s.rates[::10]):
            P.set_rates(r)
            for _ in range(3): P.skin.advance()
            u=P.displacement; x=P.points+u; N=Normals(x,f.triangles)
            li=orc.lips.depth(x,N); ld=max((l.depth(x,N) for l in orc.lids), key=lambda t:t[0])
            te=orc.depths_in_teeth(x)
            tm=max(a.max(initial=0) for a in te)
            act={m:round(float(v),2) for m,v in zip(f.muscles,r) if v>.3}
            if li[0]>.1: v=li[1]; print(i,q,'lips %.2f'%li[0], v, where(f,f.points[v]),'d',P.b.d[v].round(2),'good',good[v],'share',f.mandible_share[v].round(2),'cav',dep[v].round(2), act)
            if ld[0]>.1: v=ld[1]; print(i,q,'lids %.2f'%ld[0], v, where(f,f.points[v]),'d',P.b.d[v].round(2),'good',good[v],'cav',dep[v].round(2), act)
            if tm>.1:
                for c,a in zip(orc.teeth,te):
                    if a.max(initial=0)>.1:
                        k=int(a.argmax()); 
                        print(i,q,'teeth %.2f'%a.max(), c.jaw, (a>.1).sum(), act)
