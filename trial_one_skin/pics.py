import sys; sys.path.insert(0,'trial_one_skin')
from t13 import *
from facewrinkle.plotting import Scene, Style, save_picture
def draw(face, u):
    shown=face.mesh.copy(); shown.points=(face.points*face.unit+u)/face.unit; shown.point_data.pop('Normals',None)
    with Scene(face, Style(size=(420,480), view='front', quick=True)) as s: return s.picture(shown)
for n in sys.argv[1:]:
    f=subject(n); sf=onefit.skin_of(f); P=P4(f,0.2,skin_face=sf); A=fw.Skin(f,0.2); rows=[]
    for what in ('AU43','AU12+AU25','AU27','AU18','AU10+AU16','AU24'):
        r=f.atlas.contractions(what); row=[]
        for S in (A,P):
            S.reset(); S.contract(r)
            for _ in range(12): S.step()
            row.append(draw(f,S.displacement))
        rows.append(np.vstack(row))
    save_picture(np.hstack(rows), f'trial_one_skin/{n}.png')
