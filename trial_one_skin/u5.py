import sys; sys.path.insert(0,'trial_one_skin')
from u2 import *
import u2
def fine(f, nm, P, seqs=4, every=10):
    orc=Oracle(f); out={'eyes':[], 'inv':[], 'lips':[], 'lids':[], 'teeth':[]}; frames=0; said=[]
    for i in range(seqs):
        s=sequence(f,0,nm,i); P.reset()
        for q,r in enumerate(s.rates):
            P.set_rates(r); P.skin.advance()
            if q%every: continue
            frames+=1; u=P.displacement; fd=orc.findings(P.points+u)
            for k,v in zip(out,(fd.eyes,fd.inverted,fd.lips,fd.lids,fd.teeth)): out[k].append(v)
            if max(fd.lips,fd.lids,fd.teeth)>.1: said.append((i,q,round(fd.lips,2),round(fd.lids,2),round(fd.teeth,2)))
    lim=dict(eyes=.1,inv=0,lips=.1,lids=.1,teeth=.1)
    print('  frames',frames, {k:(int((np.array(v)>lim[k]).sum()), round(float(max(v,default=0)),3)) for k,v in out.items()}, said[:12], flush=True)
class T2(Today):
    def __init__(self,f): super().__init__(f); self.skin=fw.Skin(f,0.02)
if __name__=='__main__':
  for n in sys.argv[1:]:
    f=subject(n); sf=onefit.skin_of(f)


    P=U(f,0.02,skin_face=sf); print('bound'); fine(f,n,P)
