import sys; sys.path.insert(0,'trial_one_skin')
from t11 import *; from bind4 import *
from tools.trials.oracle import Oracle
from tools.trials.orientation import Normals
class P4(OneSkin4):
    names=property(lambda s: s.skin.names); rates=property(lambda s: s.skin.rates)
    def set_rates(self,r): self.skin.set_rates(r)
    def step(self): self.skin.advance(); return self.points+self.displacement
    def energy(self): return self.skin.energy()
def quick(f, nm, P, seqs=4, every=10):
    orc=Oracle(f); good=P.b.good; out={'eyes':[], 'inv':[], 'lips':[], 'lids':[], 'teeth':[]}; verts=[]; frames=0; names=[]
    for i in range(seqs):
        s=sequence(f,0,nm,i); P.reset()
        for r in s.rates[::every]:
            P.set_rates(r); frames+=1
            for _ in range(3): P.skin.advance()
            u=P.displacement; x=P.points+u; N=Normals(x,f.triangles)
            out['eyes'].append(max((float(b.depths(x).max()) for b in orc.balls),default=0))
            inv=orc.orientation.turned_over(x,N); out['inv'].append(len(inv))
            for t in inv: verts.append(('inv',int(t),bool(good[f.triangles[t]].all())))
            for nn,sh in [('lips',orc.lips)]+[('lids',l) for l in orc.lids]:
                if sh is None: continue
                d,v=sh.depth(x,N); out[nn].append(d)
                if d>.1: verts.append((nn,int(v),bool(good[v])))
            out['teeth'].append(max((float(a.max(initial=0)) for a in orc.depths_in_teeth(x)),default=0))
    lim=dict(eyes=.1,inv=0,lips=.1,lids=.1,teeth=.1)
    print('  frames',frames, {k:(int((np.array(v)>lim[k]).sum()), round(float(max(v,default=0)),3)) for k,v in out.items()}, flush=True)
    from collections import Counter
    print('   ', Counter(verts).most_common(14))
if __name__=='__main__':
  for n in sys.argv[1:]:
    f=subject(n); t=time.process_time(); sf=onefit.skin_of(f); t1=time.process_time(); P=P4(f,0.2,skin_face=sf); print(n,'fit',round(t1-t,2),'skin+bind',round(time.process_time()-t1,2),'good',P.b.good.mean().round(3))
    quick(f,n,P)
    if '-c' in sys.argv: pass
