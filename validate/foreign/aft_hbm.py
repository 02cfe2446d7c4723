"""Harmonic balance with AFT for a half plate in Signorini contact: "somebody else's code".

Independent of the program signorini (numpy, scipy and h5py only); writes, next to itself, what
such a code would hand over: half-plate.csv, half-plate.mat, M/K/N_C/N_O.mtx and gap.txt.

Body   1 x 0.3, 10 x 3 bilinear Q4 (2 x 2 Gauss), plane stress, E = rho = thickness = 1, nu = 0.3,
       consistent mass; left edge clamped, bottom edge on rollers, contact on the right edge, gap 1.
NBM    contact stress from the displacement field, lambda = G^-1 R = N_C u_C + N_O u_O; Signorini
       (w = g - u_C >= 0, p = -lambda >= 0, w p = 0) gives, N_C being diagonal,
       u_C = min(g, -N_O u_O / N_C); hence u = A* u_O + d*, A* and d* constant on each contact set.
HBM    u_O(t) = sum_k a_k cos k w t, k = 0..N_h; A*^T (M A* u_O'' + K (A* u_O + d*)) is sampled at
       N_t times of the period and projected on 1, cos w t, ..., cos N_h w t (force form; nothing
       is added for the switches). Newton with frozen sets, in modal coordinates of the open body.

Run:   python validate/foreign/aft_hbm.py
"""
from pathlib import Path

import h5py
import numpy as np
import scipy.io
import scipy.linalg
import scipy.sparse

HERE = Path(__file__).resolve().parent
LX, LY, NX, NY, E, NU, RHO, GAP = 1.0, 0.3, 10, 3, 1.0, 0.3, 1.0, 1.0
NT, NH = 1024, 3
HX, HY = LX / NX, LY / NY
D = E / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])
GAUSS = (-1 / np.sqrt(3), 1 / np.sqrt(3))


# ---- mesh and numbering --------------------------------------------------------------------------
def numbering():
    """Nodes column by column from the left, each column from the bottom up; at each node x, then y.

    u_O takes the free displacements in that order, except the x displacements of the right edge:
    these, from the bottom up, are u_C and come last.
    """
    nodes = np.array([(i * HX, j * HY) for i in range(NX + 1) for j in range(NY + 1)])
    free = np.ones((len(nodes), 2), bool)
    free[nodes[:, 0] == 0] = False  # clamped
    free[nodes[:, 1] == 0, 1] = False  # rollers
    contact = np.flatnonzero(nodes[:, 0] > LX - HX / 2)
    is_c = np.zeros_like(free)
    is_c[contact, 0] = True
    dof = np.full((len(nodes), 2), -1)
    n_o = np.count_nonzero(free & ~is_c)
    dof[free & ~is_c] = np.arange(n_o)  # row-major: node by node, x before y
    dof[is_c] = n_o + np.arange(len(contact))
    # The order that signorini has in /mesh/dof_map for this scene, at nodes at hand:
    where = lambda x, y: tuple(dof[np.argmin(np.hypot(*(nodes - (x, y)).T))])
    assert (n_o, len(contact)) == (66, 4)
    assert where(0, 0.3) == (-1, -1) and where(0.1, 0) == (0, -1) and where(0.1, 0.1) == (1, 2)
    assert where(0.2, 0) == (7, -1) and where(0.9, 0.3) == (61, 62)
    assert where(1, 0) == (66, -1) and where(1, 0.1) == (67, 63) and where(1, 0.3) == (69, 65)
    return nodes, dof, n_o, contact


def shape(xi, eta):
    """Shape functions and strain matrix (3 x 8) of the rectangle at (xi, eta) in [-1, 1]^2."""
    sx, sy = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    n = (1 + sx * xi) * (1 + sy * eta) / 4
    nx, ny = sx * (1 + sy * eta) / 2 / HX, sy * (1 + sx * xi) / 2 / HY
    b = np.zeros((3, 8))
    b[0, 0::2], b[1, 1::2], b[2, 0::2], b[2, 1::2] = nx, ny, ny, nx
    return n, b


def assemble():
    nodes, dof, n_o, contact = numbering()
    n = n_o + len(contact)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    R, G = np.zeros((len(contact), n)), np.zeros((len(contact),) * 2)
    ke, me, re, ge = np.zeros((8, 8)), np.zeros((8, 8)), np.zeros((2, 8)), np.zeros((2, 2))
    for eta in GAUSS:
        for xi in GAUSS:
            N, B = shape(xi, eta)
            ke += B.T @ D @ B * HX * HY / 4
            me += np.kron(np.outer(N, N), np.eye(2)) * RHO * HX * HY / 4
        N, B = shape(1, eta)  # right edge; its nodes are the local nodes 1 (below) and 2 (above)
        re += np.outer(N[1:3], D[0] @ B) * HY / 2  # sigma_n = sigma_xx there
        ge += np.outer(N[1:3], N[1:3]) * HY / 2
    for i in range(NX):
        for j in range(NY):
            a, c = i * (NY + 1) + j, (i + 1) * (NY + 1) + j
            d = dof[[a, c, c + 1, a + 1]].ravel()
            ok = d >= 0
            K[np.ix_(d[ok], d[ok])] += ke[np.ix_(ok, ok)]
            M[np.ix_(d[ok], d[ok])] += me[np.ix_(ok, ok)]
            if i == NX - 1:
                R[np.ix_([j, j + 1], d[ok])] += re[:, ok]
                G[j : j + 2, j : j + 2] += ge
    L = np.linalg.solve(G, R)
    NC, NO = L[:, n_o:], L[:, :n_o]
    assert np.allclose(NC, E / ((1 - NU**2) * HX) * np.eye(len(contact)), atol=1e-12, rtol=0)
    return M, K, NC, NO


# ---- harmonic balance ----------------------------------------------------------------------------
class HBM:
    def __init__(self, M, K, NC, NO):
        self.M, self.K, self.n_o, self.n_c = M, K, NO.shape[1], NO.shape[0]
        self.C = -NO / np.diag(NC)[:, None]  # open: u_C = C u_O
        A, _ = self.projector(np.zeros(self.n_c, bool))
        w2, self.Phi = scipy.linalg.eigh(A.T @ K @ A, A.T @ M @ A)
        self.omega_open = np.sqrt(w2)
        self.sets = {}

    def projector(self, active):
        A = np.vstack([np.eye(self.n_o), np.where(active[:, None], 0, self.C)])
        return A, np.concatenate([np.zeros(self.n_o), np.where(active, GAP, 0)])

    def matrices(self, code):
        """M, K and constant force of one contact set, in the open body's modal coordinates."""
        if code not in self.sets:
            A, d = self.projector((code >> np.arange(self.n_c)) & 1 == 1)
            A = A @ self.Phi
            self.sets[code] = A.T @ self.M @ A, A.T @ self.K @ A, A.T @ self.K @ d
        return self.sets[code]

    def frozen(self, q, omega, c):
        """Contact set at each sample, and the equations J q + f = 0 that hold with these sets."""
        nh, n = q.shape[0] - 1, self.n_o
        codes = ((c @ q) @ (self.C @ self.Phi).T > GAP) @ (1 << np.arange(self.n_c))
        J, f = np.zeros(((nh + 1) * n,) * 2), np.zeros((nh + 1) * n)
        for s in np.unique(codes):
            m, k, d = self.matrices(int(s))
            cs = c[codes == s]
            w = cs.T @ cs / NT
            J += np.kron(w, k) - np.kron(w * (omega * np.arange(nh + 1)) ** 2, m)
            f += np.kron(w[:, 0], d)
        return codes, J, f

    def solve(self, q, omega, tol=1e-6, most=300):
        """Newton; the step is halved (down to 1/16) while it fails to shrink. None if it fails."""
        c = np.cos(2 * np.pi * np.outer(np.arange(NT) / NT, np.arange(q.shape[0])))
        relax, best, since = 1.0, np.inf, 0
        for it in range(most):
            codes, J, f = self.frozen(q, omega, c)
            step = np.linalg.solve(J, -f).reshape(q.shape) - q
            size = np.linalg.norm(step) / max(np.linalg.norm(q), 1e-300)
            if size < tol:
                return q + step, codes, it
            if size < 0.9 * best:
                best, since = size, 0
            else:
                since += 1
                if since >= 8:
                    relax, since = max(relax / 2, 1 / 16), 0
            q = q + relax * step
        self.last = size
        return None

    def energy(self, q):
        """1/2 u^T K u at t = 0."""
        u_o = self.Phi @ q.sum(axis=0)
        u = np.concatenate([u_o, np.minimum(GAP, self.C @ u_o)])
        return u @ self.K @ u / 2
