import sys; sys.path.insert(0,'trial_one_skin')
from t13 import *
from facewrinkle.geometry import Untangling
from facewrinkle.geometry.topology import vertex_rings
class Today:
    def __init__(self,f): self.skin=fw.Skin(f,0.2); self.points=self.skin.points; self.b=type('b',(),dict(good=np.ones(len(f.points),bool)))()
    def reset(self): self.skin.reset()
    def set_rates(self,r): self.skin.set_rates(r)
    displacement=property(lambda s: s.skin.displacement)
class U(P4):
    def __init__(self,f,*a,**k):
        super().__init__(f,*a,**k)
        self.unt=Untangling(self.points,f.triangles,*vertex_rings(f.triangles,len(f.points)))
    @property
    def displacement(self):
        x=self.points+P4.displacement.fget(self)
        return self.unt.untangled(x)-self.points
if __name__=='__main__':
  for n in sys.argv[1:]:
    f=subject(n); sf=onefit.skin_of(f)
    print(n,'today'); quick(f,n,Today(f))
    print(n,'skin itself'); quick(sf,n,Today(sf))
    P=U(f,0.2,skin_face=sf); print('bound'); quick(f,n,P)
