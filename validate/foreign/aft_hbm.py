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
       is added for the switches), in modal coordinates of the open body.
Newton The sampled equations jump where a sample changes its set, and with frozen sets alone Newton
       falls from the first mode to rest. So a point is found in two steps: Newton on equations in
       which a sample whose interval holds a switch shares its weight between both sets (then they
       are continuous and the Jacobian knows that switches move), then Newton with frozen sets on
       the plain samples, relaxed when it cycles. Only what the second step solves is written.

Run:   python validate/foreign/aft_hbm.py
"""
import functools
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


def numbering():
    """Nodes column by column from the left, each column from the bottom up; at each node x, then y.

    u_O takes the free displacements in that order, except the x displacements of the right edge:
    these, from the bottom up, are u_C and come last.
    """
    nodes = np.array([(i * HX, j * HY) for i in range(NX + 1) for j in range(NY + 1)])
    free = np.ones((len(nodes), 2), bool)
    free[nodes[:, 0] == 0] = False  # clamped
    free[nodes[:, 1] == 0, 1] = False  # rollers
    is_c = np.zeros_like(free)
    is_c[-(NY + 1) :, 0] = True
    dof = np.full((len(nodes), 2), -1)
    n_o, n_c = np.count_nonzero(free & ~is_c), NY + 1
    dof[free & ~is_c] = np.arange(n_o)  # row-major: node by node, x before y
    dof[is_c] = n_o + np.arange(n_c)
    # What signorini has in /mesh/dof_map for this scene, in closed form (i, j: column, row):
    for (x, y), (a, b) in zip(nodes, dof):
        i, j = round(x / HX), round(y / HY)
        inner = (7 * (i - 1) + max(2 * j - 1, 0), 7 * (i - 1) + 2 * j if j else -1)
        assert (a, b) == ((-1, -1) if i == 0 else inner if i < NX else (66 + j, 62 + j if j else -1))
    return dof, n_o, n_c


def shape(xi, eta):
    """Shape functions and strain matrix (3 x 8) of the rectangle at (xi, eta) in [-1, 1]^2."""
    sx, sy = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    n = (1 + sx * xi) * (1 + sy * eta) / 4
    nx, ny = sx * (1 + sy * eta) / 2 / HX, sy * (1 + sx * xi) / 2 / HY
    b = np.zeros((3, 8))
    b[0, 0::2], b[1, 1::2], b[2, 0::2], b[2, 1::2] = nx, ny, ny, nx
    return n, b


def assemble():
    dof, n_o, n_c = numbering()
    n = n_o + n_c
    K, M, R, G = (np.zeros(s) for s in ((n, n), (n, n), (n_c, n), (n_c, n_c)))
    ke, me, re, ge = (np.zeros(s) for s in ((8, 8), (8, 8), (2, 8), (2, 2)))
    for eta in GAUSS:
        for xi in GAUSS:
            N, B = shape(xi, eta)
            ke += B.T @ D @ B * HX * HY / 4
            me += np.kron(np.outer(N, N), np.eye(2)) * RHO * HX * HY / 4
        N, B = shape(1, eta)  # right edge; its nodes are the local nodes 1 (below) and 2 (above)
        re += np.outer(N[1:3], D[0] @ B) * HY / 2  # sigma_n = sigma_xx there
        ge += np.outer(N[1:3], N[1:3]) * HY / 2
    for i, j in np.ndindex(NX, NY):
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
    assert np.allclose(NC, E / ((1 - NU**2) * HX) * np.eye(n_c), atol=1e-12, rtol=0)
    return M, K, NC, NO


# ---- harmonic balance ----------------------------------------------------------------------------
class HBM:
    def __init__(self, M, K, NC, NO):
        self.M, self.K, self.n_o, self.n_c = M, K, NO.shape[1], NO.shape[0]
        self.C = -NO / np.diag(NC)[:, None]  # open: u_C = C u_O
        A = np.vstack([np.eye(self.n_o), self.C])
        w2, self.Phi = scipy.linalg.eigh(A.T @ K @ A, A.T @ M @ A)
        self.omega_open, self.CPhi = np.sqrt(w2), self.C @ self.Phi

    @functools.lru_cache(64)
    def contact_set(self, alpha):
        """A*, d* (modal) and the projected M, K and force; alpha: 1 closed, 0 open, for each node."""
        alpha = np.array(alpha)
        A = np.vstack([self.Phi, (1 - alpha)[:, None] * self.CPhi])
        d = np.concatenate([np.zeros(self.n_o), alpha * GAP])
        return A, d, A.T @ self.M @ A, A.T @ self.K @ A, A.T @ self.K @ d

    def equations(self, q, omega, share):
        """Projected residual, and its Jacobian, at modal coefficients q (N_h + 1 x n_O)."""
        n, k, dt = self.n_o, np.arange(len(q)), 2 * np.pi / NT
        phase = np.outer(np.arange(NT) * dt, k)
        c, s = np.cos(phase), -k * np.sin(phase)
        c2 = -c * (omega * k) ** 2
        z, dz = c @ q @ self.CPhi.T - GAP, s @ q @ self.CPhi.T
        alpha = (z > 0).astype(float)
        if share:  # part of the interval of a sample that lies on the closed side of the switch
            alpha = np.clip(0.5 + z / np.maximum(np.abs(dz) * dt, 1e-300), 0, 1)
        J, f, moving = np.zeros((q.size, q.size)), np.zeros(q.size), np.zeros((q.size, q.size))
        kinds, of = np.unique(alpha, axis=0, return_inverse=True)
        for kind, a in enumerate(kinds):
            A, d, m, kk, force = self.contact_set(tuple(a))
            here = np.flatnonzero(of.ravel() == kind)
            J += np.kron(c[here].T @ c[here] / NT, kk) + np.kron(c[here].T @ c2[here] / NT, m)
            f += np.kron(c[here].sum(axis=0) / NT, force)
            for i in np.flatnonzero((a > 0) & (a < 1)):  # how the switches of node i move
                for t in here:
                    x, acc = c[t] @ q, c2[t] @ q
                    r = self.M[n + i] @ A @ acc + self.K[n + i] @ (A @ x + d)
                    dF = -self.CPhi[i] * r - A.T @ self.M[:, n + i] * (self.CPhi[i] @ acc)
                    dF += A.T @ self.K[:, n + i] * (GAP - self.CPhi[i] @ x)
                    rate = c[t] / abs(dz[t, i]) - s[t] * z[t, i] * np.sign(dz[t, i]) / dz[t, i] ** 2
                    moving += np.outer(np.kron(c[t], dF), np.kron(rate, self.CPhi[i])) / dt / NT
        return J @ q.ravel() + f, J + moving, alpha

    def newton(self, q, omega, share, tol=1e-6):
        """Coefficients, relative size of the last step, contact states (None: no convergence)."""
        relax, best, stuck = 1.0, np.inf, 0
        for _ in range(60):
            r, J, alpha = self.equations(q, omega, share)
            step = -np.linalg.solve(J, r).reshape(q.shape)
            size = np.linalg.norm(step) / np.linalg.norm(q)
            if size < tol:
                return q + step, size, alpha
            if share:  # damped until the residual falls
                norm = lambda x: np.linalg.norm(self.equations(q + x * step, omega, share)[0])
                falls = lambda x: norm(x) < (1 - x / 10) * np.linalg.norm(r)
                relax = next(filter(falls, 0.5 ** np.arange(6)), None)
                if relax is None:
                    break
            else:  # relaxed when it cycles
                best, stuck = (size, 0) if size < 0.9 * best else (best, stuck + 1)
                if stuck == 6:
                    relax, stuck = relax / 2, 0
            q = q + relax * step
        return None, size, alpha

    def energy(self, q):
        """1/2 u^T K u at t = 0, the far point."""
        u_o = self.Phi @ q.sum(axis=0)
        u = np.concatenate([u_o, np.minimum(GAP, self.C @ u_o)])
        return u @ self.K @ u / 2

    def start(self):
        """First open mode just above grazing, at 1.002 omega_1, N_h = 1."""
        for factor in (1.02, 1.1, 1.2):
            q = np.zeros((2, self.n_o))
            q[1, 0] = -factor * GAP / self.CPhi[np.argmax(np.abs(self.CPhi[:, 0])), 0]
            q, _, alpha = self.newton(q, 1.002 * self.omega_open[0], share=True)
            if q is not None and alpha.any():
                return q
        raise SystemExit("no motion with contact at the start")

    def follow(self, q, omegas):
        """Sequential continuation; a point that fails is passed over."""
        for omega in omegas:
            new = self.newton(q, omega, share=True)[0]
            q = q if new is None else new
        return q


def write_csv(path, points):
    with open(path, "w") as out:
        out.write("point,omega,k,part," + ",".join(f"u_{i + 1}" for i in range(66)) + "\n")
        for p, (omega, a) in enumerate(points):
            for k, row in enumerate(a):
                out.write(f"{p + 1},{omega:.12g},{k},cos," + ",".join(f"{x:.11e}" for x in row) + "\n")


def write_mat(path, points):
    Q = np.zeros((len(points), 2 * NH + 1, 66))  # a_0, a_1, b_1, a_2, b_2, ...
    for p, (_, a) in enumerate(points):
        Q[p, 0], Q[p, 1::2] = a[0], a[1:]
    with h5py.File(path, "w", userblock_size=512) as out:
        for name, x in (("w", np.array([[omega for omega, _ in points]])), ("Q", Q)):
            out.create_dataset(name, data=x.T).attrs["MATLAB_class"] = np.bytes_("double")
    text = b"MATLAB 7.3 MAT-file, Platform: Python/h5py, written by aft_hbm.py, HDF5 schema 1.00 ."
    with open(path, "r+b") as out:
        out.write(text.ljust(116) + bytes(8) + (0x0200).to_bytes(2, "little") + b"IM")


def main():
    M, K, NC, NO = (np.where(np.abs(X) < 1e-14, 0, X) for X in assemble())
    hbm = HBM(M, K, NC, NO)
    print("open body:", *(f"{w:.9f}" for w in hbm.omega_open[:8]))
    for name, X in (("M", M), ("K", K), ("N_C", NC), ("N_O", NO)):
        symmetry = "symmetric" if name in "MK" else "general"
        X = scipy.sparse.coo_matrix((X + X.T) / 2 if name in "MK" else X)
        scipy.io.mmwrite(HERE / f"{name}.mtx", X, precision=17, symmetry=symmetry)
    np.savetxt(HERE / "gap.txt", np.full(len(NC), GAP), fmt="%.17g")

    one = hbm.follow(hbm.start(), np.append(np.arange(1.59, 1.699, 0.005), 1.70))
    q = one
    for _ in range(2, NH + 1):
        q = hbm.follow(np.vstack([q, np.zeros(66)]), [1.70])
    fine = np.append(np.arange(1.72, 1.87, 0.02), 1.87)
    for x, known in ((one, 0.95187), (q, 1.51672)):  # event-resolved harmonic balance
        x, size, _ = hbm.newton(hbm.follow(x, fine), 1.87, share=False)
        print(f"omega 1.87, N_h {len(x) - 1}: energy {hbm.energy(x):.5f}, known {known}")
        assert abs(hbm.energy(x) / known - 1) < 1e-2

    points = []
    print("omega   energy      last step  closed (node-samples of 4 x 1024)")
    for omega in (170 + 2 * np.arange(16)) / 100:
        new, size, _ = hbm.newton(q, omega, share=True)
        if new is None:
            print(f"{omega:.2f}    left out: Newton stays at a relative step of {size:.1e}")
            continue
        q = new
        x, size, alpha = hbm.newton(q, omega, share=False)
        if x is None or not alpha.any():  # failed, or fell to rest
            print(f"{omega:.2f}    left out: plain samples cycle at a relative step of {size:.1e},"
                  f" around energy {hbm.energy(q):.5f}")
            continue
        points.append((omega, x @ hbm.Phi.T))
        print(f"{omega:.2f}    {hbm.energy(x):<10.6f}  {size:.1e}    {int(alpha.sum())}")
    write_csv(HERE / "half-plate.csv", points)
    write_mat(HERE / "half-plate.mat", points)


if __name__ == "__main__":
    main()
