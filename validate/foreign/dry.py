"""Harmonic balance with AFT for dry friction, in the forms of NLvib's and pyHarm's examples: "somebody else's code".

Independent of the program signorini (numpy only); writes, next to itself, jenkins.csv, coulomb.csv and the matrices coulomb-M.mtx, coulomb-K.mtx.

Jenkins  x'' + 2 D w0 x' + w0^2 x + f = F cos wt, w0 = 2, D = .005, F = .1; f of a spring of 5 with a slider of 1: stepped from sample to sample
         through two periods, f = k_t (x - x_before) + f_before, cut to +-1 (the elastic Coulomb element).
Coulomb  two masses of 1 and 0.5 on springs of 4 (to the ground) and 6 (between), dampers of 2 % of critical in proportion to the masses (0.08 M), the
         second rubs on a dry floor with a force of 0.05 under F = .3 cos wt on the first: f = .05 tanh(v/eps), eps = 1e-3 (the regularised element).
HBM      N_h = 31 harmonics, 4096 samples of the period, Newton by least squares with the derivative of the samples by differences of the coefficients.

Run:     python validate/foreign/dry.py
"""
import csv
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SAMPLES, HARMONICS = 4096, 31
theta = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
BASIS = np.ones((SAMPLES, 2 * HARMONICS + 1))
SLOPE = np.zeros_like(BASIS)
for k in range(1, HARMONICS + 1):
    BASIS[:, 2 * k - 1], BASIS[:, 2 * k] = np.cos(k * theta), np.sin(k * theta)
    SLOPE[:, 2 * k - 1], SLOPE[:, 2 * k] = -k * np.sin(k * theta), k * np.cos(k * theta)
WEIGHT = np.full(2 * HARMONICS + 1, 2 / SAMPLES)
WEIGHT[0] = 1 / SAMPLES


def jenkins(x):
    """Force of the element, and its derivative by the sample and by all before it, as coefficients of dx."""
    kt, limit = 5.0, 1.0
    force, last = 0.0, 0.0
    out, rows = np.empty(SAMPLES), np.zeros((SAMPLES, 2 * HARMONICS + 1))
    row, before = np.zeros(2 * HARMONICS + 1), np.zeros(2 * HARMONICS + 1)
    for _ in range(2):
        for i in range(SAMPLES):
            force += kt * (x[i] - last)
            row = row + kt * (BASIS[i] - before)
            if abs(force) > limit:
                force, row = np.sign(force) * limit, np.zeros_like(row)
            last, before = x[i], BASIS[i]
            out[i], rows[i] = force, row
    return out, rows


def solve(mass, damping, stiffness, load, omega, friction, q):
    """Coefficients [function, u] of the balance; `friction` gives the force on one displacement and its derivative by that displacement's coefficients."""
    n, count = len(mass), 2 * HARMONICS + 1
    linear = np.zeros((count, n, count, n))
    linear[0, :, 0, :] = stiffness
    for k in range(1, HARMONICS + 1):
        c, s, w = 2 * k - 1, 2 * k, k * omega
        for f, g, sign in ((c, s, 1), (s, c, -1)):
            linear[f, :, f, :] = stiffness - w**2 * mass
            linear[f, :, g, :] = sign * w * damping
    linear = linear.reshape(count * n, -1)
    outer = np.zeros((count, n))
    outer[1] = load

    def residual(q):
        force, rows, at = friction(q, omega)
        r = (linear @ q.ravel()).reshape(q.shape) - outer
        r[:, at] += WEIGHT * (BASIS.T @ force)
        jacobian = linear.reshape(count, n, count, n).copy()
        jacobian[:, at, :, at] += WEIGHT[:, None] * (BASIS.T @ rows)
        return r, jacobian.reshape(count * n, -1)

    r, jacobian = residual(q)
    for _ in range(200):
        if np.abs(r).max() < 1e-11:
            return q
        step = np.linalg.solve(jacobian, r.ravel()).reshape(q.shape)
        share = 1.0
        while True:
            trial = residual(q - share * step)
            if np.abs(trial[0]).max() < np.abs(r).max() or share < 1e-6:
                break
            share /= 2
        q = q - share * step
        r, jacobian = trial
    return None


def of_jenkins(q, omega):
    return *jenkins(BASIS @ q[:, 0]), 0


def of_coulomb(limit, eps):
    def force(q, omega):
        v = omega * (SLOPE @ q[:, 1])
        t = np.tanh(v / eps)
        return limit * t, (limit * (1 - t**2) / eps * omega)[:, None] * SLOPE, 1

    return force


def write(name, series, n):
    with open(HERE / name, "w", newline="") as f:
        out = csv.writer(f)
        out.writerow(["point", "omega", "k", "part"] + [f"u_{j + 1}" for j in range(n)])
        for p, (omega, q) in enumerate(series):
            for f_ in range(len(q)):
                part = "sin" if f_ > 0 and f_ % 2 == 0 else "cos"
                out.writerow([p, omega, (f_ + 1) // 2, part] + [f"{x:.12e}" for x in q[f_]])


one = np.eye(1)
q, series = np.zeros((2 * HARMONICS + 1, 1)), []
for omega in (2.94, 2.96, 2.98, 3.0):
    if not series:
        q[1] = -0.21
    q = solve(one, 0.02 * one, 4 * one, np.array([0.1]), omega, of_jenkins, q)
    series.append((omega, q))
    print("jenkins", omega, np.abs(BASIS @ q).max())
write("jenkins.csv", series, 1)

mass = np.diag([1.0, 0.5])
stiffness = np.array([[10.0, -6.0], [-6.0, 6.0]])
q, series = np.zeros((2 * HARMONICS + 1, 2)), []
for omega in (1.3, 1.4, 1.5, 1.7, 1.8):
    for eps in (1.0, 0.1, 1e-2, 1e-3):
        q = solve(mass, 0.08 * mass, stiffness, np.array([0.3, 0.0]), omega, of_coulomb(0.05, eps), q)
    series.append((omega, q))
    print("coulomb", omega, np.abs(BASIS @ q).max(axis=0))
write("coulomb.csv", series, 2)
for name, matrix in (("M", mass), ("K", stiffness)):
    entries = "\n".join(f"{x:.17g}" for x in matrix.T.ravel())
    (HERE / f"coulomb-{name}.mtx").write_text(f"%%MatrixMarket matrix array real general\n2 2\n{entries}\n")
