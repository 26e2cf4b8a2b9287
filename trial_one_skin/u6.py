import sys; sys.path.insert(0,'trial_one_skin')
from u3 import where
from u2 import *
f=subject('ict-0'); sf=onefit.skin_of(f); P=U(f,0.02,skin_face=sf); orc=Oracle(f)
s=sequence(f,0,'ict-0',2); P.reset()
for q,r in enumerate(s.rates[:31]): P.set_rates(r); P.skin.advance()
u=P.displacement; x=P.points+u
te=orc.depths_in_teeth(x)[0]; c=orc.teeth[0]
near=(__import__('tools.trials.oracle',fromlist=['x'])._from_mouth(f,f.points*f.unit)<.7)[f.triangles].all(1)
own=c.samples
print([k for k in vars(own)], [np.shape(v) for v in vars(own).values()])
top=np.argsort(-te)[:12]
dep=f.cavities.depth(f.points)*f.unit
T=own.triangles[np.searchsorted(own.firsts,np.arange(len(own.shares)),side="right")-1]
for k in top:
    cs=T[k]
    v=cs[own.shares[k].argmax()]
    print(round(te[k],2),'v',v,where(f,f.points[v]),'cav',dep[v].round(1),'d',P.b.d[v].round(2),P.b.good[v],'u',u[v].round(1), 'today?')
A=fw.Skin(f,.02)
for q,r in enumerate(s.rates[:31]): A.set_rates(r); A.advance()
print('diff to today at these', [ (u[v]-A.displacement[v]).round(1).tolist() for v in {T[k][own.shares[k].argmax()] for k in top}])
