"""Harmonic balance with AFT for two rods that meet: "somebody else's code".

Independent of the program signorini (numpy only); writes, next to itself, two-rods.csv.

Bodies Rod a on 0 < x < 1, clamped at 0, of 12 linear elements; rod b on 1.02 < x < 1.72, clamped at
       its right end, of 7; E = rho = area = 1, consistent masses. Their tips are massless: they follow
       what lies behind them, u_s = -k_a.u / k_aa and u_m likewise, and push each other by
       r = max(0, (u_s - u_m - g) / (1/k_aa + 1/k_bb)), g = .02.
Motion M_0 u'' + .3 M_0 u' + K u = f cos wt - (du_s/du - du_m/du) r,   M_0 = A^T M A, K = A^T K A with
       A the open rods' u -> all nodes; f = .025 on the node of rod a at x = .5.
HBM    u = sum of N_h harmonics, r sampled at 4096 times of the period, Newton with the derivative of
       the sampled r, from the linear response upwards in w.

Run:   python validate/foreign/two_rods.py
"""
import csv
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
GAP, ALPHA, FORCE, SAMPLES = 0.02, 0.3, 0.025, 4096
HARMONICS = (15, 45)
OMEGAS = np.arange(1.5, 2.01, 0.1)


def rod(length, n, flipped):
    """Mass and stiffness over the free nodes from the left, and which of them is the tip."""
    h = length / n
    mass, stiffness = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    for e in range(n):
        mass[e:e + 2, e:e + 2] += h / 6 * np.array([[2, 1], [1, 2]])
        stiffness[e:e + 2, e:e + 2] += 1 / h * np.array([[1, -1], [-1, 1]])
    free = slice(0, n) if flipped else slice(1, n + 1)
    return mass[free, free], stiffness[free, free], 0 if flipped else n - 1


def condensed(mass, stiffness, tip):
    """Mass and stiffness over what moves by itself, the tip's row, its stiffness."""
    others = [i for i in range(len(mass)) if i != tip]
    row = -stiffness[tip, others] / stiffness[tip, tip]
    a = np.zeros((len(mass), len(others)))
    a[others, range(len(others))] = 1
    a[tip] = row
    return a.T @ mass @ a, a.T @ stiffness @ a, row, stiffness[tip, tip]


m_a, k_a, row_a, k_aa = condensed(*rod(1.0, 12, False))
m_b, k_b, row_b, k_bb = condensed(*rod(0.7, 7, True))
n_a, n = len(m_a), len(m_a) + len(m_b)
zero = np.zeros((n_a, n - n_a))
M = np.block([[m_a, zero], [zero.T, m_b]])
K = np.block([[k_a, zero], [zero.T, k_b]])
row = np.concatenate([row_a, -row_b])          # u_s - u_m
give = 1 / k_aa + 1 / k_bb
load = np.zeros(n)
load[5] = FORCE                                # x = .5, the sixth free node of rod a
theta = 2 * np.pi * np.arange(SAMPLES) / SAMPLES


def solve(omega, q):
    """Coefficients [function, u], functions 1, cos, sin, cos 2, …; None where Newton's method does not end."""
    count = (len(q) - 1) // 2
    basis = np.ones((SAMPLES, len(q)))
    for k in range(1, count + 1):
        basis[:, 2 * k - 1], basis[:, 2 * k] = np.cos(k * theta), np.sin(k * theta)
    weight = np.full(len(q), 2 / SAMPLES)
    weight[0] = 1 / SAMPLES
    linear = np.zeros((len(q), n, len(q), n))
    linear[0, :, 0, :] = K
    for k in range(1, count + 1):
        c, s, w = 2 * k - 1, 2 * k, k * omega
        for f, g, sign in ((c, s, 1), (s, c, -1)):
            linear[f, :, f, :] = K - w**2 * M
            linear[f, :, g, :] = sign * w * ALPHA * M
    linear = linear.reshape(len(q) * n, -1)
    outer = np.zeros_like(q)
    outer[1] = load
    for _ in range(60):
        over = (basis @ q @ row - GAP) / give
        push = np.maximum(over, 0)
        r = (linear @ q.ravel()).reshape(q.shape) - outer + np.outer(weight * (basis.T @ push), row)
        if np.abs(r).max() < 1e-13:
            return q
        closed = (over > 0)[:, None] * basis
        coupling = (weight[:, None] * (basis.T @ closed)) / give
        jacobian = linear + np.einsum("fg,i,j->figj", coupling, row, row).reshape(linear.shape)
        q = q - np.linalg.solve(jacobian, r.ravel()).reshape(q.shape)
    return None


def main():
    with open(HERE / "two-rods.csv", "w", newline="") as out:
        table = csv.writer(out)
        table.writerow(["point", "omega", "k", "part", *(f"u_{i + 1}" for i in range(n))])
        for count in HARMONICS:
            q = np.zeros((2 * count + 1, n))
            for omega in OMEGAS:
                found = solve(omega, q)
                if found is None:
                    print(f"{count} harmonics: nothing at {omega:.2f}")
                    continue
                q = found
                for f, u in enumerate(q):
                    part = "sin" if f and f % 2 == 0 else "cos"
                    table.writerow([f"{count}-{omega:.2f}", round(omega, 10), (f + 1) // 2, part, *(f"{x:.11e}" for x in u)])


if __name__ == "__main__":
    main()
