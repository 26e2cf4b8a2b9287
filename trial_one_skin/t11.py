import sys; sys.path.insert(0,'trial_one_skin')
from t10 import *
from tools.trials.player import Player
from tools.trials.sequences import sequence
class P3(OneSkin3):
    names=property(lambda s: s.skin.names)
    rates=property(lambda s: s.skin.rates)
    def set_rates(self,r): self.skin.set_rates(r)
    def step(self): self.skin.advance(); return self.points+self.displacement
    def energy(self): return self.skin.energy()
def play(f, tag, make, seqs=4, nm=''):
    pl = Player(f, make()); t=time.process_time(); tot={}; worst={}; fr=0
    for i in range(seqs):
        tr = pl.play(sequence(f,0,nm,i)); fr+=len(tr.largest)
        for k,c in tr.failed().items():
            if c: tot[k]=tot.get(k,0)+c
        for k,(v,_) in tr.worst().items(): worst[k]=max(worst.get(k,0),v)
    print(f'{tag:8s} frames {fr} cpu {time.process_time()-t:.1f} failed {tot} worst', {k:round(v,3) for k,v in worst.items() if v>0}, flush=True)
if __name__=='__main__':
  for n in sys.argv[1:]:
    f = subject(n); print(n)
    play(f,'today',lambda: fw.Skin(f),nm=n)
    sf = onefit.skin_of(f)
    play(f,'one',lambda: P3(f,0.02,skin_face=sf),nm=n)
    play(sf,'skin itself',lambda: fw.Skin(sf,0.02),nm=n)
