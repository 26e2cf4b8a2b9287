import sys; sys.path.insert(0,'trial_one_skin')
from refined import *; from t2 import *; from bind3 import *
home = split_home(1, 2.0, 0); onefit.mean_face = lambda a: home
if __name__=='__main__':
  for n in sys.argv[1:]:
    f = subject(n); shapes = read_shapes(FACES/'ict_face_expressions.npz', f.mesh.n_points, f.unit)
    m0 = measure(f, fw.Skin(f, 1.0), shapes); show(n+' today', m0)
    sf = onefit.skin_of(f)
    for quad in (True,False) if n=='ict-0' else (True,):
        show(f'{quad}', m1 := measure(f, OneSkin3(f, skin_face=sf,quad=quad), shapes))
    print('   d cos13', (m1[0]-m0[0]).round(3)); print('   d r', (m1[1]-m0[1]).round(3)); print('   d vr', (m1[3]-m0[3]).round(3))
