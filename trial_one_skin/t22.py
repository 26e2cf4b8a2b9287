import sys; sys.path.insert(0,'trial_one_skin')
import refined, onefit; from bind3 import *
exec(open('trial_one_skin/t21.py').read().split("for n in sys.argv")[0].split("sys.path.insert(0,'trial_one_skin')")[1])
def simmed(f, quad=True):
    t=time.process_time()
    sk=onefit.skin_of(f); b=Bound3(f,sk,quad); t1=time.process_time()
    S=relaxed_shapes(sk); t2=time.process_time(); X=sk.points*sk.unit; P=f.points*f.unit
    out={k:P+b.at(v-X) for k,v in S.items()}
    print('    fit+bind',round(t1-t,2),'simulate',round(t2-t1,2),'follow',round(time.process_time()-t2,2))
    return out
homes={'head':fw.default_face(),'lids':refined.split_home(1,2.0,0)}
for n in sys.argv[1:]:
    f=subject(n); P=f.points*f.unit; area=vertex_areas(P,f.triangles)
    cap=read_shapes(FACES/'ict_face_expressions.npz', f.mesh.n_points, f.unit)
    cs={k:P+summed(cap,v) for k,v in CAP.items()}
    t=time.process_time(); sim=relaxed_shapes(f); t1=time.process_time(); print(n,'simulating today',round(t1-t,2)); S={'cap':cs,'sim':sim}
    for hn,h in homes.items():
        onefit.mean_face=lambda a,h=h:h
        S[hn]=simmed(f)
        if hn=='lids': S[hn+'lin']=simmed(f,False)
    far=relief.off_rims(f); seen=area*far*(f.cavities.depth(f.points)*f.unit<1.0)
    fam=lambda S:{g:[S[u] for u in us if u in S and u in cs] for g,us in GROUPS.items()}
    T={nm:tensors_of(f,FoldShapes(fam(s))) for nm,s in S.items()}
    m=np.array([1,1,1,2,2,2.])
    def cos(a,b): 
        w=seen[:,None]*m; return (w*a*b).sum()/np.sqrt((w*a*a).sum()*(w*b*b).sum())
    for g in GROUPS:
        print('  ',g,*(f'{nm} {cos(T[nm][g],T["cap"][g]):.3f}' for nm in list(T)[1:]), f'sim~lids {cos(T["sim"][g],T["lids"][g]):.3f}', f'strength {[round(float((seen*np.sqrt(np.maximum(T[k][g][:,:3].sum(1),0))).sum()/seen.sum()),4) for k in T]}')
