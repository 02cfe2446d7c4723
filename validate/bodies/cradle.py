"""Three bars that touch, the first of which flies: DOP853 with the complementarity problem solved in every right-hand side, no events. python cradle.py 40"""
import numpy as np,sys
from scipy.integrate import solve_ivp
n=int(sys.argv[1]); h=1/n
def bar(n):
    K=np.zeros((n+1,n+1));M=np.zeros((n+1,n+1))
    for e in range(n):
        i=[e,e+1]; K[np.ix_(i,i)]+=np.array([[1,-1],[-1,1]])/h; M[np.ix_(i,i)]+=h/6*np.array([[2,1],[1,2]])
    return K,M
K1,M1=bar(n); N=3*(n+1); K=np.kron(np.eye(3),K1); M=np.kron(np.eye(3),M1)
ends=[n,n+1,2*n+1,2*n+2]   # massless: a right, b left, b right, c left
o=[i for i in range(N) if i not in ends]
A=np.zeros((N,len(o))); A[o,np.arange(len(o))]=1
Kee=K[np.ix_(ends,ends)];Keo=K[np.ix_(ends,o)]
A[ends]=-np.linalg.solve(Kee,Keo)
M0=A.T@M@A; Mi=np.linalg.inv(M0)
G=np.array([[-1,1,0,0],[0,0,-1,1.]])  # gaps of two contacts
C=G@np.linalg.inv(Kee)@G.T
def tips(uo):
    t=-np.linalg.solve(Kee,Keo@uo); g=G@t
    best=None
    for S in ([],[0],[1],[0,1]):
        lam=np.zeros(2)
        if S: lam[S]=np.linalg.solve(C[np.ix_(S,S)],-g[S])
        w=g+C@lam
        viol=max(0,-lam.min(),-w.min())
        if best is None or viol<best[0]: best=(viol,lam)
    return t+np.linalg.solve(Kee,G.T@best[1])
Koo=K[np.ix_(o,o)];Koe=K[np.ix_(o,ends)]
m=len(o)
def f(t,y):
    u,v=y[:m],y[m:]
    return np.r_[v,-Mi@(Koo@u+Koe@tips(u))]
v0=np.array([1.0 if i<=n else 0 for i in o])
y0=np.r_[np.zeros(m),v0]
s=solve_ivp(f,(0,4),y0,method='DOP853',rtol=1e-9,atol=1e-12,max_step=.002)
v=s.y[m:,-1]
for b in range(3):
    r=np.array([1.0 if b*(n+1)<=i<=b*(n+1)+n else 0 for i in o])
    print(b,(r@M0@v)/(r@M0@r))
