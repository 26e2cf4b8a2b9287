import sys; sys.path.insert(0,'trial_one_skin')
from t2 import *; from bind4 import *; from t13 import P4
import onefit
for n in sys.argv[1:]:
    f=subject(n); shapes=read_shapes(FACES/'ict_face_expressions.npz', f.mesh.n_points, f.unit)
    m0=measure(f,fw.Skin(f,1.0),shapes); show('today',m0)
    sf=onefit.skin_of(f)
    for tag,mk in (('lids2',lambda: OneSkin2(f,skin_face=sf,lids=True)),('b4',lambda: OneSkin4(f,skin_face=sf))):
        m1=measure(f,mk(),shapes); show(tag,m1); print((m1[0]-m0[0]).round(3),(m1[1]-m0[1]).round(3))
